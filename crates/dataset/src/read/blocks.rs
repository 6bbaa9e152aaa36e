//! A dataset by blocks of rows, in any order: what goes once through data that are larger than the memory,
//! and beforehand through a part of them.

use std::ops::Range;
use std::path::Path;

use super::grouped::Grouped;
use super::{Loaded, Opened};
use crate::counter;
use crate::error::DatasetError;
use crate::record::{Dataset, RunInfo};
use crate::table::MARKED_ROWS;
use crate::warning::Warning;

/// A dataset whose runs are read whole or in part, any of them at any time; memory is that of the part.
#[derive(Debug)]
pub struct Blocks {
    header: Dataset,
    warnings: Vec<Warning>,
    grouped: Grouped,
}

impl Blocks {
    /// Rows of the odometry in a block; the last of a run has fewer, and a run that something else than
    /// `truth.csv` saw is one block.
    pub const ROWS: usize = MARKED_ROWS;

    /// Opens the dataset in the folder `dir`; `None` where the tables mix the rows of several runs, which can
    /// only be read as a whole.
    ///
    /// # Errors
    /// [`DatasetError`] of a fault in the manifest, a header, a run's id, or the time at the start of a
    /// block.
    pub fn open(dir: &Path) -> Result<Option<Self>, DatasetError> {
        let (header, warnings, grouped) = Grouped::survey(Opened::open(dir)?, true)?;
        Ok(grouped.map(|grouped| Self { header, warnings, grouped }))
    }

    /// All but the runs.
    #[must_use]
    pub const fn header(&self) -> &Dataset {
        &self.header
    }

    /// Names the dataset, for those that do not do so themselves.
    pub fn name_if_nameless(&mut self, name: impl FnOnce() -> String) {
        self.header.provenance.name.get_or_insert_with(name);
    }

    /// What was noticed before any run.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// What is known of each run.
    #[must_use]
    pub fn infos(&self) -> &[RunInfo] {
        self.grouped.infos()
    }

    /// Rows of a run's odometry.
    #[must_use]
    pub fn rows(&self, run: usize) -> usize {
        self.grouped.rows(run)
    }

    /// Rows of all that saw a run.
    #[must_use]
    pub fn seen_rows(&self, run: usize) -> usize {
        self.grouped.seen_rows(run)
    }

    /// How many blocks a run has.
    #[must_use]
    pub fn blocks(&self, run: usize) -> usize {
        self.grouped.blocks(run)
    }

    /// Some blocks of a run as a dataset of one run: their rows, the row behind them, which starts the block
    /// that follows, and what was seen meanwhile. What was seen before the first row or after the last comes
    /// with the first and the last block. Counts start where the counter stood.
    ///
    /// # Errors
    /// [`DatasetError`] of the first fault in these rows; parts that touch find all faults between them.
    ///
    /// # Panics
    /// When the run has no such blocks.
    pub fn read(&mut self, run: usize, blocks: Range<usize>) -> Result<Loaded, DatasetError> {
        assert!(blocks.start < blocks.end && blocks.end <= self.blocks(run), "run {run} has no blocks {blocks:?}");
        let run = self.grouped.read_blocks(run, blocks, &self.header.robot)?;
        let dataset = Dataset { runs: vec![run], ..self.header.clone() };
        let warnings = counter::wrap_warnings(&dataset);
        Ok(Loaded { dataset, warnings })
    }
}
