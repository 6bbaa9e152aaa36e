//! What an importer gives: datasets that were found in another format, whole or a run at a time.

use crate::counter;
use crate::error::DatasetError;
use crate::read::Loaded;
use crate::record::{Dataset, Run};
use crate::warning::Warning;
use crate::wheel_angles::AngleCarrier;

/// One dataset that was found in another format.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// A name for its folder.
    pub name: String,
    /// What was measured.
    pub dataset: Dataset,
    /// What is no error but should be known.
    pub warnings: Vec<Warning>,
}

/// A dataset in another format, whose runs are read one after the other: memory is that of the largest.
pub struct Source {
    /// A name for its folder.
    pub name: String,
    /// All but the runs.
    pub header: Dataset,
    /// Datasets of one run each, in order, up to the first fault.
    pub runs: Box<dyn Iterator<Item = Result<Loaded, DatasetError>> + Send>,
}

impl Source {
    pub(crate) fn new(
        name: String,
        header: Dataset,
        runs: impl Iterator<Item = Result<Run, DatasetError>> + Send + 'static,
    ) -> Self {
        let (of_run, mut carrier) = (header.clone(), AngleCarrier::default());
        let runs = runs.map(move |run| {
            let mut run = run?;
            carrier.carry_into(&mut run, &of_run.robot);
            let dataset = Dataset { runs: vec![run], ..of_run.clone() };
            let warnings = counter::wrap_warnings(&dataset);
            Ok(Loaded { dataset, warnings })
        });
        Self { name, header, runs: Box::new(runs) }
    }

    pub(crate) fn read(self) -> Result<Imported, DatasetError> {
        let Self { name, header: mut dataset, runs } = self;
        let mut all_warnings = Vec::new();
        for loaded in runs {
            let Loaded { dataset: mut of_run, mut warnings } = loaded?;
            dataset.runs.append(&mut of_run.runs);
            all_warnings.append(&mut warnings);
        }
        Ok(Imported { name, dataset, warnings: all_warnings })
    }
}
