//! A dataset one run at a time, for what goes through all runs once: memory is that of the largest run.
//!
//! The tables are gone through once for where each run's rows are; then each run's rows are read where they stand. Tables whose rows of several runs are mixed
//! cannot be read so, and are read as a whole.

use std::path::{Path, PathBuf};

use super::truth::{PointIndex, TruthTable};
use super::{Loaded, Opened, has_truth, odometry, read, without_truth};
use crate::counter;
use crate::error::DatasetError;
use crate::record::{Dataset, Run};
use crate::table::Survey;
use crate::warning::Warning;

/// Reads a dataset one run at a time: an iterator over datasets of one run each, in the order of `dataset.toml`, with what was noticed of the run.
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
    Grouped(Box<Grouped>),
    /// All are in memory.
    Mixed(std::vec::IntoIter<Run>),
    /// There was a fault.
    Failed,
}

#[derive(Debug)]
struct Grouped {
    manifest_file: PathBuf,
    runs: std::iter::Enumerate<std::vec::IntoIter<Run>>,
    run_lines: Vec<u64>,
    odometry: odometry::OdometryTable,
    odometry_rows: Survey,
    truths: Vec<(TruthTable, Survey)>,
    points: PointIndex,
}

impl RunByRun {
    /// Opens the dataset in the folder `dir`.
    ///
    /// # Errors
    /// [`DatasetError`] of a fault in the manifest, a header or a run's id.
    pub fn open(dir: &Path) -> Result<Self, DatasetError> {
        let Opened { mut dataset, manifest_file, run_lines, mut odometry, truths, index, warnings } =
            Opened::open(dir)?;
        let odometry_rows = odometry.survey(&index)?;
        let mut surveyed = Vec::with_capacity(truths.len());
        for mut truth in truths {
            let rows = truth.survey(&index)?;
            surveyed.push((truth, rows));
        }
        if !odometry_rows.is_grouped || surveyed.iter().any(|(_, rows)| !rows.is_grouped) {
            let Loaded { mut dataset, warnings } = read(dir)?;
            let runs = std::mem::take(&mut dataset.runs);
            return Ok(Self { header: dataset, warnings, rest: Rest::Mixed(runs.into_iter()) });
        }
        let runs = std::mem::take(&mut dataset.runs).into_iter().enumerate();
        let points = PointIndex::new(&dataset.points);
        let grouped = Grouped { manifest_file, runs, run_lines, odometry, odometry_rows, truths: surveyed, points };
        Ok(Self { header: dataset, warnings, rest: Rest::Grouped(Box::new(grouped)) })
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

impl Grouped {
    fn next(&mut self, counter_bits: Option<u8>) -> Option<Result<Run, DatasetError>> {
        let (number, mut run) = self.runs.next()?;
        Some(self.fill(number, &mut run, counter_bits).map(|()| run))
    }

    fn fill(&mut self, number: usize, run: &mut Run, counter_bits: Option<u8>) -> Result<(), DatasetError> {
        self.odometry.read_run(number, &self.odometry_rows, run)?;
        if let Some(bits) = counter_bits {
            odometry::unwrap_counters(run, bits);
        }
        for (truth, rows) in &mut self.truths {
            truth.read_run(number, rows, &self.points, run)?;
        }
        if has_truth(run) {
            return Ok(());
        }
        let tables: Vec<_> = self.truths.iter().map(|(truth, _)| truth.name()).collect();
        Err(without_truth(self.manifest_file.clone(), self.run_lines[number], run, &tables))
    }
}

impl Iterator for RunByRun {
    type Item = Result<Loaded, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.rest {
            Rest::Grouped(grouped) => match grouped.next(self.header.robot.counter_bits)? {
                Ok(run) => {
                    let dataset = Dataset { runs: vec![run], ..self.header.clone() };
                    let warnings = counter::wrap_warnings(&dataset);
                    Some(Ok(Loaded { dataset, warnings }))
                }
                Err(error) => {
                    self.rest = Rest::Failed;
                    Some(Err(error))
                }
            },
            // What was noticed of all was said before the first.
            Rest::Mixed(runs) => {
                let dataset = Dataset { runs: vec![runs.next()?], ..self.header.clone() };
                Some(Ok(Loaded { dataset, warnings: Vec::new() }))
            }
            Rest::Failed => None,
        }
    }
}
