//! Kinds of ordinary logs of robots with which nothing is wrong.

use std::f64::consts::PI;

use crate::robot::{Event, PlainRobot, Records, Reports, Stamps};

/// What makes a robot's log of a kind.
pub type Change = fn(&mut PlainRobot);

/// A name, what is ordinary about the log, and the ids of effects that may be found because of it.
pub type Kind = (&'static str, Change, &'static [&'static str]);

/// What is ordinary about a log, and what may be found in it because it is there.
pub const KINDS: &[Kind] = &[
    ("20 000 ticks a turn", |_| {}, &[]),
    ("40 000 ticks a turn", |of| of.ticks_per_rev = 40_000.0, &[]),
    ("2000 ticks a turn", |of| of.ticks_per_rev = 2000.0, &[]),
    ("500 ticks a turn", |of| of.ticks_per_rev = 500.0, &[]),
    ("120 ticks a turn", |of| of.ticks_per_rev = 120.0, &[]),
    ("500 ticks, speed ripple", |of| (of.ticks_per_rev, of.ripple) = (500.0, 0.03), &[]),
    ("jitter of 2 ms", |of| of.stamps = Stamps::Jitter(2e-3), &["interval_error"]),
    // That stamps are late by 5 ms on average is theirs, not the instrument's.
    ("received 5 ms late", |of| of.stamps = Stamps::Received(5e-3), &["interval_error"]),
    ("counts at 10 Hz", |of| of.odometry_hz = 10.0, &[]),
    ("counts at 20 Hz", |of| of.odometry_hz = 20.0, &[]),
    (
        "500 ticks at 20 Hz, jitter of 3 ms, poses of 3 mm at 5 Hz",
        |of| {
            (of.ticks_per_rev, of.odometry_hz, of.stamps) = (500.0, 20.0, Stamps::Jitter(3e-3));
            (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad) = (5.0, 3e-3, 3e-3);
        },
        &["interval_error"],
    ),
    ("20 Hz, truth between rows", |of| (of.odometry_hz, of.truth_between_rows) = (20.0, 0.5), &[]),
    (
        "counts at 10 Hz, truth of 0.3 mm at 20 Hz",
        |of| (of.odometry_hz, of.truth_sigma_m, of.truth_sigma_rad, of.truth_hz) = (10.0, 3e-4, 5e-4, 20.0),
        &[],
    ),
    (
        "500 ticks at 10 Hz, truth of 0.3 mm at 20 Hz",
        |of| {
            (of.ticks_per_rev, of.odometry_hz) = (500.0, 10.0);
            (of.truth_sigma_m, of.truth_sigma_rad, of.truth_hz) = (3e-4, 5e-4, 20.0);
        },
        &[],
    ),
    ("ends of runs", |of| of.reports = Reports::FirstAndLast, &[]),
    ("ends of four drives", |of| (of.reports, of.only, of.runs) = (Reports::FirstAndLast, Some("free"), 4), &[]),
    // As many numbers as lengths: no scatter shows.
    ("ends of a drive", |of| (of.reports, of.only, of.runs) = (Reports::FirstAndLast, Some("free"), 1), &[]),
    ("positions", |of| of.reports = Reports::Positions, &[]),
    ("truth at 50 Hz", |of| of.truth_hz = 50.0, &[]),
    ("truth at 1 Hz", |of| of.truth_hz = 1.0, &[]),
    ("rough wheels", |of| of.wheel_sigma_m_per_sqrt_m = 2e-3, &[]),
    ("perfect wheels", |of| of.wheel_sigma_m_per_sqrt_m = 0.0, &[]),
    ("one run", |of| of.runs = 1, &[]),
    ("four runs", |of| of.runs = 4, &[]),
    ("one long log", |of| of.joined = true, &[]),
    ("3 % of rows lost", |of| of.lost_rows = 0.03, &["dropped_samples"]),
    ("rows where counts change", |of| of.logs_changes_alone = true, &["dropped_samples"]),
    (
        "rows where counts change, 500 ticks",
        |of| (of.logs_changes_alone, of.ticks_per_rev) = (true, 500.0),
        &["dropped_samples"],
    ),
    ("stamps of whole milliseconds at 30 Hz", |of| (of.odometry_hz, of.stamps) = (30.0, Stamps::RoundedTo(1e-3)), &[]),
    (
        "stamps of whole hundredths at 30 Hz",
        |of| (of.odometry_hz, of.stamps) = (30.0, Stamps::RoundedTo(1e-2)),
        &["interval_error"],
    ),
    ("rows sent by five", |of| of.rows_per_packet = 5, &["interval_error"]),
    ("logs that begin in motion", |of| of.starts_moving = true, &[]),
    ("truth that pauses for 3 s", |of| of.truth_pause_s = Some([3.0, 6.0]), &[]),
    ("30 % of poses lost", |of| of.lost_poses = 0.3, &[]),
    ("2 % outliers", |of| of.outliers = 0.02, &["truth_outliers"]),
    ("10 % outliers", |of| of.outliers = 0.1, &["truth_outliers"]),
    ("errors stated half", |of| of.stated = 0.5, &[]),
    ("errors stated fivefold", |of| of.stated = 5.0, &[]),
    ("errors not stated", |of| of.stated = 0.0, &[]),
    ("errors correlated over 1 s", |of| of.truth_tau_s = 1.0, &["truth_correlated_noise"]),
    ("errors correlated over 0.1 s", |of| of.truth_tau_s = 0.1, &["truth_correlated_noise"]),
    ("errors that grow with distance", |of| of.truth_grows_per_m = 1.0, &["unlisted", "truth_outliers"]),
    ("headings within half a turn", |of| of.wraps = true, &[]),
    ("headings within half a turn at 1 Hz", |of| (of.wraps, of.truth_hz) = (true, 1.0), &[]),
    ("truth at 100 Hz of 0.2 mm", |of| (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad) = (100.0, 2e-4, 4e-4), &[]),
    ("truth of 2 cm and 20 mrad", |of| (of.truth_sigma_m, of.truth_sigma_rad) = (2e-2, 2e-2), &[]),
    (
        "particle filter",
        |of| {
            (of.ticks_per_rev, of.odometry_hz, of.stamps) = (4096.0, 30.0, Stamps::Jitter(5e-3));
            (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad, of.truth_tau_s) = (2.0, 2e-2, 1e-2, 2.0);
            (of.latency_s, of.outliers) = (0.1, 0.01);
        },
        &["truth_latency", "truth_correlated_noise", "interval_error", "truth_outliers"],
    ),
    (
        "camera and tags",
        |of| {
            (of.ticks_per_rev, of.odometry_hz) = (2048.0, 50.0);
            (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad, of.truth_grows_per_m) = (20.0, 5e-3, 5e-3, 1.0);
            (of.latency_s, of.outliers, of.lost_poses) = (0.04, 0.02, 0.3);
            (of.truth_pause_s, of.wraps) = (Some([4.0, 6.0]), true);
        },
        &["truth_latency", "truth_outliers", "unlisted"],
    ),
    (
        "vehicle and total station",
        |of| {
            (of.scale, of.ticks_per_rev, of.odometry_hz) = (3.0, 1000.0, 20.0);
            (of.reports, of.truth_hz, of.truth_sigma_m, of.latency_s) = (Reports::Positions, 5.0, 2e-3, 0.08);
        },
        &["truth_latency"],
    ),
    (
        "motion capture",
        |of| {
            (of.odometry_hz, of.ticks_per_rev) = (50.0, 2000.0);
            (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad, of.latency_s) = (100.0, 2e-4, 4e-4, 0.008);
        },
        &["truth_latency"],
    ),
    (
        "one long log of a particle filter",
        |of| {
            (of.ticks_per_rev, of.odometry_hz, of.stamps) = (4096.0, 30.0, Stamps::Received(8e-3));
            (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad, of.truth_tau_s) = (4.0, 2e-2, 1e-2, 1.0);
            (of.latency_s, of.joined, of.clock_gain) = (0.15, true, 2e-5);
        },
        &["truth_latency", "truth_correlated_noise", "interval_error"],
    ),
    (
        "toy and camera",
        |of| {
            (of.scale, of.ticks_per_rev, of.odometry_hz, of.stamps) = (0.3, 360.0, 20.0, Stamps::RoundedTo(1e-3));
            (of.truth_hz, of.truth_sigma_m, of.truth_sigma_rad, of.latency_s) = (30.0, 1e-3, 5e-3, 0.06);
        },
        &["truth_latency"],
    ),
    ("a toy", |of| of.scale = 0.2, &[]),
    ("a vehicle", |of| of.scale = 3.0, &[]),
    (
        "a vehicle, 500 ticks, poses of 1 cm",
        |of| (of.scale, of.ticks_per_rev, of.truth_sigma_m, of.truth_sigma_rad) = (3.0, 500.0, 1e-2, 5e-3),
        &[],
    ),
    ("slow", |of| of.pace = 0.3, &[]),
    ("slow, 500 ticks", |of| (of.pace, of.ticks_per_rev) = (0.3, 500.0), &[]),
    ("fast", |of| of.pace = 3.0, &[]),
    ("brisk", |of| of.briskness = 4.0, &[]),
    ("brisk, counts at 10 Hz", |of| (of.briskness, of.odometry_hz) = (4.0, 10.0), &[]),
    ("gentle", |of| of.briskness = 0.25, &[]),
    ("no rests", |of| of.never_rests = true, &[]),
    ("straights", |of| of.only = Some("straight"), &[]),
    ("squares", |of| of.only = Some("square"), &[]),
    ("squares one way", |of| of.only = Some("square_ccw"), &[]),
    ("circles", |of| of.only = Some("circle"), &[]),
    ("circles one way", |of| of.only = Some("circle_ccw"), &[]),
    ("free", |of| of.only = Some("free"), &[]),
    ("free, one long log", |of| (of.only, of.joined) = (Some("free"), true), &[]),
    (
        "free without rests, 500 ticks at 20 Hz, poses of 1 cm",
        |of| {
            (of.only, of.joined, of.never_rests) = (Some("free"), true, true);
            (of.ticks_per_rev, of.odometry_hz) = (500.0, 20.0);
            (of.truth_sigma_m, of.truth_sigma_rad) = (1e-2, 1e-2);
        },
        &[],
    ),
    ("angles", |of| of.records = Records::Angles { step_rad: 0.0 }, &[]),
    (
        "angles of 500 ticks at 20 Hz",
        |of| {
            (of.records, of.ticks_per_rev, of.odometry_hz) = (Records::Angles { step_rad: 0.0 }, 500.0, 20.0);
        },
        &[],
    ),
    ("angles in whole milliradians", |of| of.records = Records::Angles { step_rad: 1e-3 }, &[]),
    ("angles in whole degrees", |of| of.records = Records::Angles { step_rad: PI / 180.0 }, &[]),
    ("speeds", |of| of.records = Records::Speeds { step_m_s: 0.0 }, &[]),
    (
        "speeds of 500 ticks at 20 Hz",
        |of| {
            (of.records, of.ticks_per_rev, of.odometry_hz) = (Records::Speeds { step_m_s: 0.0 }, 500.0, 20.0);
        },
        &[],
    ),
    (
        "speeds in whole mm/s at 20 Hz",
        |of| {
            (of.records, of.odometry_hz) = (Records::Speeds { step_m_s: 1e-3 }, 20.0);
        },
        &[],
    ),
    (
        "speeds in whole cm/s at 20 Hz",
        |of| {
            (of.records, of.odometry_hz) = (Records::Speeds { step_m_s: 1e-2 }, 20.0);
        },
        &[],
    ),
    (
        "speeds, jitter of 2 ms",
        |of| {
            (of.records, of.stamps) = (Records::Speeds { step_m_s: 0.0 }, Stamps::Jitter(2e-3));
        },
        &["interval_error"],
    ),
    (
        "speeds, 3 % of rows lost",
        |of| {
            (of.records, of.lost_rows) = (Records::Speeds { step_m_s: 0.0 }, 0.03);
        },
        &["dropped_samples"],
    ),
    ("twists", |of| of.records = Records::Twists { step_m_s: 0.0, step_rad_s: 0.0 }, &[]),
    (
        "twists of three decimals at 20 Hz",
        |of| {
            (of.records, of.odometry_hz) = (Records::Twists { step_m_s: 1e-3, step_rad_s: 1e-3 }, 20.0);
        },
        &[],
    ),
    (
        "twists of two decimals at 20 Hz",
        |of| {
            (of.records, of.odometry_hz) = (Records::Twists { step_m_s: 1e-2, step_rad_s: 1e-2 }, 20.0);
        },
        &[],
    ),
    (
        "speeds of the instant at 20 Hz",
        |of| {
            (of.records, of.odometry_hz, of.has_rates_of_instants) = (Records::Speeds { step_m_s: 0.0 }, 20.0, true);
        },
        &["truth_latency"],
    ),
    (
        "rippled speeds in whole mm/s at 20 Hz",
        |of| {
            (of.records, of.odometry_hz, of.ripple) = (Records::Speeds { step_m_s: 1e-3 }, 20.0, 0.03);
        },
        &[],
    ),
    (
        "rippled speeds in whole cm/s at 20 Hz",
        |of| {
            (of.records, of.odometry_hz, of.ripple) = (Records::Speeds { step_m_s: 1e-2 }, 20.0, 0.03);
        },
        &[],
    ),
    (
        "rippled twists of three decimals at 20 Hz",
        |of| {
            (of.records, of.odometry_hz, of.ripple) =
                (Records::Twists { step_m_s: 1e-3, step_rad_s: 1e-3 }, 20.0, 0.03);
        },
        &[],
    ),
    (
        "rippled twists of two decimals at 20 Hz",
        |of| {
            (of.records, of.odometry_hz, of.ripple) =
                (Records::Twists { step_m_s: 1e-2, step_rad_s: 1e-2 }, 20.0, 0.03);
        },
        &[],
    ),
    (
        "rippled speeds of 500 ticks at 20 Hz",
        |of| {
            (of.records, of.ticks_per_rev, of.odometry_hz, of.ripple) =
                (Records::Speeds { step_m_s: 0.0 }, 500.0, 20.0, 0.03);
        },
        &[],
    ),
    ("rippled, counts at 20 Hz", |of| (of.odometry_hz, of.ripple) = (20.0, 0.03), &[]),
    (
        "poses at 30 Hz stamped in whole hundredths",
        |of| {
            (of.truth_hz, of.truth_stamps) = (30.0, Stamps::RoundedTo(1e-2));
        },
        &["unlisted"],
    ),
    (
        "poses at 30 Hz stamped in whole milliseconds",
        |of| {
            (of.truth_hz, of.truth_stamps) = (30.0, Stamps::RoundedTo(1e-3));
        },
        &[],
    ),
    ("counters that begin anywhere", |of| of.first_count = -123_456.0, &[]),
    (
        "packets of three to seven rows",
        |of| (of.rows_per_packet, of.more_rows_per_packet) = (3, 4),
        &["interval_error"],
    ),
    (
        "packets of five, 3 % of rows lost",
        |of| (of.rows_per_packet, of.lost_rows) = (5, 0.03),
        &["interval_error", "dropped_samples"],
    ),
    ("a minute's rest before and after", |of| (of.stands_s, of.runs) = (60.0, 8), &[]),
    ("crawls, four runs", |of| (of.pace, of.runs) = (0.03, 4), &[]),
    ("poses in whole millimetres and milliradians", |of| of.truth_steps = [1e-3, 1e-3], &[]),
    (
        "poses in whole centimetres and degrees",
        |of| of.truth_steps = [1e-2, PI / 180.0],
        &["truth_correlated_noise", "unlisted"],
    ),
    (
        "poses in whole centimetres and hundredths, positions of 0.3 mm",
        |of| {
            (of.truth_steps, of.truth_sigma_m, of.truth_sigma_rad) = ([1e-2, 1e-2], 3e-4, 3e-4);
        },
        &["truth_correlated_noise", "unlisted"],
    ),
    ("each pose five times", |of| of.truth_repeats = 5, &["truth_latency", "truth_correlated_noise"]),
    ("poses stamped with jitter of 5 ms", |of| of.truth_stamps = Stamps::Jitter(5e-3), &["unlisted"]),
    // The longest of exponential delays are large errors.
    (
        "poses received 10 ms late",
        |of| of.truth_stamps = Stamps::Received(1e-2),
        &["truth_latency", "unlisted", "truth_outliers"],
    ),
    (
        "325 ticks, poses of 9 mm at 50 Hz, errors that last 0.25 s, four runs",
        |of| {
            (of.truth_sigma_m, of.truth_sigma_rad, of.truth_hz) = (9e-3, 12e-3, 50.0);
            (of.truth_tau_s, of.runs, of.ticks_per_rev) = (0.25, 4, 325.0);
        },
        &["truth_correlated_noise"],
    ),
    (
        "positions of 5 mm at 1 Hz",
        |of| (of.reports, of.truth_sigma_m, of.truth_hz) = (Reports::Positions, 5e-3, 1.0),
        &[],
    ),
    (
        "positions of a marker 5 cm ahead",
        |of| {
            of.reports = Reports::Positions;
            set_extrinsics(of, [0.05, 0.0, 0.0]);
        },
        &["truth_lever_arm"],
    ),
    (
        "positions of a marker 15 cm behind and 10 cm to the left",
        |of| {
            of.reports = Reports::Positions;
            set_extrinsics(of, [-0.15, 0.1, 0.0]);
        },
        &["truth_lever_arm"],
    ),
    (
        "positions of 15 mm at 5 Hz, of an antenna 30 cm ahead",
        |of| {
            (of.reports, of.truth_sigma_m, of.truth_hz) = (Reports::Positions, 1.5e-2, 5.0);
            set_extrinsics(of, [0.3, 0.0, 0.0]);
        },
        &["truth_lever_arm"],
    ),
    (
        "positions of 15 mm at 5 Hz, of an antenna 30 cm ahead, eight drives",
        |of| {
            (of.reports, of.truth_sigma_m, of.truth_hz) = (Reports::Positions, 1.5e-2, 5.0);
            (of.only, of.runs) = (Some("free"), 8);
            set_extrinsics(of, [0.3, 0.0, 0.0]);
        },
        &["truth_lever_arm"],
    ),
    ("poses 50 ms late", |of| of.latency_s = 0.05, &["truth_latency"]),
    (
        "poses 50 ms late, four squares",
        |of| (of.latency_s, of.only, of.runs) = (0.05, Some("square"), 4),
        &["truth_latency"],
    ),
    ("poses 50 ms late, one long log", |of| (of.latency_s, of.joined) = (0.05, true), &["truth_latency"]),
    ("positions 50 ms late", |of| (of.latency_s, of.reports) = (0.05, Reports::Positions), &["truth_latency"]),
    (
        "poses 100 ms late, of a marker turned by 0.19 rad",
        |of| {
            of.latency_s = 0.1;
            set_extrinsics(of, [0.0, 0.0, 0.19]);
        },
        &["truth_latency", "truth_yaw"],
    ),
    (
        "positions of a marker 15 cm behind, one long log",
        |of| {
            (of.reports, of.joined) = (Reports::Positions, true);
            set_extrinsics(of, [-0.15, 0.0, 0.0]);
        },
        &["truth_lever_arm"],
    ),
];

/// The extrinsics of the marker in every run, metres and radians.
pub fn set_extrinsics(robot: &mut PlainRobot, at: [f64; 3]) {
    robot.events = (0..21).map(|run| (run, Event::OtherMarker { at })).collect();
}
