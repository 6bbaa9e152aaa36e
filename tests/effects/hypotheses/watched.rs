//! A robot without any imperfection but the one, watched exactly, and what counts and a mean term predict of
//! it.

use dataset::{Dataset, Protocol, ProtocolSettings, Run, RunInfo, WheelLog};
use effects::Forward;
use kinematics::{Increment, Pose, Twist, Wheels};
use model_term::{Interval, Measurement, ModelTerm, NoRecord};
use motion_programs::{Motion, MotionProgram, Platform};
use scenario::{Engine, Instrument, Log, Scenario};
use sim_yair::SimulatedRobot;

/// The paper's robot without any imperfection or noise, stepped, under motion capture, logging as often as it
/// is seen.
pub(crate) fn perfect() -> Scenario {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.engine = Engine::Stepping { step_s: 1e-3 };
    scenario.effects.clear();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.robot.controller.right_phase_s = 0.0;
    scenario.instruments = vec![Instrument::MotionCapture {
        rate_hz: 50.0,
        sigma_xy_m: 0.0,
        sigma_theta_rad: 0.0,
        latency_s: 0.0,
        lever_x_m: 0.0,
        lever_y_m: 0.0,
        lever_theta_rad: 0.0,
    }];
    scenario.log = Some(Log { interval_s: 0.02 });
    scenario
}

/// Arcs of 1.5 wheelbases: the inner wheel runs at half of the outer one's speed, and both lie on the
/// controller's lattice.
const RADIUS_M: f64 = 1.5 * 0.363;

/// Everything that excites something: both directions of both wheels, turns to both sides before reversals,
/// and two yaw rates.
pub(crate) fn motions() -> Vec<Motion> {
    let straight = |length_m| Motion::Straight { length_m };
    let arc = |turn_rad| Motion::Arc { radius_m: RADIUS_M, turn_rad };
    let spin = |turn_rad| Motion::Spin { turn_rad };
    vec![straight(0.7), spin(1.5), straight(-0.4), arc(-1.2), straight(-0.5), arc(2.5), spin(-0.8), straight(0.6)]
}

pub(crate) fn drive(scenario: &Scenario, runs: u32) -> Dataset {
    drive_with(scenario, runs, Vec::new())
}

/// With further effects that are not in the catalogue.
pub(crate) fn drive_with(scenario: &Scenario, runs: u32, more: Vec<(&'static str, Box<dyn Forward>)>) -> Dataset {
    let mut robot = SimulatedRobot::with_more_effects(scenario, 9, 0, more).expect("simulates");
    let settings = ProtocolSettings::default();
    let program = MotionProgram { id: "run".to_owned(), protocol: Protocol::Free, settings, motions: motions() };
    let run = |_| {
        let mut run = Run::default();
        robot.drive_into(&program, &mut run).expect("drives");
        run
    };
    let runs = (0..runs).map(run).collect();
    Dataset {
        provenance: dataset::Provenance::default(),
        robot: robot.robot(),
        truth_noise: robot.truth_noise(),
        points: robot.points().to_vec(),
        runs,
    }
}

/// A row of the log after the first: the interval that ends there, without where the robot was.
pub(crate) struct Row {
    pub(crate) t_s: f64,
    pub(crate) dt_s: f64,
    pub(crate) turned_rad: Wheels<f64>,
    pub(crate) wheel_rad: Wheels<f64>,
}

pub(crate) fn rows(run: &Run, ticks_per_rev: f64) -> Vec<Row> {
    let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("the simulator logs ticks") };
    let angle =
        |k: usize| Wheels { left: ticks.left[k], right: ticks.right[k] }.map(|count| count as f64 / ticks_per_rev);
    let angle = |k| angle(k).map(|turns| turns * std::f64::consts::TAU);
    let t_s = &run.odometry.t_s;
    (1..t_s.len())
        .map(|k| Row {
            t_s: t_s[k - 1],
            dt_s: t_s[k] - t_s[k - 1],
            turned_rad: angle(k).zip_with(angle(k - 1), |after, before| after - before),
            wheel_rad: angle(k - 1),
        })
        .collect()
}

/// Σ size × gradient.
pub(crate) fn sum(gradient: &[Pose], values: &[f64]) -> Pose {
    gradient.iter().zip(values).fold(Pose::IDENTITY, |sum, (gradient, size)| {
        Pose::new(
            sum.x_m + size * gradient.x_m,
            sum.y_m + size * gradient.y_m,
            sum.theta_rad + size * gradient.theta_rad,
        )
    })
}

/// From where a prediction starts.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Watch {
    /// From each run's first measurement.
    FromTheStart,
    /// From 2 s on: what a run's start leaves unknown, such as where in its gap a wheel was left, is over by
    /// then.
    OnceMoving,
    /// From each measurement to the next; the root of the mean square counts. For a term that follows the
    /// log's beat: where it loses it, at standstills, what it misses once would stay in the heading.
    LookByLook,
}

/// What a term of these sizes adds to a measurement at a pose.
fn measured_by_term(
    term: &mut dyn ModelTerm,
    values: &[f64],
    run: &RunInfo,
    t_s: f64,
    world_from_body: Pose,
    twist: Twist,
) -> Pose {
    let mut gradient = vec![Pose::IDENTITY; values.len()];
    let twist_of_terms = Twist::default();
    term.measurement(
        &Measurement { t_s, world_from_body, twist, twist_of_terms, record: &NoRecord, run },
        &mut gradient,
    );
    sum(&gradient, values)
}

/// Largest difference, metres or radians, between what was seen and what the counts and a term of these sizes
/// predict.
pub(crate) fn missed(dataset: &Dataset, term: &mut dyn ModelTerm, values: &[f64], watch: Watch) -> f64 {
    let from_s = if watch == Watch::OnceMoving { 2.0 } else { 0.0 };
    let geometry = dataset.robot.geometry().expect("valid");
    let ticks_per_rev = dataset.robot.ticks_per_rev.expect("ticks");
    let (mut session_m, mut worst, mut squares, mut measurements) = (0.0, 0.0_f64, 0.0, 0.0);
    for run in &dataset.runs {
        term.restart(&run.info);
        let mut gradient = vec![Pose::IDENTITY; values.len()];
        let seen = |k: usize| {
            let sample = &run.truth[k];
            Pose::new(sample.x_m, sample.y_m, sample.theta_rad().expect("poses"))
        };
        // The first measurement is at the robot at rest.
        let body_from_seen = measured_by_term(term, values, &run.info, run.truth[0].t_s, seen(0), Twist::default());
        let mut pose = seen(0) * body_from_seen.inverse();
        let mut measurement = 1;
        let rows = rows(run, ticks_per_rev);
        let period = run.odometry.t_s.sampling_period();
        let late_s = period.map_or_else(|| vec![0.0; run.odometry.t_s.len()], |period| period.late_s.clone());
        let travel_of = |row: &Row| row.turned_rad.zip_with(geometry.m_per_rad(), |rad, m_per_rad| rad * m_per_rad);
        // Between two rows the speed is that of the rows around: of one to either side, or of four where
        // stamps are irregular; at the ends of the log, of as many as there are.
        let mean_s = rows.iter().map(|row| row.dt_s).sum::<f64>() / rows.len() as f64;
        let odd = rows.iter().filter(|row| (row.dt_s / mean_s - 1.0).abs() > 0.05).count();
        let is_even = 10 * odd < rows.len();
        let speed_between_m_s = |next: usize| {
            let half = if is_even { 1 } else { 4 }.min(next).min(rows.len() - next).max(1);
            let both = &rows[next.saturating_sub(half)..(next + half).min(rows.len())];
            let time_s: f64 = both.iter().map(|row| row.dt_s).sum();
            let travel_m = both.iter().map(travel_of).fold(Wheels::both(0.0), |a, b| a.zip_with(b, |a, b| a + b));
            travel_m.map(|travel_m| travel_m / time_s)
        };
        for (number, row) in rows.iter().enumerate() {
            let travel_m = travel_of(row);
            let speeds_m_s = [number, number + 1].map(speed_between_m_s);
            let mean_m_s = speeds_m_s[0].zip_with(speeds_m_s[1], |start, end| 0.5 * (start + end));
            let interval = Interval {
                t_s: row.t_s,
                dt_s: row.dt_s,
                late_s: [late_s[number], late_s[number + 1]],
                travel_m,
                speed_m_s: if is_even { travel_m.map(|travel_m| travel_m / row.dt_s) } else { mean_m_s },
                count_m: Wheels::both(0.0),
                speed_at_ends_m_s: speeds_m_s,
                wheel_separation_m: geometry.wheel_separation_m(),
                wheel_rad: row.wheel_rad,
                turned_rad: row.turned_rad,
                world_from_body: pose,
                session_m,
                run: &run.info,
            };
            gradient.fill(Pose::IDENTITY);
            term.motion(&interval, &mut gradient);
            let base = interval.increment();
            let term_moves = sum(&gradient, values);
            let share = |share: f64| {
                let increment = Increment {
                    distance_m: share * (base.distance_m + term_moves.x_m),
                    turn_rad: share * (base.turn_rad + term_moves.theta_rad),
                };
                increment.perturbed_arc(0.0, share * term_moves.y_m).pose()
            };
            let twist = Twist { v_m_s: base.distance_m / row.dt_s, omega_rad_s: base.turn_rad / row.dt_s };
            while measurement < run.truth.len() && run.truth[measurement].t_s <= row.t_s + row.dt_s + 1e-9 {
                let t_s = run.truth[measurement].t_s;
                let here = pose * share((t_s - row.t_s) / row.dt_s);
                let predicted = here * measured_by_term(term, values, &run.info, t_s, here, twist);
                if t_s > from_s {
                    worst = worst.max(difference(predicted, seen(measurement)));
                    (squares, measurements) =
                        (squares + difference(predicted, seen(measurement)).powi(2), measurements + 1.0);
                }
                if t_s <= from_s || watch == Watch::LookByLook {
                    pose = seen(measurement) * predicted.inverse() * pose;
                }
                measurement += 1;
            }
            pose = pose * share(1.0);
            session_m += base.distance_m.abs();
        }
    }
    if watch == Watch::LookByLook { (squares / measurements).sqrt() } else { worst }
}

pub(crate) fn difference(a: Pose, b: Pose) -> f64 {
    (a.x_m - b.x_m).abs().max((a.y_m - b.y_m).abs()).max((a.theta_rad - b.theta_rad).abs())
}
