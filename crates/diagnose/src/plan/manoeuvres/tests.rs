//! Manoeuvres, and runs along them, on paper.

use super::*;

pub(in crate::plan) fn setting() -> Setting {
    Setting {
        robot: crate::small_robot::robot(0.36),
        top_speed_m_s: 0.25,
        acceleration_m_s2: 0.5,
        between_rows_s: 0.05,
        reading: Reading::Even(0.1),
        sees_heading: true,
        relative: false,
        twist: false,
        free_m: [2.0, 1.2],
        minutes: 10.0,
        handling_s: 20.0,
        within: String::new(),
    }
}

fn model(setting: &Setting) -> Model {
    Model::of(&setting.robot.geometry().expect("a drive"), 0)
}

#[test]
fn manoeuvres_fit_the_floor_and_no_time_is_no_manoeuvre() {
    let all = library(&setting());
    assert!(all.len() > 20);
    for manoeuvre in &all {
        let fits = match manoeuvre.schedule {
            Schedule::Straights { length_m, .. } => length_m <= 2.0,
            Schedule::Squares { side_m, .. } => side_m <= 1.2,
            Schedule::Circles { radius_m, .. } => radius_m <= 0.6 && radius_m > 0.18,
            _ => true,
        };
        assert!(fits, "{manoeuvre:?}");
    }
    assert!(library(&Setting { minutes: 0.5, ..setting() }).is_empty());
}

/// A log ends where the program ends and takes as long as the pace says, standing at both ends; its
/// steps are no faster than the top speed.
#[test]
fn a_planned_run_drives_its_program() {
    let setting = setting();
    for manoeuvre in library(&setting) {
        for program in manoeuvre.schedule.with_pairs(1).programs() {
            let run = planned_run(
                &program,
                &setting,
                manoeuvre.speed_m_s,
                &model(&setting),
                phase_rad(1),
                Measurements::AsSoFar,
            )
            .expect("a run");
            let end = run.truth.last().expect("measurements");
            let turned = match program.settings {
                dataset::ProtocolSettings { length_m: Some(length_m), .. } => {
                    assert!((end.x_m - length_m).abs() < 1e-9, "{program:?}: {end:?}");
                    0.0
                }
                dataset::ProtocolSettings { turn_rad: Some(turn_rad), .. } => turn_rad,
                // Squares and circles close.
                _ => TAU.copysign(end.theta_rad().expect("a heading")),
            };
            // Sums of some hundred arcs: roundings of 1e-16 each.
            assert!((end.theta_rad().expect("a heading") - turned).abs() < 1e-9, "{program:?}: {end:?}");
            let driving_s =
                60.0 * setting.drive_limits(manoeuvre.speed_m_s).cost(&program).minutes - setting.handling_s;
            let over_s = run.odometry.t_s.last().expect("rows") - driving_s - 2.0 * PLAN.standstill_s;
            assert!((-1e-9..=setting.between_rows_s + 1e-9).contains(&over_s), "{program:?}: {over_s} s more");
            let WheelLog::Angles(angles) = &run.odometry.wheels else { panic!("angles are logged") };
            for side in [&angles.left, &angles.right] {
                let fastest = side.windows(2).map(|pair| 0.08 * (pair[1] - pair[0]).abs() / 0.05).fold(0.0, f64::max);
                assert!(fastest < manoeuvre.speed_m_s * (1.0 + 1e-9), "{fastest}");
            }
        }
    }
}

#[test]
fn standing_readings_are_where_the_program_says() {
    let setting = Setting { between_rows_s: f64::INFINITY, reading: Reading::Standing, ..setting() };
    let circle = &Schedule::Circles { radius_m: 0.5, turns: None, runs_each_way: 1 }.programs()[1];
    let run =
        planned_run(circle, &setting, 0.25, &model(&setting), phase_rad(0), Measurements::AsSoFar).expect("a run");
    let measured_poses: Vec<(f64, f64)> = run.truth.iter().map(|sample| (sample.x_m, sample.y_m)).collect();
    assert_eq!(measured_poses.len(), 3);
    // Counter-clockwise from the origin along x: half a turn later the robot is a diameter to the left.
    assert!(measured_poses[1].0.abs() < 1e-9 && (measured_poses[1].1 - 1.0).abs() < 1e-9, "{measured_poses:?}");
    // An instrument that saw no more than starts and ends so far sees no more of this run.
    let setting = Setting { reading: Reading::AtEnds, ..setting };
    let run =
        planned_run(circle, &setting, 0.25, &model(&setting), phase_rad(0), Measurements::AsSoFar).expect("a run");
    assert_eq!(run.truth.len(), 2);
}

#[test]
fn lengths_are_marked_to_a_centimetre_and_speeds_have_three_digits() {
    assert_eq!((rounded(1.239), rounded(0.999), rounded(2.0)), (1.23, 0.99, 2.0));
    assert_eq!((significant(0.062_512), significant(0.125_6), significant(1234.0)), (0.0625, 0.126, 1230.0));
}

#[test]
fn manoeuvres_are_of_the_longer_or_the_shorter_side() {
    let setting = Setting { free_m: [1.2, 3.0], ..setting() };
    let all = library(&setting);
    let of = |schedule: Schedule| all.iter().filter(|of| of.schedule == schedule).count();
    // Three speeds each. Straights along the longer side, squares and circles within the shorter.
    for length_m in [3.0, 1.5] {
        assert_eq!(of(Schedule::Straights { length_m, runs: 2 }), 3, "{length_m}");
    }
    assert_eq!(of(Schedule::Squares { side_m: 1.2, runs_each_way: 1 }), 3);
    assert_eq!(of(Schedule::Squares { side_m: 0.6, runs_each_way: 1 }), 3);
    // A circle as wide as half of the shorter side, and none within the wheels' own, 0.18 m.
    assert_eq!(of(Schedule::Circles { radius_m: 0.6, turns: None, runs_each_way: 1 }), 3);
    assert_eq!(of(Schedule::Circles { radius_m: 0.3, turns: None, runs_each_way: 1 }), 3);
    let narrow = library(&Setting { free_m: [0.3, 0.36], ..setting.clone() });
    let is_circle = |of: &Manoeuvre| matches!(of.schedule, Schedule::Circles { .. });
    let is_square = |of: &Manoeuvre| matches!(of.schedule, Schedule::Squares { .. });
    assert!(!narrow.iter().any(is_circle));
    // A square of 0.3 m, and none of 0.15 m; no straight of 0.18 m either.
    assert_eq!(narrow.iter().filter(|of| is_square(of)).count(), 3);
    assert_eq!(narrow.iter().filter(|of| matches!(of.schedule, Schedule::Straights { .. })).count(), 3);
    let speeds: Vec<f64> = all.iter().map(|of| of.speed_m_s).collect();
    assert!([0.25, 0.125, 0.0625].iter().all(|speed| speeds.contains(speed)), "{speeds:?}");
    // A pair of runs costs both.
    let straight = Manoeuvre { schedule: Schedule::Straights { length_m: 1.0, runs: 2 }, speed_m_s: 0.25 };
    let minutes = straight.cost(&setting).minutes;
    // 1/0.25 + 0.25/0.5 seconds of driving and 20 of handling, twice.
    assert!((minutes - 2.0 * 24.5 / 60.0).abs() < 1e-9, "{minutes}");
}

#[test]
fn a_trapezoid_of_speed_is_that_on_paper() {
    // 0.5 m at 0.25 m/s and 0.5 m/s²: ramps of half a second and 1/16 m, 2.5 s in all.
    let of = Trapezoid::new(0.5, 0.25, 0.5);
    assert!((of.duration_s - 2.5).abs() < 1e-12 && of.top_m_s == 0.25);
    for (t_s, m) in
        [(0.0, 0.0), (0.25, 0.015_625), (0.5, 0.0625), (1.25, 0.25), (2.0, 0.4375), (2.25, 0.484_375), (2.5, 0.5)]
    {
        assert!((of.share(t_s) - m / 0.5).abs() < 1e-12, "{t_s}: {}", of.share(t_s));
    }
    assert_eq!(of.share(9.0), 1.0);
    // A way of 0.08 m is too short for the speed: it goes up to √(0.08 · 0.5) = 0.2 m/s and down again.
    let short = Trapezoid::new(0.08, 0.25, 0.5);
    assert!((short.top_m_s - 0.2).abs() < 1e-12 && (short.duration_s - 0.8).abs() < 1e-12);
    assert!((short.share(0.4) - 0.5).abs() < 1e-12);
}

/// A run of a program under some setting, with the numbers of its rows.
fn run_of(setting: &Setting, schedule: Schedule, measurements: Measurements<'_>) -> Run {
    let program = &schedule.programs()[0];
    planned_run(program, setting, 0.25, &model(setting), Wheels::both(0.0), measurements).expect("a run")
}

#[test]
fn an_instrument_measures_at_its_intervals_and_at_the_end() {
    // 0.5 m takes 2.5 s, and half a second before and after it; rows every 0.4 s end at 3.6 s.
    let straight = Schedule::Straights { length_m: 0.5, runs: 2 };
    let setting = Setting { between_rows_s: 0.4, reading: Reading::Even(1.0), ..setting() };
    let run = run_of(&setting, straight, Measurements::AsSoFar);
    let rows: Vec<f64> = run.odometry.t_s.to_vec();
    assert!(rows.len() == 10 && (rows[9] - 3.6).abs() < 1e-9, "{rows:?}");
    let times: Vec<f64> = run.truth.iter().map(|sample| sample.t_s).collect();
    // Not at 3.0 and 3.6 s were the interval 1.2 s: half of one before the end at the least.
    assert_eq!(times.len(), 5);
    assert!((times[3] - 3.0).abs() < 1e-9 && (times[4] - 3.6).abs() < 1e-9, "{times:?}");
    let sparse = Setting { reading: Reading::Even(1.3), ..setting.clone() };
    let times = run_of(&sparse, straight, Measurements::AsSoFar).truth.iter().map(|of| of.t_s).collect::<Vec<_>>();
    assert!(times.len() == 4 && (times[2] - 2.6).abs() < 1e-9, "{times:?}");
    // Where it is looked at, at the nearest row: poses between rows so long are known too badly to be used.
    let at = run_of(&setting, straight, Measurements::At(&[0.46, 1.0]));
    let times: Vec<f64> = at.truth.iter().map(|of| of.t_s).collect();
    assert!((times[1] - 1.6).abs() < 1e-9 && (times[2] - 3.6).abs() < 1e-9, "{times:?}");
    // Half of the distance after half a second and half of what it takes.
    let half =
        &run_of(&Setting { between_rows_s: 0.01, ..setting }, straight, Measurements::At(&[1.75 / 3.51])).truth[1];
    assert!((half.x_m - 0.25).abs() < 2e-3, "{half:?}");
}

#[test]
fn an_instrument_without_headings_or_of_displacements_stays_one() {
    let straight = Schedule::Straights { length_m: 0.5, runs: 2 };
    let blind = Setting { sees_heading: false, ..setting() };
    assert!(run_of(&blind, straight, Measurements::AsSoFar).truth.iter().all(|of| of.theta_rad().is_none()));
    // Predictions are of the pose.
    assert!(run_of(&blind, straight, Measurements::At(&[1.0])).truth.iter().all(|of| of.theta_rad().is_some()));
    let relative = Setting { relative: true, reading: Reading::Even(0.5), ..setting() };
    let run = run_of(&relative, straight, Measurements::AsSoFar);
    assert!(run.truth.is_empty() && run.displacements.len() > 5);
    let all: f64 = run.displacements.iter().map(|of| of.dx_m).sum();
    assert!((all - 0.5).abs() < 1e-9 && run.displacements.iter().all(|of| of.dy_m.abs() < 1e-12));
    assert!(run.displacements.windows(2).all(|pair| pair[0].t1_s == pair[1].t0_s));
    assert!(!run_of(&relative, straight, Measurements::At(&[1.0])).truth.is_empty());
}

#[test]
fn a_robot_of_twists_reports_speed_and_turn_rate() {
    let twists = Setting { twist: true, ..setting() };
    let of = |schedule| match run_of(&twists, schedule, Measurements::AsSoFar).odometry.wheels {
        WheelLog::Twist { v_mps, omega_radps } => (v_mps, omega_radps),
        other => panic!("a twist, not {other:?}"),
    };
    // At cruising speed, in rows of 0.05 s. Rejects distances for speeds.
    let (v_mps, omega_radps) = of(Schedule::Straights { length_m: 0.5, runs: 2 });
    let fastest = v_mps.iter().copied().fold(0.0, f64::max);
    assert!((fastest - 0.25).abs() < 1e-9 && omega_radps.iter().all(|of| of.abs() < 1e-12), "{fastest}");
    // Both wheels at 0.25 m/s, 0.36 m from each other.
    let (v_mps, omega_radps) = of(Schedule::Spins { turn_rad: TAU, runs: 2 });
    let fastest = omega_radps.iter().copied().fold(0.0, f64::max);
    assert!((fastest - 0.5 / 0.36).abs() < 1e-9 && v_mps.iter().all(|of| of.abs() < 1e-12), "{fastest}");
}

#[test]
fn an_instrument_that_is_late_sees_where_the_robot_was_and_from_where_it_is_mounted() {
    let setting = Setting { reading: Reading::Even(0.5), ..setting() };
    let mut late = model(&setting);
    late.latency_s = 0.2;
    late.body_from_sensor = Pose::new(0.1, 0.0, 0.0);
    let program = &Schedule::Straights { length_m: 1.0, runs: 2 }.programs()[0];
    let run = planned_run(program, &setting, 0.25, &late, phase_rad(0), Measurements::AsSoFar).expect("a run");
    let first = &run.truth[0];
    assert!((first.x_m - 0.1).abs() < 1e-12, "{first:?}");
    // At 2.0 s it is where it was at 1.8 s: 1.3 s of driving, of which the first half second makes 1/16 m.
    let at = run.truth.iter().find(|of| (of.t_s - 2.0).abs() < 1e-9).expect("a pose");
    assert!((at.x_m - 0.1 - (0.0625 + 0.25 * 0.8)).abs() < 1e-9, "{at:?}");
}

#[test]
fn standing_robots_write_rows_between_motions_and_wheels_start_anywhere() {
    let standing = Setting { between_rows_s: f64::INFINITY, reading: Reading::AtEnds, ..setting() };
    let run = run_of(&standing, Schedule::Squares { side_m: 0.5, runs_each_way: 1 }, Measurements::AsSoFar);
    let rows = run.odometry.t_s.to_vec();
    // Four sides and four corners, and the end. Nothing stands before the first.
    assert_eq!((rows.len(), rows[0], run.truth.len()), (9, 0.0, 2), "{rows:?}");
    assert!((rows[1] - 2.5).abs() < 1e-9 && run.truth[1].t_s == rows[8]);
    // Multiples of 0.618 and 0.414 of a turn.
    let phases = [0, 1, 2].map(phase_rad);
    assert_eq!((phases[0].left, phases[0].right), (0.0, 0.0));
    assert!((phases[1].left - TAU * 0.618_034).abs() < 1e-9 && (phases[1].right - TAU * 0.414_214).abs() < 1e-9);
    assert!((phases[2].left - TAU * 0.236_068).abs() < 1e-9 && (phases[2].right - TAU * 0.828_428).abs() < 1e-9);
}
