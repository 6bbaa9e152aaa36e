//! What is asked of a diagnosis.

use crate::plan::Limits;
use crate::stage::OnStage;

/// What to leave out of the catalogue, and the limits of the next experiment.
#[derive(Debug, Clone)]
pub struct Options {
    /// Effects that are not to be named, by id.
    pub without: Vec<String>,
    /// Floor, time and speed within which the next experiment is sought; `None`: none is sought.
    pub limits: Option<Limits>,
    /// What is told when a stage begins: a large log takes minutes.
    pub on_stage: OnStage,
    /// Whether models for experiments on their comparison are made.
    pub beam: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { without: Vec::new(), limits: Some(Limits::default()), on_stage: OnStage::default(), beam: false }
    }
}
