//! Datasets for a diagnosis: as a whole, or stretches of what is too large for that.

use std::path::PathBuf;

use ::diagnose::LargeLog;
use dataset::{Blocks, Dataset};
use estimation::many_rows;

use crate::terminal::{Failure, Terminal, advance, datasets_at, folder_name, read_datasets};

/// What is diagnosed.
pub(crate) enum Log {
    /// All rows of all datasets.
    Whole(Vec<Dataset>),
    /// Stretches of them.
    Large(Box<LargeLog>),
}

impl Log {
    /// Reads datasets; a folder of datasets means all of them.
    pub(crate) fn read(paths: &[PathBuf], terminal: &Terminal) -> Result<Self, Failure> {
        let Some(mut blocks) = blocks_at(paths)?.filter(|blocks| many_rows(blocks)) else {
            return Ok(Self::Whole(read_datasets(paths, terminal)?));
        };
        for (blocks, path) in blocks.iter().zip(datasets_at(paths)?) {
            blocks
                .warnings()
                .iter()
                .for_each(|warning| terminal.remark(&format!("warning: {}: {warning}", path.display())));
        }
        let bar = terminal.stages("reading");
        advance(&bar, "all rows of a large log", 0.0);
        let read = LargeLog::read(&mut blocks);
        bar.finish_and_clear();
        Ok(Self::Large(Box::new(read?)))
    }

    /// The rows that are diagnosed.
    pub(crate) fn datasets(&self) -> &[Dataset] {
        match self {
            Self::Whole(datasets) => datasets,
            Self::Large(log) => log.datasets(),
        }
    }
}

impl<'l> From<&'l Log> for ::diagnose::Log<'l> {
    fn from(log: &'l Log) -> Self {
        match log {
            Log::Whole(datasets) => Self::from(datasets),
            Log::Large(large) => Self::from(&**large),
        }
    }
}

/// The datasets by blocks; `None` where they can be read as a whole only.
pub(crate) fn blocks_at(paths: &[PathBuf]) -> Result<Option<Vec<Blocks>>, Failure> {
    let mut all = Vec::new();
    for path in datasets_at(paths)? {
        // What cannot be read is told by whoever reads it as a whole.
        let Ok(Some(mut blocks)) = Blocks::open(&path) else { return Ok(None) };
        blocks.name_if_nameless(|| folder_name(&path));
        all.push(blocks);
    }
    Ok(Some(all))
}
