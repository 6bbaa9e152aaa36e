//! A dataset one run at a time, for what goes through all runs once: memory is that of the largest run.
//!
//! The tables are gone through once for where each run's rows are; then each run's rows are read where they
//! stand. Tables whose rows of several runs are mixed cannot be read so, and are read as a whole.

use std::path::Path;

use super::grouped::Grouped;
use super::{Loaded, Opened, read};
use crate::counter;
use crate::error::DatasetError;
use crate::record::{Dataset, Run};
use crate::warning::Warning;
use crate::wheel_angles::AngleCarrier;

/// Reads a dataset one run at a time: an iterator over datasets of one run each, in the order of
/// `dataset.toml`, with what was noticed of the run.
///
/// A fault is found when its run is reached; what was handed out before it is sound.
#[derive(Debug)]
pub struct RunByRun {
    header: Dataset,
    warnings: Vec<Warning>,
    rest: Rest,
}

/// The runs that have not been handed out.
#[derive(Debug)]
enum Rest {
    /// With the number of the next, and how far the wheels have turned before it.
    Grouped(Box<Grouped>, usize, AngleCarrier),
    /// All are in memory.
    Mixed(std::vec::IntoIter<Run>),
    /// There was a fault.
    Failed,
}

impl RunByRun {
    /// Opens the dataset in the folder `dir`.
    ///
    /// # Errors
    /// [`DatasetError`] of a fault in the manifest, a header or a run's id.
    pub fn open(dir: &Path) -> Result<Self, DatasetError> {
        let (header, warnings, grouped) = Grouped::survey(Opened::open(dir)?, false)?;
        if let Some(grouped) = grouped {
            return Ok(Self { header, warnings, rest: Rest::Grouped(Box::new(grouped), 0, AngleCarrier::default()) });
        }
        let Loaded { mut dataset, warnings } = read(dir)?;
        let runs = std::mem::take(&mut dataset.runs);
        Ok(Self { header: dataset, warnings, rest: Rest::Mixed(runs.into_iter()) })
    }

    /// All but the runs.
    #[must_use]
    pub const fn header(&self) -> &Dataset {
        &self.header
    }

    /// What was noticed before any run.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }
}

impl Iterator for RunByRun {
    type Item = Result<Loaded, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.rest {
            Rest::Grouped(grouped, next, carrier) => {
                match grouped.read(grouped.info(*next)?.clone(), *next, &self.header.robot) {
                    Ok(mut run) => {
                        *next += 1;
                        carrier.carry_into(&mut run, &self.header.robot);
                        let dataset = Dataset { runs: vec![run], ..self.header.clone() };
                        let warnings = counter::wrap_warnings(&dataset);
                        Some(Ok(Loaded { dataset, warnings }))
                    }
                    Err(error) => {
                        self.rest = Rest::Failed;
                        Some(Err(error))
                    }
                }
            }
            // What was noticed of all was said before the first.
            Rest::Mixed(runs) => {
                let dataset = Dataset { runs: vec![runs.next()?], ..self.header.clone() };
                Some(Ok(Loaded { dataset, warnings: Vec::new() }))
            }
            Rest::Failed => None,
        }
    }
}
