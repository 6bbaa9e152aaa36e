//! Logs of robots that this project's simulator did not drive ([`plain_robot`]): nothing is wrong with
//! the robot, and nothing is found; what is wrong is named.
//!
//! Kinds of ordinary logs: coarse encoders, slow rows, stamps that jitter, sparse truth, one run or many. The
//! campaign: `YAIR_ROBOTS=40 cargo test --release --test diagnosis ordinary_logs -- --nocapture`.
#![allow(clippy::print_stdout)] // every case with its seed

use std::path::Path;

use diagnose::{Document, Finding, Options, diagnose};
use rayon::prelude::*;
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::ordinary_kinds::{EIGHTH, HALF, QUARTER, asked, kinds, robots};
use plain_robot::{Change, Event, PlainRobot, Records, Reports};

fn diagnosed(robot: &PlainRobot) -> Result<Document, String> {
    diagnosed_in(robot.written().0.path())
}

/// The diagnosis of the dataset in a folder.
pub(crate) fn diagnosed_in(folder: &Path) -> Result<Document, String> {
    let dataset = dataset::read(folder).expect("a dataset").dataset;
    let found = diagnose(std::slice::from_ref(&dataset), &Options::default());
    found.map(|found| found.document).map_err(|error| error.to_string())
}

fn shown(document: &Document) -> Vec<String> {
    let found = document.findings.iter().map(|finding| {
        let term = finding.unlisted_term.as_ref();
        let term = term.map_or(String::new(), |term| {
            let covariates = term.covariates.join(" · ");
            format!(" [{} {covariates} {:.2e} ± {:.1e}]", term.channel, term.coefficient, term.sigma)
        });
        format!("{}{term} z {:.1}", finding.names.join("|"), finding.z)
    });
    let failed = document.checks.iter().filter(|check| !check.passes);
    found.chain(failed.map(|check| format!("check {} p {:.1e}", check.name, check.p_value))).collect()
}

/// Prints what was found in a log and whether that is right, and says it of a log that is not.
fn complaint_of(log: &str, is_right: bool, shown: &[String]) -> Option<String> {
    println!("{} {log}: {}", if is_right { "right" } else { "WRONG" }, shown.join("; "));
    (!is_right).then(|| log.to_owned())
}

/// What is shown of a diagnosis, or why there is none.
pub(crate) fn shown_or_error(found: &Result<Document, String>) -> Vec<String> {
    found.as_ref().map_or_else(|error| vec![error.clone()], shown)
}

/// The diagnoses of robots with a change each, seed by seed.
fn diagnosed_all<T: Sync>(changes: &[(T, Change)]) -> Vec<(&T, u64, Result<Document, String>)> {
    let (robots, first) = robots();
    let seeds = |(what, change)| (first..first + robots).map(move |seed| (what, change, seed));
    let all: Vec<(&T, Change, u64)> = changes.iter().map(|(what, change)| (what, *change)).flat_map(seeds).collect();
    all.into_par_iter()
        .map(|(what, change, seed)| {
            let mut robot = PlainRobot::ordinary(seed);
            change(&mut robot);
            (what, seed, diagnosed(&robot))
        })
        .collect()
}

#[test]
fn nothing_is_found_where_nothing_is_wrong() {
    let kinds: Vec<_> = kinds(EIGHTH).map(|(kind, change, exempt)| ((*kind, *exempt), *change)).collect();
    let (mut with_findings, mut all) = (0, 0);
    for ((kind, exempt), seed, found) in diagnosed_all(&kinds) {
        let is_wrong = found.as_ref().map_or(true, |document| {
            document.findings.iter().any(|finding| !exempt.contains(&finding.names[0].as_str()))
        });
        let complaint = complaint_of(&format!("{kind}, seed {seed}"), !is_wrong, &shown_or_error(&found));
        (with_findings, all) = (with_findings + u64::from(complaint.is_some()), all + 1);
    }
    println!("{with_findings} of {all} nulls have a wrong finding");
    // At 5 % family-wise, more than this many have a chance below 1e-3. Rejects rates from single rows: all
    // logs of coarse encoders have a finding.
    let binomial = Binomial::new(0.05, all).expect("a rate");
    let bound = (0..all).find(|count| binomial.sf(*count) < 1e-3).unwrap_or(all);
    assert!(with_findings <= bound, "{with_findings} of {all}");
}

/// What is wrong with a robot or its log, and the name that is right.
const FAULTS: &[(&str, Change, &str)] = &[
    ("an eccentric wheel", |of| of.eccentricity = 3e-3, "wheel_eccentricity"),
    ("an eccentric wheel, one long log", |of| (of.eccentricity, of.joined) = (3e-3, true), "wheel_eccentricity"),
    (
        "an eccentric wheel, 500 ticks a turn",
        |of| (of.eccentricity, of.ticks_per_rev) = (3e-3, 500.0),
        "wheel_eccentricity",
    ),
    ("truth 50 ms late", |of| of.latency_s = 0.05, "truth_latency"),
    ("truth 50 ms late, one long log", |of| (of.latency_s, of.joined) = (0.05, true), "truth_latency"),
    ("truth 0.4 s late", |of| of.latency_s = 0.4, "truth_latency"),
    ("truth 0.3 s late in one run", |of| of.late_run = Some((6, 0.3)), "truth_latency"),
    ("truth 100 ms late", |of| of.latency_s = 0.1, "truth_latency"),
    ("a clock that is 500 ppm slow, one long log", |of| (of.clock_gain, of.joined) = (-5e-4, true), "clock_rate"),
    ("a clock that is 0.1 % fast, one long log", |of| (of.clock_gain, of.joined) = (1e-3, true), "clock_rate"),
    ("a clock that is 0.4 % slow, one long log", |of| (of.clock_gain, of.joined) = (-4e-3, true), "clock_rate"),
    (
        "a clock that is 0.4 % fast, motion capture",
        |of| (of.clock_gain, of.truth_sigma_m, of.truth_sigma_rad) = (4e-3, 3e-4, 5e-4),
        "clock_rate",
    ),
    (
        "a clock that is 0.1 % fast since the session began",
        |of| (of.clock_gain, of.clock_runs_on) = (1e-3, true),
        "clock_rate",
    ),
    ("play of 2 mm, positions", |of| (of.gap_m, of.reports) = (2e-3, Reports::Positions), "backlash"),
    ("slip with speed", |of| of.slip_s_m = 0.02, "slip_speed"),
    ("slip with speed, one long log", |of| (of.slip_s_m, of.joined) = (0.02, true), "slip_speed"),
    ("wheelbase that grows", |of| of.base_grows_s = 0.02, "turn_rate_wheelbase"),
    (
        "wheelbase that grows, 500 ticks",
        |of| (of.base_grows_s, of.ticks_per_rev) = (0.02, 500.0),
        "turn_rate_wheelbase",
    ),
    ("right counter late by 2 ms", |of| of.right_late_s = 2e-3, "sampling_skew"),
    (
        "truth 50 ms late, speeds in whole mm/s",
        |of| (of.latency_s, of.records) = (0.05, Records::Speeds { step_m_s: 1e-3 }),
        "truth_latency",
    ),
    (
        "wheelbase that grows, twists of three decimals",
        |of| (of.base_grows_s, of.records) = (0.02, Records::Twists { step_m_s: 1e-3, step_rad_s: 1e-3 }),
        "turn_rate_wheelbase",
    ),
    (
        "slip with speed, speeds",
        |of| (of.slip_s_m, of.records) = (0.02, Records::Speeds { step_m_s: 0.0 }),
        "slip_speed",
    ),
    // Not normal, and no large errors: neither bumps nor outliers.
    ("uniform errors of the instrument", |of| of.has_uniform_errors = true, "unlisted"),
];

#[test]
fn what_is_wrong_is_named_and_nothing_else() {
    let faults: Vec<_> =
        asked(FAULTS, QUARTER, |(fault, ..)| fault).map(|(fault, change, id)| ((*fault, *id), *change)).collect();
    let mut complaints = Vec::new();
    for ((fault, id), seed, found) in diagnosed_all(&faults) {
        let is_right = found.as_ref().is_ok_and(|document| {
            // A fault of one run is that run's.
            matches!(&document.findings[..], [finding] if finding.names[0] == *id
                && finding.runs.is_some() == fault.contains("one run"))
        });
        complaints.extend(complaint_of(&format!("{fault}, seed {seed}"), is_right, &shown_or_error(&found)));
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}

/// What is wrong that no name of the catalogue is, and the names that are right all the same.
const UNLISTED: &[(&str, Change, &[&str])] = &[
    // Where in its gap a wheel is when a run begins nobody knows: some begin with a jump of a millimetre.
    ("play of 2 mm", |of| of.gap_m = 2e-3, &["backlash"]),
    // A delay in the mean, that is less where the robot speeds up.
    ("truth filtered over 0.1 s", |of| of.truth_filter_s = 0.1, &["truth_latency"]),
    // The lag of a filter is a delay but where the robot speeds up.
    (
        "filtered speeds at 20 Hz",
        |of| {
            (of.records, of.odometry_hz, of.speed_filter_s) = (Records::Speeds { step_m_s: 0.0 }, 20.0, 0.1);
        },
        &["truth_latency"],
    ),
    ("a slippery patch", |of| of.slippery_band = Some([0.0, 0.6]), &["robot_displaced", "truth_jump"]),
    ("counts lost in bursts", |of| of.bursts_per_s = 0.02, &["robot_displaced", "truth_jump"]),
    (
        "a clock set back by 0.2 s in one run",
        |of| of.events = vec![(5, Event::ClockStep { at_s: 4.0, by_s: -0.2 })],
        &["truth_latency", "truth_jump", "robot_displaced"],
    ),
    (
        "a clock set on by 0.3 s in one run",
        |of| of.events = vec![(5, Event::ClockStep { at_s: 4.0, by_s: 0.3 })],
        &["truth_latency", "truth_jump", "robot_displaced"],
    ),
];

#[test]
fn what_has_no_name_gets_none_without_doubt() {
    let unlisted = asked(UNLISTED, HALF, |(what, ..)| what);
    let unlisted: Vec<_> = unlisted.map(|(what, change, ids)| ((*what, *ids), *change)).collect();
    let mut complaints = Vec::new();
    for ((what, ids), seed, found) in diagnosed_all(&unlisted) {
        let is_right = found.as_ref().is_ok_and(|document| {
            let is_right = |finding: &Finding| {
                finding.names.iter().any(|name| name == "unlisted") || ids.contains(&finding.names[0].as_str())
            };
            !document.findings.is_empty() && document.findings.iter().all(is_right)
        });
        complaints.extend(complaint_of(&format!("{what}, seed {seed}"), is_right, &shown_or_error(&found)));
    }
    println!("{} are wrong", complaints.len());
    // A campaign prints its share; one robot of each is right.
    assert!(robots().0 > 1 || complaints.is_empty(), "{complaints:#?}");
}

/// What does not belong, the run in which it happens, and the causes that are right.
const EVENTS: &[(&str, Change, &[&str])] = &[
    (
        "pushed aside by 0.2 m",
        |of| of.events = vec![(5, Event::Pushed { from_s: 4.0, for_s: 0.5, by: [0.12, -0.15, 0.3] })],
        &["robot_displaced"],
    ),
    ("lifted for 2 s", |of| of.events = vec![(5, Event::Lifted { from_s: 3.0, for_s: 2.0 })], &["robot_displaced"]),
    (
        "the frame jumps by 0.3 m",
        |of| of.events = vec![(5, Event::FrameJump { at_s: 5.0, by: [0.2, 0.25, 0.1] })],
        &["truth_jump"],
    ),
    (
        "frames jump by 0.1 m in four runs",
        |of| {
            let jump = |at_s, by| Event::FrameJump { at_s, by };
            of.events = vec![
                (2, jump(5.0, [0.08, 0.06, -0.05])),
                (6, jump(3.0, [-0.1, 0.02, 0.05])),
                (9, jump(6.0, [0.05, -0.12, 0.02])),
                (11, jump(4.0, [0.07, 0.07, 0.0])),
            ];
        },
        &["truth_jump", "robot_displaced"],
    ),
    (
        "a marker put on otherwise",
        |of| of.events = vec![(7, Event::OtherMarker { at: [0.01, 0.02, 0.12] })],
        &["truth_yaw", "truth_lever_arm"],
    ),
];

/// Logs in which it happens.
const LOGS: &[(&str, Change)] = &[
    ("20 000 ticks at 100 Hz, poses of 1 mm at 10 Hz", |_| {}),
    ("500 ticks at 20 Hz, poses of 3 mm at 5 Hz", |of| {
        (of.ticks_per_rev, of.odometry_hz) = (500.0, 20.0);
        (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad) = (5.0, 3e-3, 3e-3);
    }),
];

#[test]
fn what_happens_in_single_runs_is_named_with_them_and_nothing_else_is_found() {
    let of_kind = std::env::var("YAIR_KIND").unwrap_or_default();
    let events = EVENTS.iter().filter(|(event, ..)| event.contains(&of_kind));
    let (robots, first) = robots();
    let cases: Vec<_> = events
        .flat_map(|event| LOGS.iter().map(move |log| (event, log)))
        .flat_map(|case| (first..first + robots).map(move |seed| (case, seed)))
        .collect();
    let wrong: Vec<String> = cases
        .into_par_iter()
        .filter_map(|(((event, happens, ids), (log, change)), seed)| {
            let mut robot = PlainRobot::ordinary(seed);
            change(&mut robot);
            happens(&mut robot);
            let found = diagnosed(&robot);
            let is_right = found.as_ref().is_ok_and(|document| {
                let is_of_runs = |finding: &Finding| finding.runs.is_some() && ids.contains(&finding.names[0].as_str());
                !document.findings.is_empty() && document.findings.iter().all(is_of_runs)
            });
            let sentences = found.iter().flat_map(|document| &document.findings).map(|of| of.sentence.clone());
            let shown: Vec<String> = shown_or_error(&found).into_iter().chain(sentences).collect();
            complaint_of(&format!("{event}; {log}, seed {seed}"), is_right, &shown)
        })
        .collect();
    println!("{} are wrong", wrong.len());
    // A campaign prints its share; one robot of each kind is right.
    assert!(robots > 1 || wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn what_the_encoders_do_not_resolve_is_said() {
    let changes: &[(bool, Change)] = &[(true, |of| (of.ticks_per_rev, of.odometry_hz) = (30.0, 5.0)), (false, |_| {})];
    for (&is_coarse, _, document) in diagnosed_all(changes) {
        let document = document.expect("a diagnosis");
        let is_unresolved = |id: &str| {
            let of = document.sensitivity.iter().find(|of| of.id == id).expect("an effect of the catalogue");
            of.smallest_detectable.is_none() && of.why.starts_with("not resolved by these encoders")
        };
        // Counts of 17 mm at 5 Hz do not say how slowly a wheel turns; clocks and places they do.
        assert_eq!(is_unresolved("low_speed_truncation"), is_coarse, "{:?}", shown(&document));
        assert!(!is_unresolved("clock_rate") && !is_unresolved("truth_lever_arm"));
    }
}
