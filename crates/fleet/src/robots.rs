//! The sessions of a fleet as robots: grouped, ordered, compared and ranked.
//!
//! Sessions with the same id are one robot's; a dataset without an id is a robot of its own, under the
//! dataset's name. Sessions of a robot are in the order of their instants.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use dataset::{NominalRobot, Timestamp};
use serde::Serialize;

use crate::change::{Change, changes};
use crate::false_discovery::q_values;
use crate::session::SessionResult;
use crate::settings::DETECTION_SIGMAS;

/// A dataset with what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetSession {
    /// The dataset's path, unique in the fleet.
    pub dataset: String,
    /// What was found.
    pub result: SessionResult,
}

/// A dataset that takes no part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Failed {
    /// The dataset's path.
    pub dataset: String,
    /// Why, and what to do.
    pub error: String,
}

/// All robots, the one to be serviced first at the head.
#[derive(Debug, Clone, PartialEq)]
pub struct Fleet {
    /// By rank.
    pub robots: Vec<Robot>,
    /// What takes no part.
    pub failed: Vec<Failed>,
    /// How many changes were tested.
    pub tested_changes: usize,
    /// The false-discovery rate.
    pub false_discovery_rate: f64,
}

/// One robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Its id, or the path of its only dataset.
    pub id: String,
    /// Whether its datasets state the id.
    pub id_is_stated: bool,
    /// Place in the order of service, from 1.
    pub rank: usize,
    /// At least one, in the order of time.
    pub sessions: Vec<FleetSession>,
    /// Between each two consecutive sessions.
    pub changes: Vec<Change>,
    /// Of the latest session.
    pub excess: RobotExcess,
    /// What to know before the numbers are used.
    pub warnings: Vec<String>,
}

/// Predicted excess drift of a robot as it is configured in its latest session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RobotExcess {
    /// Per cent of the distance; `None` where it is not distinguishable from zero, or not known.
    pub value: Option<f64>,
    /// At most one standard deviation, per cent of the distance.
    pub sigma: Option<f64>,
    /// Probability of as large a difference where the configured geometry is right.
    pub p_value: Option<f64>,
    /// Smallest false-discovery rate over the fleet's robots at which the excess is a discovery.
    pub q_value: Option<f64>,
    /// Whether it is one at the fleet's rate.
    pub distinguishable: bool,
    /// Why there is no value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_null: Option<String>,
}

impl Robot {
    /// The session that tells what the robot is today.
    #[must_use]
    pub fn latest(&self) -> &FleetSession {
        &self.sessions[self.sessions.len() - 1]
    }

    /// The changes between the last two sessions.
    pub fn latest_changes(&self) -> impl Iterator<Item = &Change> {
        let latest = &self.latest().dataset;
        self.changes.iter().filter(move |change| change.to == *latest)
    }
}

impl Fleet {
    /// The fleet of these sessions. Changes and excesses are discoveries at `false_discovery_rate`, each kind
    /// over the whole fleet; the result does not depend on the order of the sessions.
    #[must_use]
    pub fn of(sessions: Vec<FleetSession>, mut failed: Vec<Failed>, false_discovery_rate: f64) -> Self {
        let mut groups: BTreeMap<(bool, String), Vec<FleetSession>> = BTreeMap::new();
        for session in sessions {
            let key = match &session.result.robot_id {
                Some(id) => (true, id.clone()),
                None => (false, session.dataset.clone()),
            };
            groups.entry(key).or_default().push(session);
        }
        let mut robots = Vec::with_capacity(groups.len());
        for ((id_is_stated, id), mut sessions) in groups {
            if sessions.len() > 1 {
                failed.extend(without_instant(&id, &mut sessions));
            }
            sessions.sort_by(|a, b| (a.result.recorded, &a.dataset).cmp(&(b.result.recorded, &b.dataset)));
            robots.extend(robot(id, id_is_stated, sessions));
        }
        failed.sort_by(|a, b| a.dataset.cmp(&b.dataset));
        let tested_changes = judge_changes(&mut robots, false_discovery_rate);
        judge_excesses(&mut robots, false_discovery_rate);
        robots.sort_by(service_order);
        robots.iter_mut().enumerate().for_each(|(place, robot)| robot.rank = place + 1);
        Self { robots, failed, tested_changes, false_discovery_rate }
    }
}

/// Takes the sessions of a robot with several out that have no instant: nothing orders them.
fn without_instant(id: &str, sessions: &mut Vec<FleetSession>) -> Vec<Failed> {
    let count = sessions.len();
    let (dated, undated) = std::mem::take(sessions).into_iter().partition(|session| session.result.recorded.is_some());
    *sessions = dated;
    let why = format!(
        "robot \"{id}\" has {count} sessions, and nothing says when this one was recorded; write recorded = \
         \"2026-11-23T09:00:00+01:00\" (its own instant) above [robot] of its dataset.toml"
    );
    let failed = |session: FleetSession| Failed { dataset: session.dataset, error: why.clone() };
    undated.into_iter().map(failed).collect::<Vec<Failed>>()
}

/// A robot of its ordered sessions, before anything is judged over the fleet; `None` without a session.
fn robot(id: String, id_is_stated: bool, sessions: Vec<FleetSession>) -> Option<Robot> {
    let latest = sessions.last()?;
    let excess = match &latest.result.excess_drift {
        Ok(excess) => RobotExcess {
            value: Some(excess.percent),
            sigma: Some(excess.sigma_percent),
            p_value: Some(excess.p_value),
            q_value: None,
            distinguishable: false,
            why_null: None,
        },
        Err(why) => RobotExcess {
            value: None,
            sigma: None,
            p_value: None,
            q_value: None,
            distinguishable: false,
            why_null: Some(why.clone()),
        },
    };
    let mut found = Vec::new();
    for pair in sessions.windows(2) {
        let [before, after] = pair else { continue };
        // Of two at one instant nobody knows which is the later.
        if before.result.recorded != after.result.recorded {
            let (before, after) = [before, after].map(|of| (of.dataset.as_str(), &of.result.geometry)).into();
            found.extend(changes(before, after));
        }
    }
    let warnings = warnings(&sessions);
    Some(Robot { id, id_is_stated, rank: 0, sessions, changes: found, excess, warnings })
}

fn warnings(sessions: &[FleetSession]) -> Vec<String> {
    let mut warnings = Vec::new();
    for pair in sessions.windows(2) {
        let [before, after] = pair else { continue };
        let (earlier, later) = (&before.dataset, &after.dataset);
        if before.result.recorded == after.result.recorded {
            let at = before.result.recorded.map_or_else(String::new, |at: Timestamp| at.to_string());
            warnings.push(format!(
                "{earlier} and {later} were both recorded at {at}: no change is tested between them; correct recorded in one dataset.toml"
            ));
        }
        if before.result.path_kind != after.result.path_kind {
            warnings.push(format!(
                "{earlier} drives {} and {later} drives {}: what a constant geometry does not describe may look like a change",
                before.result.path_kind, after.result.path_kind
            ));
        }
        if before.result.nominal != after.result.nominal {
            let of = |robot: &NominalRobot| {
                let geometry_m = [robot.left_wheel_diameter_m, robot.right_wheel_diameter_m, robot.wheel_separation_m];
                let ticks = robot.ticks_per_rev.map_or_else(String::new, |ticks| format!(", {ticks} ticks"));
                geometry_m.map(|length_m| format!("{:.3}", 1e3 * length_m)).join(", ") + " mm" + &ticks
            };
            warnings.push(format!(
                "[robot] differs between {earlier} ({}) and {later} ({}): changes are of the calibrated values, the excess is over the later",
                of(&before.result.nominal),
                of(&after.result.nominal)
            ));
        }
    }
    warnings
}

/// Which changes are discoveries over the fleet; how many were tested.
fn judge_changes(robots: &mut [Robot], rate: f64) -> usize {
    let p_values: Vec<f64> = robots.iter().flat_map(|robot| &robot.changes).map(|change| change.p_value).collect();
    let all = robots.iter_mut().flat_map(|robot| &mut robot.changes);
    for (change, q_value) in all.zip(q_values(&p_values)) {
        change.q_value = q_value;
        change.significant = q_value <= rate;
    }
    p_values.len()
}

/// Which excesses are discoveries over the robots; the value of one that is none is taken back.
fn judge_excesses(robots: &mut [Robot], rate: f64) {
    let p_values: Vec<f64> = robots.iter().filter_map(|robot| robot.excess.p_value).collect();
    let known = robots.iter_mut().map(|robot| &mut robot.excess).filter(|excess| excess.p_value.is_some());
    for (excess, q_value) in known.zip(q_values(&p_values)) {
        excess.q_value = Some(q_value);
        excess.distinguishable = q_value <= rate;
        if let (false, Some(value), Some(sigma)) = (excess.distinguishable, excess.value, excess.sigma) {
            excess.value = None;
            excess.why_null = Some(format!(
                "not distinguishable from zero (q = {q_value:.2}); it is below {:.3} % with about 95 % confidence",
                value + DETECTION_SIGMAS * sigma
            ));
        }
    }
}

/// The largest excess first, then robots without a distinguishable one, then those of which it is not known.
fn service_order(a: &Robot, b: &Robot) -> Ordering {
    let by_excess = match (a.excess.value, b.excess.value) {
        (Some(a), Some(b)) => b.total_cmp(&a),
        (a, b) => b.is_some().cmp(&a.is_some()),
    };
    let unknown = |robot: &Robot| robot.excess.p_value.is_none();
    by_excess.then_with(|| unknown(a).cmp(&unknown(b))).then_with(|| a.id.cmp(&b.id))
}

#[cfg(test)]
mod tests;
