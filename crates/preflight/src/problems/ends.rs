//! Runs that were seen at a few instants only, or as positions: what dead reckoning with the nominal robot
//! says under each fault that is no matter of size. Where none is decisively better, nothing can be told.

use kinematics::{DriveGeometry, Increment, Pose, Side, Wheels, wrap_to_pi};

use crate::problem::{Kind, Problem, Severity, probability};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::{LENGTH_UNITS, MAX_UNEXPLAINED, TICK_FACTORS};
use crate::windows::Measured;

/// What the wheels may be.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hypothesis {
    exchanged: bool,
    signs: Wheels<f64>,
    /// Of all lengths of the truth, and of the wheels alone.
    unit: f64,
    wheels: f64,
}

const SOUND: Hypothesis = Hypothesis { exchanged: false, signs: Wheels { left: 1.0, right: 1.0 }, unit: 1.0, wheels: 1.0 };

/// All hypotheses, the sound one first.
fn hypotheses() -> Vec<Hypothesis> {
    let mut all = vec![SOUND, Hypothesis { exchanged: true, ..SOUND }];
    for (left, right) in [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        all.push(Hypothesis { signs: Wheels { left, right }, ..SOUND });
    }
    let unit = LENGTH_UNITS[0];
    all.extend([unit, unit.recip()].map(|unit| Hypothesis { unit, ..SOUND }));
    all.extend(TICK_FACTORS.map(|wheels| Hypothesis { wheels, ..SOUND }));
    all
}

/// Pairs of consecutive poses.
struct Step<'a> {
    run: &'a RunLog,
    from: (f64, Pose),
    to: (f64, Pose),
    heading: bool,
}

/// Of runs that were seen at a few instants.
pub(super) fn found(check: &SessionCheck) -> Vec<Problem> {
    let mut steps = Vec::new();
    for run in &check.runs {
        let poses: Vec<(f64, Pose)> = run
            .truth
            .iter()
            .filter_map(|sample| Some((sample.t_s, Pose::new(sample.x_m, sample.y_m, sample.theta_rad()?))))
            .collect();
        let pair = |pair: &[(f64, Pose)]| Step { run, from: pair[0], to: pair[1], heading: true };
        steps.extend(poses.windows(2).map(pair));
    }
    judged(check, &steps)
}

/// Of positions alone: the first heading of each step is that of the course before it.
pub(super) fn of_positions(check: &SessionCheck) -> Vec<Problem> {
    let Some(matched) = &check.matched else { return Vec::new() };
    if matched.measured != Measured::Positions {
        return Vec::new();
    }
    let nominal = check.m_per_rad();
    let separation_m = check.robot.wheel_separation_m;
    let costs = hypotheses().into_iter().map(|hypothesis| {
        let motion = |turn: Wheels<f64>| {
            let wheels = wheels_of(hypothesis, turn).zip_with(nominal, |rad, m| rad * m);
            Increment::from_travel(wheels, separation_m)
        };
        let (mut left, mut whole) = (0.0, 0.0);
        for pair in &matched.pairs {
            let distance_m = hypothesis.unit * motion(pair.moved).distance_m.abs();
            left += (pair.window.ahead_m - distance_m).abs() / (pair.window.ahead_m + distance_m).max(1e-6);
            whole += 1.0;
            if let Some((turned, turn_rad)) = pair.turned {
                let by_wheels = motion(turned).turn_rad;
                left += (turn_rad - by_wheels).abs() / (turn_rad.abs() + by_wheels.abs()).max(0.1);
                whole += 1.0;
            }
        }
        (hypothesis, left / whole)
    });
    decided(check, costs.collect(), matched.pairs.len())
}

fn wheels_of(hypothesis: Hypothesis, turn: Wheels<f64>) -> Wheels<f64> {
    let turn = if hypothesis.exchanged { Wheels { left: turn.right, right: turn.left } } else { turn };
    turn.zip_with(hypothesis.signs, |rad, sign| hypothesis.wheels * sign * rad)
}

fn judged(check: &SessionCheck, steps: &[Step<'_>]) -> Vec<Problem> {
    let Ok(geometry) = check.robot.geometry() else { return Vec::new() };
    let costs = hypotheses().into_iter().filter_map(|hypothesis| {
        let misses: Vec<f64> = steps.iter().filter_map(|step| miss(step, hypothesis, &geometry)).collect();
        (!misses.is_empty()).then(|| (hypothesis, misses.iter().sum::<f64>() / misses.len() as f64))
    });
    decided(check, costs.collect(), steps.len())
}

/// The hypothesis that is decisively better than the sound one, as a problem.
fn decided(check: &SessionCheck, costs: Vec<(Hypothesis, f64)>, count: usize) -> Vec<Problem> {
    let Some((_, sound)) = costs.first().copied() else { return Vec::new() };
    let Some((best, cost)) = costs.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return Vec::new() };
    // A quarter of the motion is what a robot of other sizes misses by.
    let is_decisive = best != SOUND && cost < 0.5 * MAX_UNEXPLAINED && cost < 0.4 * sound;
    if !is_decisive || count < 4 {
        return Vec::new();
    }
    let sides: Vec<Side> = Side::BOTH.into_iter().filter(|side| best.signs[*side] < 0.0).collect();
    let kind = if best.exchanged {
        Kind::WheelsExchanged { label: None }
    } else if !sides.is_empty() {
        Kind::WheelBackwards { sides }
    } else if best.unit != 1.0 {
        Kind::LengthUnit { ratio: best.unit, unit: Some("millimetres"), of_truth: best.unit > 1.0 }
    } else {
        Kind::TicksPerTurn { ratio: best.wheels, stated: check.robot.ticks_per_rev, simple: true }
    };
    let probability = probability(count as f64 * (sound / cost.max(1e-3)).ln());
    vec![Problem::new(&kind, Severity::Error, None, probability)]
}

/// What a hypothesis misses of a step, from 0 to about 2: of the distance driven, and of half a turn.
fn miss(step: &Step<'_>, hypothesis: Hypothesis, geometry: &DriveGeometry) -> Option<f64> {
    let run = step.run;
    let rows = || run.t_s.iter().copied().filter(|t_s| *t_s > step.from.0 && *t_s < step.to.0);
    let mut before = run.angles_at(step.from.0)?;
    let mut pose = Pose::IDENTITY;
    let (mut driven_m, mut turned_rad) = (0.0, 0.0);
    for t_s in rows().chain([step.to.0]) {
        let now = run.angles_at(t_s)?;
        let turn = wheels_of(hypothesis, now.zip_with(before, |now, before| now - before));
        before = now;
        let travel_m = turn.zip_with(geometry.m_per_rad(), |rad, m| hypothesis.unit * rad * m);
        let increment = Increment::from_travel(travel_m, hypothesis.unit * geometry.wheel_separation_m());
        pose = pose * increment.arc();
        driven_m += 0.5 * (travel_m.left.abs() + travel_m.right.abs());
        turned_rad += increment.turn_rad;
    }
    let (sin, cos) = step.from.1.theta_rad.sin_cos();
    let (dx_m, dy_m) = (step.to.1.x_m - step.from.1.x_m, step.to.1.y_m - step.from.1.y_m);
    let (ahead_m, aside_m) = (cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m);
    let went_m = ahead_m.hypot(aside_m);
    if driven_m.max(went_m) < 0.05 * geometry.wheel_separation_m() {
        return None;
    }
    let far = (ahead_m - pose.x_m).hypot(aside_m - pose.y_m) / driven_m.max(went_m);
    let turn = if step.heading {
        wrap_to_pi(step.to.1.theta_rad - step.from.1.theta_rad - turned_rad).abs() / std::f64::consts::PI
    } else {
        0.0
    };
    Some(far + turn)
}
