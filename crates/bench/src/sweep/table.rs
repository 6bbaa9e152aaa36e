//! Results on disk: `sweep.json` as the command prints it, `sweep.csv` with a row for each point, method and
//! parameter, the picture, and the trials' rows.

use std::path::{Path, PathBuf};

use super::merge::Merged;
use super::plan::SweepPlan;
use super::result::{EstimatorResult, PointResult, SweepResult};
#[cfg(feature = "parquet")]
use super::rows::write_rows;
use super::spool::{failed, spool_in};
use super::state::STATE_FILE;
use crate::error::BenchError;

/// Writes the results of a whole campaign into its folder, each file in one piece, and takes its state away
/// once they stand.
///
/// # Errors
/// [`BenchError::Write`] with the file and the reason; a file that was there before is then unharmed, and the
/// campaign can be gone on with.
pub fn write_results(plan: &SweepPlan, result: &SweepResult, rows: bool, dir: &Path) -> Result<(), BenchError> {
    let spool = spool_in(dir);
    write_all(plan, result, if rows { std::slice::from_ref(&spool) } else { &[] }, dir)?;
    for path in [dir.join(STATE_FILE), spool] {
        if path.exists() {
            std::fs::remove_file(&path).map_err(|error| failed(&path, &error))?;
        }
    }
    Ok(())
}

/// Writes the results of merged shards; the shards stay as they are.
///
/// # Errors
/// As [`write_results`].
pub fn write_merged(merged: &Merged, dir: &Path) -> Result<(), BenchError> {
    write_all(&merged.plan, &merged.result, &merged.spools, dir)
}

fn write_all(plan: &SweepPlan, result: &SweepResult, spools: &[PathBuf], dir: &Path) -> Result<(), BenchError> {
    atomic_file::create_folder(dir).map_err(|error| failed(dir, &error))?;
    let mut json = serde_json::to_vec_pretty(result).map_err(|error| failed(dir, &error))?;
    json.push(b'\n');
    let csv = csv_bytes(result).map_err(|error| failed(dir, &error))?;
    for (name, bytes) in [("sweep.json", json), ("sweep.csv", csv)] {
        let path = dir.join(name);
        atomic_file::write_whole(&path, &bytes).map_err(|error| failed(&path, &error))?;
    }
    if !spools.is_empty() {
        write_rows(plan, result, spools, dir)?;
    }
    if let Some(page) = super::page::figure(result) {
        page.write(dir, "sweep")?;
    }
    Ok(())
}

#[cfg(not(feature = "parquet"))]
const fn write_rows(_: &SweepPlan, _: &SweepResult, _: &[PathBuf], _: &Path) -> Result<(), BenchError> {
    Err(BenchError::NoParquet)
}

/// Fails before any trial is run, not after, when results could not be written. Makes the folder.
///
/// # Errors
/// [`BenchError::NoParquet`] when rows are asked of a build without the feature `parquet`;
/// [`BenchError::Write`] with the folder and the reason.
pub fn can_be_written(dir: &Path, rows: bool) -> Result<(), BenchError> {
    if rows && cfg!(not(feature = "parquet")) {
        return Err(BenchError::NoParquet);
    }
    atomic_file::refuse_link(dir).map_err(|error| failed(dir, &error))?;
    let probe = || {
        std::fs::create_dir_all(dir)?;
        atomic_file::remove_leftovers(dir);
        atomic_file::stage(&dir.join("sweep.json"), b"").map(drop)
    };
    probe().map_err(|error: std::io::Error| failed(dir, &format!("cannot write results there: {}", error.kind())))
}

/// A column of the CSV after the levels: its name and an estimator's cell.
type Column = (&'static str, fn(&PointResult, &EstimatorResult) -> String);

const COLUMNS: &[Column] = &[
    ("trials", |point, _| point.trials.to_string()),
    ("method", |_, estimator| estimator.method.clone()),
    ("parameter", |_, estimator| estimator.parameter.clone()),
    ("truth", |_, estimator| number(estimator.truth)),
    ("bias", |_, estimator| or_empty(estimator.bias)),
    ("bias_mcse", |_, estimator| or_empty(estimator.bias_mcse)),
    ("variance", |_, estimator| or_empty(estimator.variance)),
    ("variance_mcse", |_, estimator| or_empty(estimator.variance_mcse)),
    ("rmse", |_, estimator| or_empty(estimator.rmse)),
    ("rmse_mcse", |_, estimator| or_empty(estimator.rmse_mcse)),
    ("error_05", |_, estimator| or_empty(estimator.quantiles.first().map(|quantile| quantile.error))),
    ("error_50", |_, estimator| or_empty(estimator.quantiles.get(1).map(|quantile| quantile.error))),
    ("error_95", |_, estimator| or_empty(estimator.quantiles.get(2).map(|quantile| quantile.error))),
    ("coverage", |_, estimator| or_empty(estimator.coverage)),
    ("coverage_low", |_, estimator| or_empty(estimator.coverage_95.and_then(|coverage| coverage.low))),
    ("coverage_high", |_, estimator| or_empty(estimator.coverage_95.and_then(|coverage| coverage.high))),
    ("coverage_68", |_, estimator| or_empty(estimator.coverage_68.map(|coverage| coverage.share))),
    ("failures", |_, estimator| estimator.failures.to_string()),
    ("cramer_rao_sigma", |_, estimator| or_empty(estimator.cramer_rao_sigma)),
    ("cramer_rao_ratio", |_, estimator| or_empty(estimator.cramer_rao_ratio)),
    ("cramer_rao_ratio_mcse", |_, estimator| or_empty(estimator.cramer_rao_ratio_mcse)),
    ("drift_mean_percent", |point, estimator| {
        or_empty(point.drift.iter().find(|drift| drift.method == estimator.method).and_then(|drift| drift.mean_percent))
    }),
];

fn csv_bytes(result: &SweepResult) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let axes = result.points.first().into_iter().flat_map(|point| point.levels.keys().map(String::as_str));
    writer.write_record(axes.chain(COLUMNS.iter().map(|(name, _)| *name)))?;
    for point in &result.points {
        for estimator in &point.estimators {
            let levels = point.levels.values().map(ToString::to_string);
            writer.write_record(levels.chain(COLUMNS.iter().map(|(_, cell)| cell(point, estimator))))?;
        }
    }
    Ok(writer.into_inner()?)
}

/// The shortest text that reads back to the same bits; small numbers with an exponent.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn or_empty(value: Option<f64>) -> String {
    value.map_or_else(String::new, number)
}
