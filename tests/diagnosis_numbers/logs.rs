//! The logs that are diagnosed.

use std::f64::consts::{PI, TAU};

use dataset::{Dataset, Displacement, TruthSample, WheelLog};
use kinematics::{Increment, Pose};
use motion_programs::Schedule;
use scenario::Scenario;

use crate::motion_capture;

/// An effect as a scenario has it.
fn effect(id: &str, sizes: &str) -> String {
    format!("[[effect]]\nkind = \"{id}\"\n{sizes}\n")
}

/// The shipped scenario with calibration errors, a few short runs and one more effect.
pub(crate) fn simulated(effect: &str, seed: u64) -> Dataset {
    let protocols = [
        Schedule::Straights { length_m: 1.0, runs: 4 },
        Schedule::Spins { turn_rad: PI, runs: 4 },
        Schedule::Squares { side_m: 0.5, runs_each_way: 1 },
    ];
    motion_capture::simulated(&motion_capture::robot(effect, &protocols), seed)
}

/// Two terms of which each would be far more than both are together.
pub(crate) const CANCELLING: (u64, u64) = (20_022, 619);

/// Logs of what the blind benchmark does not draw.
pub(crate) fn other_logs() -> Vec<(&'static str, Dataset)> {
    let sound = simulated("", 5);
    let described = |diameters: f64, separation: f64| {
        let mut dataset = sound.clone();
        dataset.robot.left_wheel_diameter_m /= diameters;
        dataset.robot.right_wheel_diameter_m /= diameters;
        dataset.robot.wheel_separation_m /= separation;
        dataset
    };
    let mut late = sound.clone();
    late.runs[5].truth.iter_mut().for_each(|sample| sample.t_s += 0.3);
    let mut lifted = sound.clone();
    lifted.runs[1].truth.iter_mut().filter(|sample| sample.t_s > 3.0).for_each(|sample| sample.y_m += 0.1);
    // Rows are stamped when they are received: some are late, and none overtakes another.
    let mut received = sound.clone();
    let mut state = 1_u64;
    for run in &mut received.runs {
        let mut before_s = f64::NEG_INFINITY;
        for t_s in run.odometry.t_s.iter_mut() {
            // A congruential generator (Knuth 1998) for exponential delays of 15 ms.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let share = ((state >> 40) as f64 + 0.5) / (1_u64 << 24) as f64;
            *t_s = (*t_s - 0.015 * share.ln()).max(before_s + 1e-4);
            before_s = *t_s;
        }
    }
    // Each run's poses are those of another one.
    let mut exchanged = sound.clone();
    let runs = exchanged.runs.len();
    for other in 1..runs {
        let (before, behind) = exchanged.runs.split_at_mut(other);
        std::mem::swap(&mut before[other - 1].truth, &mut behind[0].truth);
    }
    vec![
        ("coarse", simulated(&effect("quantization", "counts_per_tick = 80"), 5)),
        ("kicks", simulated(&effect("castor_kick", "kick_rad = 0.02\ndecay_m = 0.15"), 5)),
        ("swapped", simulated(&effect("swapped_wheels", "swapped = true"), 5)),
        ("larger wheels", described(1.18, 1.0)),
        ("skid steered", described(1.0, 1.4)),
        ("late run", late),
        ("moved run", lifted),
        ("received", received),
        ("bumps", simulated(&effect("bumps", "per_m = 0.5\nheight_m = 0.006"), 5)),
        ("exchanged runs", exchanged),
    ]
}

/// Further logs, of other instruments, clocks and faults, each of one session or several.
pub(crate) fn further_logs() -> Vec<(&'static str, Vec<Dataset>)> {
    let sound = simulated("", 5);
    let with = |id: &str, sizes: &str| simulated(&effect(id, sizes), 5);
    let slips = effect("slip_speed", "slip_s_m = 0.05");
    // The third session does not have what the others have.
    let sessions = vec![simulated(&slips, 6), simulated(&slips, 7), simulated("", 8)];
    let mut at_ends = with("truth_yaw", "yaw_rad = 0.02");
    at_ends.runs.iter_mut().for_each(|run| drop(run.truth.drain(1..run.truth.len() - 1)));
    let mut clock = with("truth_latency", "delay_s = 0.03");
    clock.runs.iter_mut().flat_map(|run| &mut run.truth).for_each(|sample| sample.t_s += 0.3);
    vec![
        ("sessions", sessions),
        ("ends", vec![at_ends]),
        ("coarse slip", vec![simulated(&(effect("quantization", "counts_per_tick = 80") + &slips), 5)]),
        ("clock", vec![clock]),
        (
            "displacements",
            vec![displacements(&with(
                "truth_correlated_noise",
                "sigma_xy_m = 0.001\nsigma_theta_rad = 0.001\ntau_s = 0.5",
            ))],
        ),
        ("carried", vec![carried(&sound)]),
        ("other mounting", vec![mounted_otherwise(&sound)]),
        ("reset", vec![with("counter_reset", "probability = 0.005\npersistent = true")]),
        ("torn", vec![with("torn_read", "probability = 0.003\njump_counts = 65536")]),
        (
            "turned",
            vec![simulated(
                &(effect("reversed_wheel", "left = true") + &effect("dropped_samples", "probability = 0.01")),
                5,
            )],
        ),
        ("other counts", vec![with("wrong_counts_per_turn", "factor = 2.0")]),
        ("twist", vec![twist(&with("slip_speed", "slip_s_m = 0.03"))]),
        ("payload", vec![with("payload_compression", "common_per_kg = 0.002\npayload_kg = [0.0, 2.0, 5.0]")]),
        ("positions", vec![positions(&with("truth_lever_arm", "lever_x_m = 0.02\nlever_y_m = 0.01"))]),
        ("map", vec![in_a_map()]),
        ("marks", vec![of_marks()]),
    ]
}

/// The poses' differences in their place.
fn displacements(dataset: &Dataset) -> Dataset {
    let pose = |sample: &TruthSample| Pose::new(sample.x_m, sample.y_m, sample.theta_rad().expect("a heading"));
    let mut dataset = dataset.clone();
    for run in &mut dataset.runs {
        let truth: Vec<TruthSample> = std::mem::take(&mut run.truth).into_iter().step_by(10).collect();
        let of_pair = |pair: &[TruthSample]| {
            let moved = pose(&pair[0]).to(pose(&pair[1]));
            let (t0_s, t1_s) = (pair[0].t_s, pair[1].t_s);
            Displacement { t0_s, t1_s, dx_m: moved.x_m, dy_m: moved.y_m, dtheta_rad: moved.theta_rad }
        };
        run.displacements = truth.windows(2).map(of_pair).collect();
    }
    dataset
}

/// The poses without their headings.
fn positions(dataset: &Dataset) -> Dataset {
    let mut dataset = dataset.clone();
    for sample in dataset.runs.iter_mut().flat_map(|run| &mut run.truth) {
        *sample = TruthSample::new(sample.t_s, sample.x_m, sample.y_m, None);
    }
    dataset
}

/// In two of the runs the robot is carried on by some centimetres, over half a second.
fn carried(dataset: &Dataset) -> Dataset {
    let mut dataset = dataset.clone();
    for (run, [x_m, y_m]) in [(0, [0.05, 0.03]), (8, [-0.04, 0.06])] {
        for sample in &mut dataset.runs[run].truth {
            let share = ((sample.t_s - 3.0) / 0.5).clamp(0.0, 1.0);
            sample.x_m += share * x_m;
            sample.y_m += share * y_m;
        }
    }
    dataset
}

/// In one of the runs the instrument's mark is elsewhere on the robot.
fn mounted_otherwise(dataset: &Dataset) -> Dataset {
    let mut dataset = dataset.clone();
    for sample in &mut dataset.runs[9].truth {
        let seen =
            Pose::new(sample.x_m, sample.y_m, sample.theta_rad().expect("a heading")) * Pose::new(0.04, 0.0, 0.1);
        *sample = TruthSample::new(sample.t_s, seen.x_m, seen.y_m, Some(seen.theta_rad));
    }
    dataset
}

/// A robot that reports its twist alone.
fn twist(dataset: &Dataset) -> Dataset {
    let mut dataset = dataset.clone();
    let geometry = dataset.robot.geometry().expect("a drive");
    let m_per_count = geometry.m_per_count(dataset.robot.ticks_per_rev.expect("ticks")).expect("ticks");
    for run in &mut dataset.runs {
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("ticks are logged") };
        let (mut v_mps, mut omega_radps) = (vec![0.0], vec![0.0]);
        for (row, t_s) in run.odometry.t_s.windows(2).enumerate() {
            let counts = ticks.as_ref().map(|of| (of[row + 1] - of[row]) as f64);
            let travel_m = counts.zip_with(m_per_count, |counts, m| counts * m);
            let Increment { distance_m, turn_rad } = geometry.increment(travel_m);
            v_mps.push(distance_m / (t_s[1] - t_s[0]));
            omega_radps.push(turn_rad / (t_s[1] - t_s[0]));
        }
        run.odometry.wheels = WheelLog::Twist { v_mps, omega_radps };
    }
    dataset
}

/// Poses in a map whose distortion is stated, of a robot that slips.
fn in_a_map() -> Dataset {
    let mut scenario = Scenario::parse(include_str!("../../scenarios/slam.toml"), "slam.toml").expect("shipped");
    let of_robot = motion_capture::robot(&effect("slip_speed", "slip_s_m = 0.1"), &[]);
    scenario.effects.extend(of_robot.effects.into_iter().filter(|effect| effect.id() == "slip_speed"));
    scenario.protocols = vec![
        Schedule::Squares { side_m: 1.0, runs_each_way: 2 },
        Schedule::Circles { radius_m: 0.6, turns: None, runs_each_way: 2 },
    ];
    scenario.sweep = None;
    motion_capture::simulated(&scenario, 5)
}

/// Marks on the robot that are read on the floor where it stands.
fn of_marks() -> Dataset {
    let mut scenario = Scenario::parse(include_str!("../../scenarios/paper.toml"), "paper.toml").expect("shipped");
    scenario.protocols = vec![
        Schedule::Straights { length_m: 2.0, runs: 6 },
        Schedule::Spins { turn_rad: TAU, runs: 6 },
        Schedule::Squares { side_m: 1.0, runs_each_way: 3 },
    ];
    scenario.sweep = None;
    motion_capture::simulated(&scenario, 5)
}
