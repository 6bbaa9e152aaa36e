//! What is true of a log: `answer.json` beside it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

/// The name of the file with the answer.
pub const ANSWER: &str = "answer.json";

/// What a log asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Question {
    /// Nothing is wrong.
    Null,
    /// One cause.
    One,
    /// Two causes.
    Two,
    /// One cause, which is taken out of the catalogue.
    LeftOut,
    /// Nobody knows: a real robot.
    Unknown,
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cause {
    /// Ids of effects; each of them is right.
    pub right: Vec<String>,
    /// Ids that the data cannot tell from it.
    #[serde(default)]
    pub aliases: Vec<String>,
    /// Whether nobody can be asked for one name, because of aliases or of its size.
    #[serde(default)]
    pub is_aliased: bool,
    /// Whether it is large enough that it must be detected.
    #[serde(default)]
    pub is_plain: bool,
    /// True sizes by the names of JSON, where it has the form of its effect; SI units.
    #[serde(default)]
    pub sizes: BTreeMap<String, f64>,
}

/// What is true of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answer {
    /// Where the log comes from, such as `blind` or `physics`.
    pub corpus: String,
    /// What it asks.
    pub question: Question,
    /// What is wrong.
    #[serde(default)]
    pub causes: Vec<Cause>,
    /// Ids of findings that are right because of what is ordinary about the log; they count nowhere.
    #[serde(default)]
    pub exempt: Vec<String>,
    /// Effects that are taken out of the catalogue for this log.
    #[serde(default)]
    pub without: Vec<String>,
    /// True lengths in metres, by the names that a calibration has in JSON.
    #[serde(default)]
    pub geometry_m: BTreeMap<String, f64>,
    /// The draw that the log is of: logs of two seeds are independent.
    #[serde(default)]
    pub seed: u64,
    /// Levels by stratum.
    #[serde(default)]
    pub strata: BTreeMap<String, String>,
}

impl Answer {
    /// The answer of a log with nothing wrong that is known.
    pub(crate) fn new(corpus: &str, question: Question, seed: u64) -> Self {
        Self {
            corpus: corpus.to_owned(),
            question,
            causes: Vec::new(),
            exempt: Vec::new(),
            without: Vec::new(),
            geometry_m: BTreeMap::new(),
            seed,
            strata: BTreeMap::new(),
        }
    }

    /// Writes the answer into a log's folder: last, so that a folder with an answer is whole.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), String> {
        let file = folder.join(ANSWER);
        let text = serde_json::to_vec_pretty(self).map_err(|error| error.to_string())?;
        fs::create_dir_all(folder)
            .and_then(|()| atomic_file::write_whole(&file, &text))
            .map_err(|error| format!("{}: {error}", file.display()))
    }

    /// Whether one of a finding's names is right because of what is ordinary about the log, and of nothing
    /// that is wrong.
    #[must_use]
    pub fn exempts(&self, names: &[String]) -> bool {
        let is_cause = |name: &String| self.causes.iter().any(|cause| cause.right.contains(name));
        names.iter().any(|name| self.exempt.contains(name) && !is_cause(name))
    }
}

/// Both wheels' diameters and their separation, metres, by the names that a calibration has in JSON.
pub(crate) fn geometry_m(sizes_m: [f64; 3]) -> BTreeMap<String, f64> {
    let names = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];
    names.into_iter().map(str::to_owned).zip(sizes_m).collect()
}
