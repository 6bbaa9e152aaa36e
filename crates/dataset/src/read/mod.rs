//! Reading a dataset: everything is checked, or nothing is handed out.
//!
//! All headers are read before any table, so that a wrong file among large ones is named at once.

mod manifest;
mod odometry;
mod truth;

use std::path::Path;

use crate::counter;
use crate::error::{DatasetError, shown};
use crate::record::{Dataset, Run};
use crate::table::{RUN_COLUMN, RunIndex, Table};
use crate::warning::Warning;
use manifest::Manifest;
use odometry::OdometryTable;

pub(crate) use manifest::{FORMAT, MANIFEST, MANIFEST_LIMIT_BYTES, is_run_key, meant_quantity, why_no_id};
pub(crate) use odometry::wheel_columns;
pub(crate) use truth::{DISPLACEMENT, POINTS, TRUTH, WHEEL_REFERENCE};

/// What the robot counted.
pub(crate) const ODOMETRY: &str = "odometry.csv";

/// A dataset that was read, and what was noticed on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// The dataset, checked.
    pub dataset: Dataset,
    /// What is no error but should be known; in the order in which it was noticed.
    pub warnings: Vec<Warning>,
}

/// Reads the dataset in the folder `dir`.
///
/// Memory: the columns, reserved exactly (24 bytes a row of ticks, 32 a truth pose), and half a megabyte. Nothing else grows with the
/// tables.
///
/// # Errors
/// [`DatasetError`] with file, line and column of the first fault; see there.
pub fn read(dir: &Path) -> Result<Loaded, DatasetError> {
    if !dir.is_dir() {
        let expected = "a dataset: a folder with dataset.toml, odometry.csv and a truth";
        return Err(DatasetError::NotAFolder { path: dir.to_owned(), expected });
    }
    let manifest_file = dir.join(MANIFEST);
    let Manifest { provenance, robot, robot_line, truth_noise, points, runs: infos, run_lines } =
        Manifest::read(&manifest_file)?;

    let mut warnings = Vec::new();
    let odometry = OdometryTable::open(&dir.join(ODOMETRY), &mut warnings)?;
    if odometry.has_ticks() && robot.ticks_per_rev.is_none() {
        return Err(DatasetError::MissingKey {
            file: manifest_file,
            line: robot_line,
            key: "ticks_per_rev",
            why: "odometry.csv has ticks, and a count is no length without it",
        });
    }
    let truths = truth::open_all(dir, &mut warnings)?;

    let index = RunIndex::new(infos.iter().map(|info| info.id.as_str()));
    let mut runs: Vec<Run> = infos.into_iter().map(|info| Run { info, ..Run::default() }).collect();
    odometry.read(&index, &mut runs)?;
    if let Some(bits) = robot.counter_bits {
        runs.iter_mut().for_each(|run| odometry::unwrap_counters(run, bits));
    }
    let tables: Vec<_> = truths.iter().map(truth::TruthTable::name).collect();
    for truth in truths {
        truth.read(&index, &points, &mut runs)?;
    }
    if let Some((run, line)) = runs.iter().zip(run_lines).find(|(run, _)| !has_truth(run)) {
        let run = shown(run.info.id.as_bytes());
        return Err(DatasetError::RunWithoutTruth { file: manifest_file, line, run, tables: tables.join(", ") });
    }

    let dataset = Dataset { provenance, robot, truth_noise, points, runs };
    warnings.extend(counter::wrap_warnings(&dataset));
    Ok(Loaded { dataset, warnings })
}

/// Whether an outside instrument saw anything of a run.
pub(crate) const fn has_truth(run: &Run) -> bool {
    !(run.truth.is_empty()
        && run.displacements.is_empty()
        && run.point_readings.is_empty()
        && run.wheel_reference.is_empty())
}

/// Warns of the columns that are none of `known` (`run` is).
fn warn_of_unknown(table: &Table, known: &[&str], warnings: &mut Vec<Warning>) {
    for name in table.names() {
        if name != RUN_COLUMN && !known.contains(&name.as_str()) {
            warnings.push(Warning::UnknownColumn {
                file: table.file().to_owned(),
                column: shown(name.as_bytes()),
                known: format!("{RUN_COLUMN}, {}", known.join(", ")),
            });
        }
    }
}
