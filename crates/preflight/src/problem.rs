//! What is wrong with a log: where, how bad, how sure.

use serde::Serialize;

use crate::kind::Kind;
use crate::record_fault::RecordFault;
use crate::settings::CHECKS;
use crate::text;

/// How bad a problem is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// A calibration would be wrong.
    Error,
    /// A calibration may be wrong.
    Warning,
    /// A calibration would be better otherwise.
    Hint,
}

/// One thing that is wrong with a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Problem {
    /// Its kind, by name.
    pub id: &'static str,
    /// How bad.
    pub severity: Severity,
    /// The runs that it concerns; `None` for all.
    pub runs: Option<Vec<String>>,
    /// What, where and what to do.
    pub sentence: String,
    /// How sure, from 0 to 1.
    pub probability: f64,
    /// The key of `dataset.toml` that mends it, or the flag.
    pub fix: Option<String>,
}

impl Problem {
    pub(crate) fn new(kind: &Kind, severity: Severity, runs: Option<Vec<String>>, probability: f64) -> Self {
        let sentence = text::sentence(kind, runs.as_deref());
        Self { id: text::id(kind), severity, runs, sentence, probability, fix: text::fix(kind) }
    }

    /// A fault of the records.
    pub(crate) fn record(fault: RecordFault, severity: Severity, runs: Option<Vec<String>>, probability: f64) -> Self {
        Self::new(&Kind::Record(fault), severity, runs, probability)
    }
}

/// Posterior probability of a fault that explains the data better by so many nats.
pub(crate) fn probability(gain: f64) -> f64 {
    1.0 / (1.0 + (CHECKS.prior_log_odds - gain).clamp(-700.0, 700.0).exp())
}
