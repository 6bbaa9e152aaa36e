//! `case.toml`: what was checked by which version, how it was read, and what the check said.

use std::path::Path;

use dataset::{Dataset, WheelLog};
use preflight::{Problem, Severity};
use serde::{Deserialize, Serialize};

/// The form that is read and written here.
const FORMAT: i64 = 1;

/// A bundle's record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Case {
    format: i64,
    /// The version that checked the log.
    pub(crate) yair: String,
    system: String,
    /// Without paths.
    pub(crate) command: String,
    /// The log that was checked.
    pub(crate) log: Size,
    /// What the bundle has of it.
    pub(crate) kept: Size,
    #[serde(default)]
    session: Vec<Session>,
    /// What the check said of the whole log, with other names.
    #[serde(default, rename = "problem")]
    pub(crate) problems: Vec<Recorded>,
}

impl Case {
    pub(crate) fn new(command: &str, session: Vec<Session>, log: Size) -> Self {
        Self {
            format: FORMAT,
            yair: env!("CARGO_PKG_VERSION").to_owned(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            command: command.to_owned(),
            kept: log,
            log,
            session,
            problems: Vec::new(),
        }
    }

    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let case: Self = toml::from_str(text).map_err(|error| error.message().replace('\n', "; "))?;
        if case.format == FORMAT {
            return Ok(case);
        }
        Err(format!("format = {}; expected {FORMAT}: it is of another version of yair ({})", case.format, case.yair))
    }
}

/// How large a log is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Size {
    pub(crate) sessions: usize,
    pub(crate) runs: usize,
    pub(crate) odometry_rows: usize,
}

impl Size {
    pub(super) fn of(datasets: &[Dataset]) -> Self {
        let runs = || datasets.iter().flat_map(|dataset| &dataset.runs);
        let odometry_rows = runs().map(|run| run.odometry.t_s.len()).sum();
        Self { sessions: datasets.len(), runs: runs().count(), odometry_rows }
    }
}

/// How a session was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Session {
    wheels: String,
    measured: Vec<String>,
    /// `[corrections]` of its dataset.toml. They are undone in the bundle's tables.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    corrections: toml::Table,
}

/// A number of `[corrections]` that is as large may be a date, and is left out.
const MAX_STATED: f64 = 1e6;

impl Session {
    pub(crate) fn of(dataset: &Dataset, folder: &Path) -> Self {
        let wheels = dataset.runs.first().map_or("none", |run| match run.odometry.wheels {
            WheelLog::Ticks(_) => "ticks",
            WheelLog::Angles(_) => "angles",
            WheelLog::Speeds(_) => "speeds",
            WheelLog::Twist { .. } => "twist",
        });
        let runs = &dataset.runs;
        let measured = [
            ("poses", runs.iter().any(|run| run.truth.iter().any(|of| of.theta_rad().is_some()))),
            ("positions", runs.iter().any(|run| run.truth.iter().any(|of| of.theta_rad().is_none()))),
            ("headings", runs.iter().any(|run| !run.headings.is_empty())),
            ("displacements", runs.iter().any(|run| !run.displacements.is_empty())),
            ("points", runs.iter().any(|run| !run.point_readings.is_empty())),
            ("wheel speeds", runs.iter().any(|run| !run.wheel_reference.is_empty())),
            ("revisits", runs.iter().any(|run| !run.revisits.is_empty())),
            ("distances", runs.iter().any(|run| !run.distances.is_empty())),
            ("walls", runs.iter().any(|run| !run.walls.is_empty())),
            ("gyro", runs.iter().any(dataset::Run::has_gyro)),
        ];
        let measured = measured.into_iter().filter(|(_, is)| *is).map(|(name, _)| name.to_owned()).collect();
        Self { wheels: wheels.to_owned(), measured, corrections: corrections(folder).unwrap_or_default() }
    }
}

/// The table as it is in the file, which was read without an error before.
fn corrections(folder: &Path) -> Option<toml::Table> {
    let text = std::fs::read_to_string(folder.join("dataset.toml")).ok()?;
    let mut manifest: toml::Table = toml::from_str(text.trim_start_matches('\u{feff}')).ok()?;
    let toml::Value::Table(mut corrections) = manifest.remove("corrections")? else { return None };
    corrections.retain(|_, value| match value {
        toml::Value::Boolean(_) => true,
        toml::Value::Float(number) => number.abs() < MAX_STATED,
        toml::Value::Integer(number) => number.unsigned_abs() < MAX_STATED as u64,
        _ => false,
    });
    Some(corrections)
}

/// A problem as it was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Recorded {
    pub(crate) id: String,
    pub(crate) severity: String,
    probability: f64,
    sentence: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    fix: Option<String>,
}

impl From<&Problem> for Recorded {
    fn from(problem: &Problem) -> Self {
        Self {
            id: problem.id.to_owned(),
            severity: severity(problem.severity).to_owned(),
            probability: problem.probability,
            sentence: problem.sentence.clone(),
            fix: problem.fix.clone(),
        }
    }
}

/// A severity as JSON has it.
pub(crate) const fn severity(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Hint => "hint",
    }
}
