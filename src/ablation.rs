//! `--settings FILE`: settings in place of the defaults, rules that are switched off, and how often each rule
//! decided.

use std::path::{Path, PathBuf};

use rules::Rule;
use serde::Deserialize;

use crate::import_robot::read_text;
use crate::terminal::Failure;

/// What the file says.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Ablation {
    off: Vec<Rule>,
    decisions: Option<PathBuf>,
    preflight: preflight::settings::Settings,
    estimation: estimation::settings::Settings,
    diagnose: diagnose::settings::Settings,
}

impl Ablation {
    /// Takes the settings of a file, and switches its rules off.
    pub(crate) fn begin(file: &Path) -> Result<Self, Failure> {
        let unreadable = |error: toml::de::Error| format!("{}: {}", file.display(), error.message());
        let ablation: Self = toml::from_str(&read_text(file)?).map_err(unreadable)?;
        rules::switch_off(ablation.off.iter().copied())?;
        preflight::settings::install(ablation.preflight.clone())?;
        estimation::settings::install(ablation.estimation.clone())?;
        diagnose::settings::install(ablation.diagnose.clone())?;
        Ok(ablation)
    }

    /// Writes how often each rule decided.
    pub(crate) fn end(&self) -> Result<(), Failure> {
        let Some((file, decisions)) = self.decisions.as_ref().zip(rules::decisions()) else { return Ok(()) };
        Ok(atomic_file::write_whole(file, serde_json::to_string(&decisions)?.as_bytes())?)
    }
}
