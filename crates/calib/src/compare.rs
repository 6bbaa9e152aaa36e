//! Sessions of one robot against each other: each method calibrates on one session and is evaluated on every
//! other, pair by pair.
//!
//! A session evaluated on its own runs shows how well a method describes them; only another one shows what
//! the calibration is worth. Sessions are grouped by the kind of path that they drive, since a method may
//! describe its own kind well and no other. The measure of a pair is the mean final error of position and
//! heading over the runs of the second session; that of a kind, the mean over its ordered pairs.

use std::collections::BTreeSet;

use dataset::{Protocol, Session};
use serde::Serialize;

use crate::drift::{CalibrationDrift, EvaluationOptions, evaluate_runs};
use crate::estimate::{CalibError, Method};
use crate::report::{CalibrationReport, MethodReport, Names};
use crate::trajectory::AugmentedCalibration;

/// Every method on all ordered pairs of sessions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The sessions in the order in which they were given.
    pub sessions: Vec<ComparedSession>,
    /// What the robot believes (`nominal`), calibrations of files, then method by method.
    pub methods: Vec<ComparedMethod>,
}

/// A session that takes part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ComparedSession {
    /// Its name.
    pub dataset: String,
    /// The kind of path that it drives.
    pub path_kind: String,
    /// How many runs it has.
    pub runs: usize,
}

/// One method on all pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedMethod {
    /// The method, or the name of a calibration of a file; `nominal` for what the robot of the evaluated
    /// session believes. The latter two are trained on none of the sessions.
    pub method: String,
    /// Means over the pairs of each two kinds of path.
    pub kinds: Vec<KindMean>,
    /// Pair by pair.
    pub pairs: Vec<Pair>,
    /// Sessions that gave no calibration.
    pub refusals: Vec<Refusal>,
}

/// Mean over the ordered pairs of two kinds of path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KindMean {
    /// What the calibration was found on; `None` for nominal values and a file's.
    pub trained_on: Option<String>,
    /// What it was evaluated on.
    pub evaluated_on: String,
    /// How many pairs have an error; a session is not paired with itself.
    pub pairs: usize,
    /// Mean over the pairs, metres; `None` without pairs.
    pub mean_final_position_m: Option<f64>,
    /// Mean over the pairs, radians; `None` without pairs.
    pub mean_final_heading_rad: Option<f64>,
}

/// A calibration found on one session, on the runs of another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    /// The session that was calibrated on; `None` for nominal values and a file's.
    pub trained_on: Option<String>,
    /// The session that was evaluated on.
    pub evaluated_on: String,
    /// Mean position error at the ends of its runs, metres.
    pub mean_final_position_m: Option<f64>,
    /// Mean heading error there, radians.
    pub mean_final_heading_rad: Option<f64>,
    /// Why there is no error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_null: Option<String>,
}

/// A session on which a method gave no calibration.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Refusal {
    /// The session.
    pub dataset: String,
    /// Its kind of path.
    pub path_kind: String,
    /// The method's reason.
    pub why: String,
}

/// Sessions cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("comparing needs two sessions or more, since a calibration is evaluated on other sessions; there is {0}")]
pub struct TooFewSessions(pub usize);

/// The kind of path that a session drives: `squares`, `straights + spins`, …; `mixed` for more than two
/// protocols, `free` where none is stated.
#[must_use]
pub fn path_kind(session: &Session<'_>) -> String {
    let family = |protocol: Option<Protocol>| match protocol {
        Some(Protocol::Straight) => (0, "straights"),
        Some(Protocol::Spin) => (1, "spins"),
        Some(Protocol::SquareCw | Protocol::SquareCcw) => (2, "squares"),
        Some(Protocol::CircleCw | Protocol::CircleCcw) => (3, "circles"),
        Some(Protocol::Path) => (4, "path"),
        Some(Protocol::Free) | None => (5, "free"),
    };
    let families: BTreeSet<(u8, &str)> = session.runs.iter().map(|run| family(run.info().protocol)).collect();
    let names: Vec<&str> = families.into_iter().map(|(_, name)| name).collect();
    if names.len() > 2 { "mixed".to_owned() } else { names.join(" + ") }
}

/// Calibrates with every method on each session and evaluates on every other one; `done` is called after each
/// method on each session. Calibrations of a file are evaluated on every session.
///
/// # Errors
/// [`TooFewSessions`] for fewer than two sessions.
pub fn compare(
    sessions: &[Session<'_>],
    given: &[AugmentedCalibration],
    methods: &[&dyn Method],
    mut done: impl FnMut(),
) -> Result<Comparison, TooFewSessions> {
    if sessions.len() < 2 {
        return Err(TooFewSessions(sessions.len()));
    }
    let kinds: Vec<String> = sessions.iter().map(path_kind).collect();
    let mut compared = vec![untrained(sessions, &kinds, None)];
    compared.extend(given.iter().map(|calibration| untrained(sessions, &kinds, Some(calibration))));
    for method in methods {
        let mut pairs = Vec::new();
        let mut refusals = Vec::new();
        for (trained, session) in sessions.iter().enumerate() {
            match calibrated(*method, session) {
                Ok(calibration) => {
                    pairs.extend(
                        sessions.iter().enumerate().filter(|(on, _)| *on != trained).map(|(on, other)| {
                            (Some(trained), on, evaluated(Some(session), Some(&calibration), other))
                        }),
                    );
                }
                Err(why) => {
                    let (dataset, path_kind) = (session.name.to_owned(), kinds[trained].clone());
                    refusals.push(Refusal { dataset, path_kind, why });
                }
            }
            done();
        }
        compared.push(ComparedMethod {
            method: method.name().to_owned(),
            kinds: means(&pairs, &kinds),
            pairs: pairs.into_iter().map(|(_, _, pair)| pair).collect(),
            refusals,
        });
    }
    let sessions = sessions.iter().zip(kinds).map(|(session, path_kind)| ComparedSession {
        dataset: session.name.to_owned(),
        path_kind,
        runs: session.runs.len(),
    });
    Ok(Comparison { sessions: sessions.collect(), methods: compared })
}

/// A pair with the positions of its sessions.
type Placed = (Option<usize>, usize, Pair);

/// What is trained on none of the sessions: nominal values, or a calibration of a file.
fn untrained(sessions: &[Session<'_>], kinds: &[String], calibration: Option<&AugmentedCalibration>) -> ComparedMethod {
    let pairs: Vec<Placed> =
        sessions.iter().enumerate().map(|(on, session)| (None, on, evaluated(None, calibration, session))).collect();
    ComparedMethod {
        method: calibration.map_or_else(|| "nominal".to_owned(), |of| of.calibration.name.clone()),
        kinds: means(&pairs, kinds),
        pairs: pairs.into_iter().map(|(_, _, pair)| pair).collect(),
        refusals: Vec::new(),
    }
}

/// The calibration of a method on a session, as its file would have it.
fn calibrated(method: &dyn Method, session: &Session<'_>) -> Result<AugmentedCalibration, String> {
    let outcome = method.calibrate(std::slice::from_ref(session));
    if let Ok(found) = &outcome
        && !found.converged
    {
        return Err(format!("{} came to no answer", method.name()));
    }
    let why = outcome.as_ref().err().map(CalibError::to_string);
    let methods = vec![MethodReport::new(method.name(), &outcome, session.robot)];
    let report = CalibrationReport { dataset: Names::One(session.name.to_owned()), trained_on: Vec::new(), methods };
    report.calibrations().pop().map(AugmentedCalibration::from).ok_or_else(|| why.unwrap_or_default())
}

fn evaluated(trained: Option<&Session<'_>>, calibration: Option<&AugmentedCalibration>, on: &Session<'_>) -> Pair {
    let runs = evaluate_runs(on, calibration, &EvaluationOptions::default(), &mut 0.0);
    let drift = CalibrationDrift::of_runs(calibration.map(|of| &of.calibration), runs);
    Pair {
        trained_on: trained.map(|session| session.name.to_owned()),
        evaluated_on: on.name.to_owned(),
        mean_final_position_m: drift.mean_final_position_m,
        mean_final_heading_rad: drift.mean_final_heading_rad,
        why_null: drift.why_null.filter(|_| drift.mean_final_position_m.is_none()),
    }
}

/// The kinds in the order in which sessions bring them.
fn distinct(kinds: &[String]) -> Vec<&String> {
    let mut distinct = Vec::new();
    for kind in kinds {
        if !distinct.contains(&kind) {
            distinct.push(kind);
        }
    }
    distinct
}

fn means(pairs: &[Placed], kinds: &[String]) -> Vec<KindMean> {
    let untrained = pairs.iter().any(|(trained, _, _)| trained.is_none());
    let trained_kinds: Vec<Option<&String>> =
        if untrained { vec![None] } else { distinct(kinds).into_iter().map(Some).collect() };
    let mut means = Vec::new();
    for trained_on in trained_kinds {
        for evaluated_on in distinct(kinds) {
            let of_kinds = pairs.iter().filter(|(trained, on, _)| {
                trained.map(|trained| &kinds[trained]) == trained_on && &kinds[*on] == evaluated_on
            });
            let errors: Vec<(f64, f64)> = of_kinds
                .filter_map(|(_, _, pair)| pair.mean_final_position_m.zip(pair.mean_final_heading_rad))
                .collect();
            let mean = |of: fn(&(f64, f64)) -> f64| {
                (!errors.is_empty()).then(|| errors.iter().map(of).sum::<f64>() / errors.len() as f64)
            };
            means.push(KindMean {
                trained_on: trained_on.cloned(),
                evaluated_on: evaluated_on.clone(),
                pairs: errors.len(),
                mean_final_position_m: mean(|error| error.0),
                mean_final_heading_rad: mean(|error| error.1),
            });
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::method;
    use dataset::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};
    use kinematics::Wheels;
    use std::f64::consts::PI;

    /// A run of one row of counts, on wheels of 1 mm a tick and a base of 0.3 m times `scale`, with an exact
    /// truth.
    fn run(id: &str, protocol: Protocol, scale: f64, ticks: (i64, i64)) -> Run {
        let (left_m, right_m) = (scale * 1e-3 * to_f64(ticks.0), scale * 1e-3 * to_f64(ticks.1));
        let (distance_m, turn_rad) = (0.5 * (left_m + right_m), (right_m - left_m) / 0.3);
        let end = if turn_rad == 0.0 { (distance_m, 0.0) } else { (0.0, 0.0) };
        Run {
            info: RunInfo { id: id.to_owned(), protocol: Some(protocol), ..RunInfo::default() },
            odometry: Odometry {
                t_s: vec![0.0, 1.0].into(),
                wheels: WheelLog::Ticks(Wheels { left: vec![0, ticks.0], right: vec![0, ticks.1] }),
                ..Odometry::default()
            },
            truth: vec![
                TruthSample::new(0.0, 0.0, 0.0, Some(0.0)),
                TruthSample::new(1.0, end.0, end.1, Some(turn_rad)),
            ],
            ..Run::default()
        }
    }

    fn to_f64(ticks: i64) -> f64 {
        f64::from(i32::try_from(ticks).expect("few"))
    }

    fn dataset(name: &str, runs: Vec<Run>) -> Dataset {
        Dataset {
            provenance: Provenance { name: Some(name.to_owned()), ..Provenance::default() },
            robot: NominalRobot {
                left_wheel_diameter_m: 1.0 / PI,
                right_wheel_diameter_m: 1.0 / PI,
                wheel_separation_m: 0.3,
                ticks_per_rev: Some(1000.0),
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs,
        }
    }

    /// Straights and spins of a robot whose wheels are larger by `scale`.
    fn both(name: &str, scale: f64) -> Dataset {
        let straights = [1000, -1000, 1000, -1000].map(|ticks| run("s", Protocol::Straight, scale, (ticks, ticks)));
        let spins = [300, -300, 300, -300].map(|ticks| run("t", Protocol::Spin, scale, (-ticks, ticks)));
        dataset(name, straights.into_iter().chain(spins).collect())
    }

    fn only_straights(name: &str, scale: f64) -> Dataset {
        dataset(name, vec![run("s", Protocol::Straight, scale, (1000, 1000))])
    }

    #[test]
    fn each_calibration_is_evaluated_on_every_other_session_and_never_on_its_own() {
        let sets = [both("a", 1.02), both("b", 1.03), only_straights("c", 1.05)];
        let sessions: Vec<_> = sets.iter().map(Dataset::session).collect();
        let direct = method("direct").expect("known");
        let mut calls = 0;
        let found = compare(&sessions, &[], &[direct], || calls += 1).expect("three");
        assert_eq!(calls, 3);
        let kinds: Vec<_> = found.sessions.iter().map(|session| session.path_kind.as_str()).collect();
        assert_eq!(kinds, ["straights + spins", "straights + spins", "straights"]);
        let [nominal, direct] = &found.methods[..] else { panic!("nominal and direct") };
        // Under nominal values a metre is 20, 30 and 50 mm short, half of the runs in a and b do not go
        // anywhere.
        let nominal_m: Vec<f64> = nominal.pairs.iter().filter_map(|pair| pair.mean_final_position_m).collect();
        for (found, expected) in nominal_m.iter().zip([0.010, 0.015, 0.050]) {
            assert!((found - expected).abs() < 1e-12, "{nominal_m:?}");
        }
        let pairs: Vec<_> = direct
            .pairs
            .iter()
            .map(|pair| (pair.trained_on.as_deref().unwrap_or(""), pair.evaluated_on.as_str()))
            .collect();
        assert_eq!(pairs, [("a", "b"), ("a", "c"), ("b", "a"), ("b", "c")]);
        // 1.02 on 1.03 and back: 10 mm a metre, half of the runs; on 1.05: 30 and 20 mm.
        let mean = |from: &str, to: &str| {
            let of = |mean: &&KindMean| mean.trained_on.as_deref() == Some(from) && mean.evaluated_on == to;
            direct.kinds.iter().find(of).expect("a mean")
        };
        let among = mean("straights + spins", "straights + spins");
        assert!(among.pairs == 2 && (among.mean_final_position_m.expect("pairs") - 0.005).abs() < 1e-9, "{among:?}");
        let across = mean("straights + spins", "straights");
        assert!(across.pairs == 2 && (across.mean_final_position_m.expect("pairs") - 0.025).abs() < 1e-9, "{across:?}");
        // A refused session gives no pair, and its reason.
        assert_eq!((mean("straights", "straights").pairs, mean("straights", "straights + spins").pairs), (0, 0));
        let [refusal] = &direct.refusals[..] else { panic!("c has no spins: {:?}", direct.refusals) };
        assert!(
            refusal.dataset == "c" && refusal.path_kind == "straights" && refusal.why.contains("direct"),
            "{refusal:?}"
        );
    }

    #[test]
    fn one_session_is_not_compared() {
        let set = both("a", 1.02);
        assert_eq!(compare(&[set.session()], &[], &[], || ()), Err(TooFewSessions(1)));
    }

    #[test]
    fn a_session_of_many_protocols_is_mixed_and_one_of_none_is_free() {
        let kind = |protocols: &[Option<Protocol>]| {
            let runs = protocols.iter().map(|protocol| {
                let mut run = run("r", Protocol::Free, 1.0, (1, 1));
                run.info.protocol = *protocol;
                run
            });
            path_kind(&dataset("a", runs.collect()).session())
        };
        assert_eq!(kind(&[Some(Protocol::SquareCw), Some(Protocol::SquareCcw)]), "squares");
        assert_eq!(kind(&[Some(Protocol::Spin), Some(Protocol::Straight)]), "straights + spins");
        assert_eq!(kind(&[Some(Protocol::Spin), Some(Protocol::Straight), Some(Protocol::CircleCw)]), "mixed");
        assert_eq!(kind(&[None, Some(Protocol::Free)]), "free");
    }
}
