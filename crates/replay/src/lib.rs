//! The same logs through two builds of a diagnosis, and paired tables of what each says of them.
//!
//! A log is a folder with its sessions and an `answer.json` ([`Answer`]); a build is an executable that knows
//! the commands `diagnose` and `evaluate` ([`Build`]), so that a build of long ago is asked as it was. What a
//! build says of a log is stored ([`Outcome`]) by the digests of both. Measures ([`MEASURES`]) score a log;
//! two builds are compared on the logs that both were scored on ([`Paired`]), by McNemar's exact test where a
//! measure is a share.

mod answer;
mod blind;
mod build;
mod corpus;
mod measure;
mod outcome;
mod paired;
mod plain;
mod real;
mod table;

pub use answer::{ANSWER, Answer, Cause, Question};
pub use blind::{name as blind_name, write as write_blind_case};
pub use build::Build;
pub use corpus::{Log, counts};
pub use measure::{MEASURES, Measure, Score};
pub use outcome::{Drift, Finding, Outcome, Stated, drift};
pub use paired::{Paired, Verdict, mcnemar};
pub use plain::{kind_name, mixed_name, write_kind, write_mixed};
pub use real::write_real;
pub use table::{Comparison, Level, Spread, Stored};
