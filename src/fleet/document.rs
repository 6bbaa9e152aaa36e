//! The JSON document of a fleet.

use std::collections::BTreeMap;

use ::fleet::{
    Change, Failed, Fleet, FleetSession, GEOMETRY, Robot, RobotExcess, SessionDrift, SessionFinding, Undetermined,
};
use calib::nominal_value;
use dataset::Timestamp;
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Document<'f> {
    robots: Vec<RobotOut<'f>>,
    failed: &'f [Failed],
    false_discovery_rate: f64,
    tested_changes: usize,
    datasets: Datasets,
}

#[derive(Serialize)]
struct Datasets {
    computed: usize,
    reused: usize,
}

#[derive(Serialize)]
struct RobotOut<'f> {
    id: &'f str,
    id_is_stated: bool,
    rank: usize,
    sessions: Vec<SessionOut<'f>>,
    /// Parameters, what is not observable and findings are those of the latest session.
    parameters: BTreeMap<&'static str, ParameterOut>,
    not_observable: &'f [Undetermined],
    findings: Option<&'f [SessionFinding]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    findings_why_null: Option<&'static str>,
    changes: &'f [Change],
    excess_drift_percent: &'f RobotExcess,
    warnings: &'f [String],
}

#[derive(Serialize)]
struct SessionOut<'f> {
    dataset: &'f str,
    recorded: Option<Timestamp>,
    path_kind: &'f str,
    runs: usize,
    drift_percent: &'f SessionDrift,
    parameters: BTreeMap<&'static str, ParameterOut>,
    findings: Option<Vec<&'f str>>,
}

/// Metres.
#[derive(Serialize)]
struct ParameterOut {
    value: Option<f64>,
    sigma: Option<f64>,
    nominal: Option<f64>,
}

impl<'f> Document<'f> {
    pub(super) fn of(fleet: &'f Fleet, computed: usize, reused: usize) -> Self {
        Self {
            robots: fleet.robots.iter().map(RobotOut::of).collect(),
            failed: &fleet.failed,
            false_discovery_rate: fleet.false_discovery_rate,
            tested_changes: fleet.tested_changes,
            datasets: Datasets { computed, reused },
        }
    }
}

impl<'f> RobotOut<'f> {
    fn of(robot: &'f Robot) -> Self {
        let latest = &robot.latest().result;
        Self {
            id: &robot.id,
            id_is_stated: robot.id_is_stated,
            rank: robot.rank,
            sessions: robot.sessions.iter().map(SessionOut::of).collect(),
            parameters: parameters(robot.latest()),
            not_observable: &latest.geometry.not_observable,
            findings: latest.findings.as_deref(),
            findings_why_null: latest.findings.is_none().then_some("--calibrate-only: nothing was diagnosed"),
            changes: &robot.changes,
            excess_drift_percent: &robot.excess,
            warnings: &robot.warnings,
        }
    }
}

impl<'f> SessionOut<'f> {
    fn of(session: &'f FleetSession) -> Self {
        let result = &session.result;
        let ids = |all: &'f Vec<SessionFinding>| all.iter().map(|finding| finding.id.as_str()).collect();
        Self {
            dataset: &session.dataset,
            recorded: result.recorded,
            path_kind: &result.path_kind,
            runs: result.runs,
            drift_percent: &result.drift_percent,
            parameters: parameters(session),
            findings: result.findings.as_ref().map(ids),
        }
    }
}

fn parameters(session: &FleetSession) -> BTreeMap<&'static str, ParameterOut> {
    let result = &session.result;
    let of = |(row, parameter): (usize, &calib::Parameter)| {
        let (value, sigma) = (result.geometry.value_m[row], result.geometry.sigma_m(row));
        (parameter.key(), ParameterOut { value, sigma, nominal: nominal_value(&result.nominal, parameter.key()) })
    };
    GEOMETRY.iter().enumerate().map(of).collect()
}
