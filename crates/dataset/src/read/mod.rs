//! Reading a dataset: everything is checked, or nothing is handed out.
//!
//! All headers are read before any table, so that a wrong file among large ones is named at once.

mod blocks;
mod columns;
mod grouped;
mod manifest;
mod odometry;
mod partial;
mod run_by_run;
mod truth;

use std::path::{Path, PathBuf};

use crate::corrections::Corrections;
use crate::counted;
use crate::counter;
use crate::error::{DatasetError, shown};
use crate::record::{Dataset, ExtraChannel, Run};
use crate::table::RunIndex;
use crate::warning::Warning;
use columns::PointIndex;
use manifest::Manifest;
use odometry::OdometryTable;
use truth::TruthTable;

pub use blocks::Blocks;
pub(crate) use manifest::{FORMAT, MANIFEST, is_run_key, meant_quantity, why_no_id};
pub(crate) use odometry::wheel_columns;
pub(crate) use partial::{DISTANCE, GYRO, REVISIT, WALL};
pub use run_by_run::RunByRun;
pub(crate) use truth::{DISPLACEMENT, POINTS, TRUTH, WHEEL_REFERENCE};

/// What the robot counted.
pub(crate) const ODOMETRY: &str = "odometry.csv";

/// Wheels of the largest haul trucks have 4 m; a larger one is one in millimetres.
const LARGEST_WHEEL_M: f64 = 5.0;

/// The widest haul trucks have 10 m; what is wider is in millimetres.
const LARGEST_SEPARATION_M: f64 = 12.0;

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
/// Memory: the columns, reserved exactly (24 bytes a row of ticks, 32 a truth pose), and half a megabyte.
/// Nothing else grows with the tables. [`RunByRun`] holds one run at a time.
///
/// # Errors
/// [`DatasetError`] with file, line and column of the first fault; see there.
pub fn read(dir: &Path) -> Result<Loaded, DatasetError> {
    let Opened { dataset: mut header, manifest_file, run_lines, corrections, odometry, truths, index, mut warnings } =
        Opened::open(dir)?;
    let runs = &mut header.runs;
    odometry.read(&index, runs)?;
    if let Some(bits) = header.robot.counter_bits {
        runs.iter_mut().for_each(|run| odometry::unwrap_counters(run, bits));
    }
    let tables: Vec<_> = truths.iter().map(TruthTable::name).collect();
    let points = PointIndex::new(&header.points);
    for truth in truths {
        truth.read(&index, &points, runs)?;
    }
    if let Some((run, line)) = runs.iter().zip(run_lines).find(|(run, _)| !has_truth(run)) {
        return Err(without_truth(manifest_file, line, run, &tables));
    }
    header.runs.iter_mut().for_each(|run| corrections.apply(run));
    counted::restore(&mut header.runs, &header.robot);
    warnings.extend(counter::wrap_warnings(&header));
    Ok(Loaded { dataset: header, warnings })
}

fn without_truth(manifest_file: PathBuf, line: u64, run: &Run, tables: &[&str]) -> DatasetError {
    let run = shown(run.info.id.as_bytes());
    DatasetError::RunWithoutTruth { file: manifest_file, line, run, tables: tables.join(", ") }
}

/// A dataset whose manifest and headers have been read.
#[derive(Debug)]
struct Opened {
    /// Its runs have no rows yet.
    dataset: Dataset,
    manifest_file: PathBuf,
    /// Where the manifest speaks of each run.
    run_lines: Vec<u64>,
    corrections: Corrections,
    odometry: OdometryTable,
    truths: Vec<TruthTable>,
    index: RunIndex,
    warnings: Vec<Warning>,
}

impl Opened {
    fn open(dir: &Path) -> Result<Self, DatasetError> {
        if !dir.is_dir() {
            let expected = "a dataset: a folder with dataset.toml, odometry.csv and a truth";
            return Err(DatasetError::NotAFolder { path: dir.to_owned(), expected });
        }
        refuse_links_outside(dir)?;
        let manifest_file = dir.join(MANIFEST);
        let Manifest { provenance, robot, robot_line, truth_noise, corrections, points, runs: infos, run_lines } =
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
        let lengths = [
            ("left_wheel_diameter_m", robot.left_wheel_diameter_m, LARGEST_WHEEL_M),
            ("right_wheel_diameter_m", robot.right_wheel_diameter_m, LARGEST_WHEEL_M),
            ("wheel_separation_m", robot.wheel_separation_m, LARGEST_SEPARATION_M),
        ];
        for (key, value_m, _) in lengths.into_iter().filter(|(_, value_m, largest_m)| value_m > largest_m) {
            warnings.push(Warning::NotMetres { file: manifest_file.clone(), key, value_m });
        }
        let truths = truth::open_all(dir, odometry.has_gyro(), truth_noise.sigma_theta_rad, &mut warnings)?;

        if odometry.has_gyro() && truths.iter().any(|table| table.name() == GYRO) {
            let (file, column) = (dir.join(ODOMETRY), ExtraChannel::GyroYawRate.column());
            warnings.push(Warning::RedundantColumn { file, column, used: GYRO });
        }

        let index = RunIndex::new(infos.iter().map(|info| info.id.as_str()));
        let runs = infos.into_iter().map(|info| Run { info, ..Run::default() }).collect();
        let dataset = Dataset { provenance, robot, truth_noise, points, runs };
        Ok(Self { dataset, manifest_file, run_lines, corrections, odometry, truths, index, warnings })
    }
}

/// A dataset comes from anywhere; what it does not hold itself is not read in its name.
fn refuse_links_outside(dir: &Path) -> Result<(), DatasetError> {
    let io = |source| DatasetError::Io { path: dir.to_owned(), source };
    for entry in dir.read_dir().map_err(io)? {
        let file = entry.map_err(io)?.path();
        let is_part = file.extension().is_some_and(|extension| extension == "csv" || extension == "toml");
        if is_part && let Some(target) = atomic_file::link_outside(dir, &file).map_err(io)? {
            return Err(DatasetError::LinkOutside { file, target });
        }
    }
    Ok(())
}

/// Whether an instrument beside the wheels saw anything of a run.
pub(crate) fn has_truth(run: &Run) -> bool {
    !(run.truth.is_empty()
        && run.displacements.is_empty()
        && run.point_readings.is_empty()
        && run.wheel_reference.is_empty()
        && run.revisits.is_empty()
        && run.distances.is_empty()
        && run.walls.is_empty()
        && run.headings.is_empty()
        && !run.has_gyro())
}
