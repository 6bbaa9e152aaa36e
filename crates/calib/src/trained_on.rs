//! Which runs a calibration was made from, for whoever evaluates it.

use std::collections::BTreeMap;

use dataset::{Run, Session};
use serde::{Deserialize, Serialize};

/// A dataset that a calibration was made from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrainedOn {
    /// Its name.
    pub dataset: String,
    /// The fingerprint of each run, by id.
    pub runs: BTreeMap<String, String>,
}

impl TrainedOn {
    /// All runs of a session.
    #[must_use]
    pub fn of(session: &Session<'_>) -> Self {
        let run = |run: &dataset::RunView<'_>| (run.info().id.clone(), fingerprint(run.run()));
        Self { dataset: session.name.to_owned(), runs: session.runs.iter().map(run).collect() }
    }

    /// Whether a run is one of them.
    #[must_use]
    pub fn has(&self, run: &Run) -> bool {
        let fingerprint = fingerprint(run);
        self.runs.values().any(|known| *known == fingerprint)
    }
}

fn fingerprint(run: &Run) -> String {
    format!("{:016x}", run.fingerprint())
}
