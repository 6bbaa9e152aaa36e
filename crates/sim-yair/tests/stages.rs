//! Every stage from command to instrument can be touched by an effect, in both engines.

use std::f64::consts::PI;

use dataset::{Protocol, ProtocolSettings, Run, WheelLog};
use effects::{Command, Forward, PoseReading, Readout, RunStart, SampleClock, Step};
use kinematics::Pose;
use motion_programs::{Motion, MotionProgram, Platform};
use scenario::{Engine, Instrument, Log, Scenario};
use sim_yair::SimulatedRobot;

const ENGINES: [Engine; 2] = [Engine::ClosedForm, Engine::Stepping { step_s: 1e-3 }];
const LENGTH_M: f64 = 0.5;

fn scenario(engine: Engine) -> Scenario {
    let mut scenario = Scenario::parse(scenario::PAPER, "paper.toml").expect("the shipped scenario");
    scenario.engine = engine;
    scenario.effects.clear();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.robot.controller.right_phase_s = 0.0;
    scenario.placement = scenario::Placement { half_width_m: 0.0, half_width_rad: 0.0 };
    scenario.log = Some(Log { interval_s: 0.1 });
    scenario.instruments = vec![Instrument::MotionCapture {
        rate_hz: 50.0,
        sigma_xy_m: 0.0,
        sigma_theta_rad: 0.0,
        latency_s: 0.0,
        lever_x_m: 0.0,
        lever_y_m: 0.0,
        lever_theta_rad: 0.0,
    }];
    scenario
}

fn drive(scenario: &Scenario, effect: Option<Box<dyn Forward>>) -> (Run, Pose) {
    let more = effect.into_iter().map(|effect| ("probe", effect)).collect();
    let mut robot = SimulatedRobot::with_more_effects(scenario, 3, 0, more).expect("simulates");
    let motions = vec![Motion::Straight { length_m: LENGTH_M }, Motion::Pause { duration_s: 0.2 }];
    let settings = ProtocolSettings::default();
    let mut run = Run::default();
    robot
        .drive_into(&MotionProgram { id: "run".to_owned(), protocol: Protocol::Free, settings, motions }, &mut run)
        .expect("drives");
    let (start, end) = robot.last_true_ends();
    (run, start.to(end))
}

/// Nominal travel of the left wheel by its counts, metres.
fn counted_m(run: &Run) -> f64 {
    let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("ticks") };
    let counts = ticks.left.last().expect("rows") - ticks.left[0];
    let turns = counts as f64 / (4.0 * 200.0 * 50.265_482_457_436_69);
    turns * PI * 0.160
}

/// Friction leaves the wheel within two counts of its target, 25 µm.
const SETTLED_M: f64 = 3e-5;

macro_rules! probe {
    ($name:ident, $hook:ident, $Step:ty, |$step:ident| $body:block) => {
        struct $name;
        impl Forward for $name {
            fn $hook(&mut self, $step: &mut $Step) $body
        }
    };
}

probe!(HalfCommand, command, Command, |command| {
    command.travel_counts = command.travel_counts.map(|counts| (counts / 2.0).round());
});
probe!(LazyMotor, motor, Step, |step| {
    step.shaft_rad = step.shaft_rad.map(|rad| 0.5 * rad);
});
probe!(SmallWheel, wheel, Step, |step| {
    step.radius_m = step.radius_m.map(|radius_m| 0.5 * radius_m);
});
probe!(Treadmill, floor, Step, |step| {
    step.creep_m[1] += 0.01 * step.dt_s;
    step.lateral_m += 0.02 * step.dt_s;
    step.extra_turn_rad += 0.0;
});
probe!(BlindEncoder, encoder, Step, |step| {
    step.encoder_rad.left *= 0.5;
});
probe!(TornRead, readout, Readout, |readout| {
    readout.ticks.left += 256;
});
probe!(LateClock, clock, SampleClock, |sample| {
    sample.stamp_s += 0.003;
});
probe!(TurnedCamera, instrument, PoseReading, |reading| {
    reading.world_from_body = Pose::new(0.0, 1.0, 0.0) * reading.world_from_body;
});

#[test]
fn without_a_probe_the_robot_goes_where_it_is_told() {
    for engine in ENGINES {
        let (run, moved) = drive(&scenario(engine), None);
        assert!((counted_m(&run) - LENGTH_M).abs() < SETTLED_M, "{engine:?}");
        assert!((moved.x_m - LENGTH_M).abs() < SETTLED_M && moved.y_m.abs() < SETTLED_M, "{engine:?} {moved:?}");
    }
}

#[test]
fn command_motor_wheel_and_floor_move_the_robot() {
    for engine in ENGINES {
        let (run, moved) = drive(&scenario(engine), Some(Box::new(HalfCommand)));
        assert!((counted_m(&run) - 0.5 * LENGTH_M).abs() < SETTLED_M && (moved.x_m - 0.5 * LENGTH_M).abs() < SETTLED_M);
        // A motor that turns half as far: the controller drives counts to the target, the closed form does
        // not look again.
        let (run, moved) = drive(&scenario(engine), Some(Box::new(LazyMotor)));
        assert!((counted_m(&run) - moved.x_m).abs() < SETTLED_M, "{engine:?}: encoder and wheel turn together");
        let (run, moved) = drive(&scenario(engine), Some(Box::new(SmallWheel)));
        assert!((counted_m(&run) - LENGTH_M).abs() < SETTLED_M && (moved.x_m - 0.5 * LENGTH_M).abs() < SETTLED_M);
        let (run, moved) = drive(&scenario(engine), Some(Box::new(Treadmill)));
        let duration_s = run.odometry.t_s.last().expect("rows");
        assert!((moved.y_m - 0.03 * duration_s).abs() < 1e-3 * duration_s, "{engine:?} {moved:?}");
    }
}

#[test]
fn encoder_readout_clock_and_instrument_change_the_record() {
    for engine in ENGINES {
        // The left counter sees half, so its wheel goes twice as far to the same count.
        let (run, moved) = drive(&scenario(engine), Some(Box::new(BlindEncoder)));
        assert!((counted_m(&run) - LENGTH_M).abs() < SETTLED_M, "{engine:?}");
        assert!((moved.theta_rad + LENGTH_M / 0.363).abs() < 1e-3, "{engine:?} {moved:?}");

        let (plain, _) = drive(&scenario(engine), None);
        let (torn, _) = drive(&scenario(engine), Some(Box::new(TornRead)));
        let first = |run: &Run| if let WheelLog::Ticks(ticks) = &run.odometry.wheels { ticks.left[0] } else { 0 };
        assert_eq!(first(&torn), first(&plain) + 256, "{engine:?}");

        let (late, _) = drive(&scenario(engine), Some(Box::new(LateClock)));
        assert!((late.odometry.t_s[1] - plain.odometry.t_s[1] - 0.003).abs() < 1e-12, "{engine:?}");

        let (turned, _) = drive(&scenario(engine), Some(Box::new(TurnedCamera)));
        assert!((turned.truth[0].y_m - plain.truth[0].y_m - 1.0).abs() < 1e-12, "{engine:?}");
    }
}

#[test]
fn a_skewed_clock_reads_the_right_counter_later() {
    use effects::{Effect, SamplingSkew};
    for engine in ENGINES {
        let mut skewed = scenario(engine);
        skewed.effects = vec![Effect::SamplingSkew(SamplingSkew { right_delay_s: 0.01 })];
        let lead_counts = |scenario: &Scenario| {
            let (run, _) = drive(scenario, None);
            let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("ticks") };
            // In the cruise, a second after the start.
            let row = 10;
            (ticks.right[row] - ticks.right[0]) - (ticks.left[row] - ticks.left[0])
        };
        // 10 ms at 20 000 counts/s; two floors.
        assert!((lead_counts(&skewed) - lead_counts(&scenario(engine)) - 200).abs() <= 2, "{engine:?}");
    }
}

/// A floor that turns at 0.5 rad/s under a robot whose rows are read, and truly stamped, at odd times.
struct OddRowsOnATurntable;

impl Forward for OddRowsOnATurntable {
    fn floor(&mut self, step: &mut Step) {
        step.extra_turn_rad += 0.5 * step.dt_s;
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        let off_s = 0.02 * (7.0 * sample.stamp_s).sin();
        sample.stamp_s += off_s;
        sample.read_s = sample.read_s.map(|read_s| read_s + off_s);
    }
}

#[test]
fn a_gyroscope_has_the_mean_rate_from_row_to_row_however_long_rows_are() {
    for engine in ENGINES {
        let mut scenario = scenario(engine);
        scenario.instruments = vec![Instrument::Gyro {
            noise_rad_per_sqrt_s: 0.0,
            bias_radps: 0.0,
            bias_walk_radps_per_sqrt_s: 0.0,
            scale: 0.0,
            scale_sigma: 0.0,
            still_s: 0.0,
        }];
        let (run, _) = drive(&scenario, Some(Box::new(OddRowsOnATurntable)));
        let rates = run.gyro_rates().expect("a gyroscope");
        let lengths_s: Vec<f64> = run.odometry.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(lengths_s.iter().any(|s| *s < 0.09) && lengths_s.iter().any(|s| *s > 0.11), "{lengths_s:?}");
        // The servo straightens out what a count is between the wheels: 0.1 mrad of an interval's 50.
        let worst = rates[2..].iter().map(|rate| (rate - 0.5).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-3, "{engine:?}: {worst}");
    }
}

#[test]
fn motion_capture_looks_at_its_rate_stamps_late_and_rides_its_lever() {
    for engine in ENGINES {
        let mut scenario = scenario(engine);
        scenario.instruments = vec![Instrument::MotionCapture {
            rate_hz: 20.0,
            sigma_xy_m: 0.0,
            sigma_theta_rad: 0.0,
            latency_s: 0.03,
            lever_x_m: 0.1,
            lever_y_m: -0.2,
            lever_theta_rad: 0.5,
        }];
        let (run, moved) = drive(&scenario, None);
        assert!((run.truth[0].t_s - 0.03).abs() < 1e-12 && (run.truth[1].t_s - 0.08).abs() < 1e-12, "{engine:?}");
        assert!((run.truth[0].x_m - 0.1).abs() < 1e-12 && (run.truth[0].y_m + 0.2).abs() < 1e-12);
        let last = run.truth.last().expect("samples");
        let turn_rad = last.theta_rad().expect("headings") - 0.5;
        // The robot stands through the pause at the end; the lever turns by what a count more or less on one
        // wheel turns it.
        assert!(
            (last.x_m - 0.1 - moved.x_m).abs() < SETTLED_M && turn_rad.abs() < 2.0 * SETTLED_M / 0.363,
            "{engine:?}"
        );
    }
}

/// It writes into the record what it is told of the session.
struct Diary;

impl Forward for Diary {
    fn on_run_start(&mut self, run: &mut RunStart<'_>) {
        let said = [("number", f64::from(run.number)), ("session_s", run.session_s), ("session_m", run.session_m)];
        run.info.covariates = said.map(|(name, value)| (name.to_owned(), value)).into();
    }
}

#[test]
fn a_run_knows_its_place_in_the_session_and_a_new_trial_is_a_new_session() {
    let mut robot = SimulatedRobot::with_more_effects(&scenario(ENGINES[0]), 3, 0, vec![("diary", Box::new(Diary))])
        .expect("simulates");
    let settings = ProtocolSettings::default();
    let motions = vec![Motion::Straight { length_m: -LENGTH_M }, Motion::Pause { duration_s: 1.0 }];
    let program = MotionProgram { id: "run".to_owned(), protocol: Protocol::Free, settings, motions };
    let mut run = Run::default();
    let run_s = LENGTH_M / 0.25 + 1.0;
    for (trial, number) in [(0, 0.0), (0, 1.0), (0, 2.0), (1, 0.0), (1, 1.0)] {
        if number == 0.0 {
            robot.restart(trial);
        }
        robot.drive_into(&program, &mut run).expect("drives");
        let of = |name: &str| run.info.covariates[name];
        // Whole counts of 12.5 µm a run.
        assert_eq!((of("number"), run.info.start_s), (number, Some(of("session_s"))));
        assert!((of("session_s") - number * run_s).abs() < 1e-3 && (of("session_m") - number * LENGTH_M).abs() < 1e-4);
    }
}
