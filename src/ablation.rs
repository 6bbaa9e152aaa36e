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
struct Ablation {
    off: Vec<Rule>,
    decisions: Option<PathBuf>,
    dataset: dataset::settings::Settings,
    effects: effects::settings::Settings,
    preflight: preflight::settings::Settings,
    estimation: estimation::settings::Settings,
    diagnose: diagnose::settings::Settings,
}

/// Takes the settings of a file, and switches its rules off; returns the file for the decisions.
pub(crate) fn begin(file: &Path) -> Result<Option<PathBuf>, Failure> {
    let unreadable = |error: toml::de::Error| format!("{}: {}", file.display(), error.message());
    let Ablation { off, decisions, dataset, effects, preflight, estimation, diagnose } =
        toml::from_str(&read_text(file)?).map_err(unreadable)?;
    rules::switch_off(off)?;
    dataset::settings::install(dataset)?;
    effects::settings::install(effects)?;
    preflight::settings::install(preflight)?;
    estimation::settings::install(estimation)?;
    diagnose::settings::install(diagnose)?;
    Ok(decisions)
}

/// Writes how often each rule decided.
pub(crate) fn end(file: &Path) -> Result<(), Failure> {
    Ok(atomic_file::write_whole(file, serde_json::to_string(&rules::decisions())?.as_bytes())?)
}
