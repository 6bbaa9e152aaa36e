//! What a build says of a log, by the keys of its JSON.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A value with its stated standard deviation, SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stated {
    /// The value.
    pub value: f64,
    /// Its standard deviation; `None` where none is stated.
    #[serde(default)]
    pub sigma: Option<f64>,
}

/// A finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Its names, most probable first.
    #[serde(default)]
    pub names: Vec<String>,
    /// Its sizes.
    #[serde(default)]
    pub parameters: BTreeMap<String, Stated>,
}

/// Drift on the sessions driven elsewhere, per cent of the distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// Under the configured values.
    pub configured: f64,
    /// Under the calibration alone.
    pub calibrated: f64,
    /// Under the extended model.
    pub extended: f64,
}

/// What a build says of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Digest of the log.
    pub log: String,
    /// Why there is no diagnosis: the last line on standard error.
    #[serde(default)]
    pub refused: Option<String>,
    /// What is found.
    #[serde(default)]
    pub findings: Vec<Finding>,
    /// Lengths of the calibration, where the log determines all of them.
    #[serde(default)]
    pub lengths: BTreeMap<String, Stated>,
    /// Drift elsewhere, where the log has such sessions and the build evaluates them.
    #[serde(default)]
    pub drift_percent: Option<Drift>,
    /// Seconds of the clock that the diagnosis took.
    pub seconds: f64,
}

/// What is read of `yair diagnose --json`.
#[derive(Deserialize)]
struct Diagnosis {
    #[serde(default)]
    findings: Vec<Finding>,
    #[serde(default)]
    calibration: Calibration,
}

#[derive(Default, Deserialize)]
struct Calibration {
    #[serde(default)]
    methods: Vec<Method>,
}

#[derive(Deserialize)]
struct Method {
    #[serde(default)]
    parameters: BTreeMap<String, Option<Stated>>,
    #[serde(default)]
    not_observable: Vec<serde_json::Value>,
}

/// What is read of `yair evaluate --json`.
#[derive(Deserialize)]
struct Evaluation {
    calibrations: Vec<Evaluated>,
}

#[derive(Deserialize)]
struct Evaluated {
    drift_percent: Option<f64>,
}

impl Outcome {
    /// Reads what a diagnosis printed.
    ///
    /// # Errors
    /// That of the parser.
    pub fn read(log: &str, printed: &[u8], seconds: f64) -> Result<Self, serde_json::Error> {
        let Diagnosis { findings, calibration } = serde_json::from_slice(printed)?;
        // Where something is not observable, lengths are those of a configured scale: nothing to be held to.
        let whole = calibration.methods.into_iter().filter(|method| method.not_observable.is_empty());
        let methods = whole.flat_map(|method| method.parameters);
        let lengths = methods.filter_map(|(name, stated)| Some((name, stated?))).collect();
        Ok(Self { log: log.to_owned(), refused: None, findings, lengths, drift_percent: None, seconds })
    }

    /// The outcome of a log that a build does not diagnose.
    #[must_use]
    pub fn refusal(log: &str, why: String, seconds: f64) -> Self {
        let (findings, lengths) = (Vec::new(), BTreeMap::new());
        Self { log: log.to_owned(), refused: Some(why), findings, lengths, drift_percent: None, seconds }
    }
}

/// Reads the drifts of an evaluation of the configured values, a calibration and an extended model; mean over
/// the sessions that were evaluated, one document each.
#[must_use]
pub fn drift(printed: &[Vec<u8>]) -> Option<Drift> {
    let mut sums = [0.0; 3];
    for session in printed {
        let evaluation: Evaluation = serde_json::from_slice(session).ok()?;
        let [configured, calibrated, extended] = &evaluation.calibrations[..] else { return None };
        for (sum, evaluated) in sums.iter_mut().zip([configured, calibrated, extended]) {
            *sum += evaluated.drift_percent?;
        }
    }
    let [configured, calibrated, extended] = sums.map(|sum| sum / printed.len() as f64);
    (!printed.is_empty()).then_some(Drift { configured, calibrated, extended })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_in_an_old_build_is_missing_and_no_error() {
        let printed = br#"{"verdict": "named", "findings": [{"id": "backlash", "names": ["backlash"], "z": 3}],
            "calibration": {"methods": [{"parameters": {"wheel_separation_m": {"value": 0.3, "sigma": 1e-4}, "x": null}}]}}"#;
        let outcome = Outcome::read("log", printed, 2.0).expect("JSON");
        assert_eq!(outcome.findings[0].names, ["backlash"]);
        assert_eq!(outcome.lengths.len(), 1);
        assert!(Outcome::read("log", b"no JSON", 2.0).is_err());
        let undetermined = br#"{"calibration": {"methods": [{"not_observable": [{"parameter": "common_scale"}],
            "parameters": {"wheel_separation_m": {"value": 0.3, "sigma": 1e-4}}}]}}"#;
        assert_eq!(Outcome::read("log", undetermined, 2.0).expect("JSON").lengths.len(), 0);
    }

    #[test]
    fn drifts_are_means_over_sessions_and_need_three_models() {
        let of = |extended: f64| {
            let all = [2.0, 1.0, extended].map(|drift| format!("{{\"drift_percent\": {drift}}}"));
            format!("{{\"calibrations\": [{}]}}", all.join(",")).into_bytes()
        };
        let found = drift(&[of(0.25), of(0.75)]).expect("drifts");
        assert_eq!([found.configured, found.calibrated, found.extended], [2.0, 1.0, 0.5]);
        assert_eq!(drift(&[]), None);
        assert_eq!(drift(&[br#"{"calibrations": [{"drift_percent": 1}]}"#.to_vec()]), None);
    }
}
