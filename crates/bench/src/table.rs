//! Results on disk: `sweep.json` as the command prints it and `sweep.csv`, a row for each point, method and parameter.

use std::path::Path;

use crate::sweep::{BenchError, SweepResult};

/// Writes both files into `dir`, each in one piece.
///
/// # Errors
/// [`BenchError::Write`] with the file and the reason; a file that was there before is then unharmed.
pub fn write_results(result: &SweepResult, dir: &Path) -> Result<(), BenchError> {
    let failed = |path: &Path, why: String| BenchError::Write { path: path.display().to_string(), why };
    std::fs::create_dir_all(dir).map_err(|error| failed(dir, error.to_string()))?;
    let mut json = serde_json::to_vec_pretty(result).map_err(|error| failed(dir, error.to_string()))?;
    json.push(b'\n');
    let csv = csv_bytes(result).map_err(|error| failed(dir, error.to_string()))?;
    for (name, bytes) in [("sweep.json", json), ("sweep.csv", csv)] {
        let path = dir.join(name);
        report::write_whole(&path, &bytes).map_err(|error| failed(&path, error.to_string()))?;
    }
    Ok(())
}

fn csv_bytes(result: &SweepResult) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let axes: Vec<&str> =
        result.points.first().map_or(Vec::new(), |point| point.levels.keys().map(String::as_str).collect());
    let columns = [
        "method",
        "parameter",
        "truth",
        "bias",
        "bias_mcse",
        "variance",
        "variance_mcse",
        "rmse",
        "rmse_mcse",
        "coverage",
        "failures",
    ];
    writer.write_record(axes.iter().copied().chain(columns))?;
    let or_empty = |value: Option<f64>| value.map_or_else(String::new, number);
    for point in &result.points {
        for estimator in &point.estimators {
            let levels = point.levels.values().map(|level| number(*level));
            let values = [
                estimator.method.clone(),
                estimator.parameter.clone(),
                number(estimator.truth),
                or_empty(estimator.bias),
                or_empty(estimator.bias_mcse),
                or_empty(estimator.variance),
                or_empty(estimator.variance_mcse),
                or_empty(estimator.rmse),
                or_empty(estimator.rmse_mcse),
                or_empty(estimator.coverage),
                estimator.failures.to_string(),
            ];
            writer.write_record(levels.chain(values))?;
        }
    }
    Ok(writer.into_inner()?)
}

/// The shortest text that reads back to the same bits; small numbers with an exponent.
fn number(value: f64) -> String {
    format!("{value:?}")
}
