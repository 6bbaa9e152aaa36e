//! Ratios held against a baseline file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde::{Deserialize, Serialize};

use crate::Ratio;

/// The share of a baseline's ratio that must be left. A loss of a third fails: machines and compilers move
/// ratios by up to a fifth, and overflow checks in the kernels took half.
const MIN_SHARE_LEFT: f64 = 2.0 / 3.0;

/// Ratios by name.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// How many times as fast, by `program/what/than what`.
    pub ratios: BTreeMap<String, Ratio>,
}

/// Why a gate does not hold.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GateError {
    /// The baseline cannot be read or written.
    #[error("{path}: {why}")]
    File {
        /// The baseline file.
        path: PathBuf,
        /// What the system or the parser says.
        why: String,
    },
    /// The baseline has none of what was measured, so that nothing would be compared.
    #[error("{path}: no ratio of {program}; --write PATH makes the baseline")]
    NothingToCompare {
        /// The baseline file.
        path: PathBuf,
        /// The program whose ratios were measured.
        program: String,
    },
    /// Ratios fell.
    #[error("a third of the speed or more was lost: {}", .0.join("; "))]
    Lost(
        /// One sentence a ratio.
        Vec<String>,
    ),
}

/// What a program measured, to be held against a baseline (`--check FILE`) or to become one (`--write FILE`).
#[derive(Debug)]
pub struct Gate {
    program: String,
    measured: Baseline,
}

impl Gate {
    /// For the ratios of one program, which begin with its name in the baseline.
    #[must_use]
    pub fn new(program: &str) -> Self {
        Self { program: program.to_owned(), measured: Baseline::default() }
    }

    /// Adds a ratio.
    pub fn add(&mut self, name: &str, ratio: Ratio) {
        self.measured.ratios.insert(format!("{}/{name}", self.program), ratio);
    }

    /// Does what the arguments ask: compares with the baseline, or writes what was measured into it. Returns
    /// a line for each ratio compared; none where nothing is asked.
    ///
    /// # Errors
    ///
    /// The file cannot be read or written, has nothing to compare, or a third of a ratio was lost.
    pub fn finish(&self, arguments: &[String]) -> Result<Vec<String>, GateError> {
        let after = |flag: &str| arguments.iter().skip_while(|word| *word != flag).nth(1).map(Path::new);
        match (after("--write"), after("--check")) {
            (Some(path), _) => self.write(path).map(|()| Vec::new()),
            (None, Some(path)) => self.check(path),
            (None, None) => Ok(Vec::new()),
        }
    }

    /// [`Self::finish`] as the end of a program: prints what it returns.
    #[must_use]
    #[allow(clippy::print_stdout, clippy::print_stderr)]
    pub fn exit_code(&self, arguments: &[String]) -> ExitCode {
        match self.finish(arguments) {
            Ok(lines) => {
                lines.iter().for_each(|line| println!("{line}"));
                ExitCode::SUCCESS
            }
            Err(error) => {
                eprintln!("{error}");
                ExitCode::FAILURE
            }
        }
    }

    fn read(path: &Path) -> Result<Baseline, GateError> {
        let failed = |why: String| GateError::File { path: path.to_owned(), why };
        let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
        let baseline: Baseline = serde_json::from_str(&text).map_err(|error| failed(error.to_string()))?;
        let is_sound = |ratio: &Ratio| [ratio.median, ratio.low, ratio.high].iter().all(|value| *value > 0.0);
        match baseline.ratios.iter().find(|(_, ratio)| !is_sound(ratio)) {
            Some((name, _)) => Err(failed(format!("{name}: a ratio must be above 0"))),
            None => Ok(baseline),
        }
    }

    /// The other programs' ratios stay.
    fn write(&self, path: &Path) -> Result<(), GateError> {
        let failed = |why: String| GateError::File { path: path.to_owned(), why };
        let mut baseline = if path.exists() { Self::read(path)? } else { Baseline::default() };
        let own = format!("{}/", self.program);
        baseline.ratios.retain(|name, _| !name.starts_with(&own));
        baseline.ratios.extend(self.measured.ratios.clone());
        let text = serde_json::to_string_pretty(&baseline).map_err(|error| failed(error.to_string()))?;
        std::fs::write(path, text + "\n").map_err(|error| failed(error.to_string()))
    }

    fn check(&self, path: &Path) -> Result<Vec<String>, GateError> {
        let baseline = Self::read(path)?;
        let own = format!("{}/", self.program);
        let (mut lines, mut lost, mut compared) = (Vec::new(), Vec::new(), 0);
        for (name, was) in baseline.ratios.iter().filter(|(name, _)| name.starts_with(&own)) {
            let Some(now) = self.measured.ratios.get(name) else {
                lines.push(format!("skipped: {name}: not measured on this machine"));
                continue;
            };
            compared += 1;
            let line = format!(
                "{name}: {:.2} (quartiles {:.2} to {:.2}), baseline {:.2}",
                now.median, now.low, now.high, was.median
            );
            // Not `<`: a ratio that is no number has lost.
            if now.median >= MIN_SHARE_LEFT * was.median { lines.push(line) } else { lost.push(line) }
        }
        if compared == 0 {
            return Err(GateError::NothingToCompare { path: path.to_owned(), program: self.program.clone() });
        }
        if lost.is_empty() { Ok(lines) } else { Err(GateError::Lost(lost)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(median: f64) -> Gate {
        let mut gate = Gate::new("kernel");
        gate.add("vectors", Ratio { median, low: median, high: median });
        gate
    }

    fn arguments(flag: &str, path: &Path) -> Vec<String> {
        vec!["--bench".to_owned(), flag.to_owned(), path.display().to_string()]
    }

    #[test]
    fn a_loss_of_a_third_fails_and_a_smaller_one_does_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("speed.json");
        gate(6.0).finish(&arguments("--write", &path)).expect("written");
        for (median, passes) in [(4.01, true), (9.0, true), (3.99, false), (f64::NAN, false), (0.0, false)] {
            let found = gate(median).finish(&arguments("--check", &path));
            assert_eq!(found.is_ok(), passes, "{median}: {found:?}");
        }
        assert!(gate(0.1).finish(&["--quick".to_owned()]).expect("nothing asked").is_empty());
    }

    #[test]
    fn what_a_machine_cannot_measure_is_skipped_by_name_and_nothing_at_all_fails() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("speed.json");
        let mut wide = gate(6.0);
        wide.add("wide vectors", Ratio { median: 8.0, low: 8.0, high: 8.0 });
        wide.finish(&arguments("--write", &path)).expect("written");
        let lines = gate(6.0).finish(&arguments("--check", &path)).expect("passes");
        assert!(lines.iter().any(|line| line.starts_with("skipped: kernel/wide vectors")), "{lines:?}");
        let other = Gate::new("other").finish(&arguments("--check", &path));
        assert!(matches!(other, Err(GateError::NothingToCompare { .. })), "{other:?}");
        // What one program writes leaves the other's ratios.
        Gate::new("other").finish(&arguments("--write", &path)).expect("written");
        gate(6.0).finish(&arguments("--check", &path)).expect("passes still");
    }

    #[test]
    fn a_baseline_that_passes_anything_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("speed.json");
        for ratio in ["-1.0", "0.0", "1e999", "null"] {
            let text = format!(r#"{{"ratios": {{"kernel/vectors": {{"median": {ratio}, "low": 1.0, "high": 1.0}}}}}}"#);
            std::fs::write(&path, text).expect("written");
            let found = gate(6.0).finish(&arguments("--check", &path));
            assert!(matches!(found, Err(GateError::File { .. })), "{ratio}: {found:?}");
        }
    }
}
