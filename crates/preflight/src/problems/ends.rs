//! Runs that were seen at a few instants only, or as positions: what dead reckoning with the nominal robot
//! says under each fault that is no matter of size. Where none is decisively better, nothing can be told.

use kinematics::{DriveGeometry, Increment, Pose, Side, Wheels, wrap_to_pi};

use crate::kind::Kind;
use crate::problem::{Problem, Severity, probability};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

/// What the wheels may be.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hypothesis {
    exchanged: bool,
    signs: Wheels<f64>,
    /// Of all lengths of the truth, and of the wheels alone.
    unit: f64,
    wheels: f64,
}

const SOUND: Hypothesis =
    Hypothesis { exchanged: false, signs: Wheels { left: 1.0, right: 1.0 }, unit: 1.0, wheels: 1.0 };

/// All hypotheses, the sound one first.
fn hypotheses() -> Vec<Hypothesis> {
    let mut all = vec![SOUND, Hypothesis { exchanged: true, ..SOUND }];
    for (left, right) in [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        all.push(Hypothesis { signs: Wheels { left, right }, ..SOUND });
    }
    let unit = CHECKS.length_units[0];
    all.extend([unit, unit.recip()].map(|unit| Hypothesis { unit, ..SOUND }));
    all.extend(CHECKS.tick_factors.map(|wheels| Hypothesis { wheels, ..SOUND }));
    all
}

/// A place by dead reckoning and the one that was measured, metres.
type Placed = ((f64, f64), (f64, f64));

/// Pairs of consecutive poses.
struct Step<'a> {
    run: &'a RunLog,
    from: (f64, Pose),
    to: (f64, Pose),
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
        let pair = |pair: &[(f64, Pose)]| Step { run, from: pair[0], to: pair[1] };
        steps.extend(poses.windows(2).map(pair));
    }
    judged(check, &steps)
}

/// Of positions alone: paths of dead reckoning, laid over what was measured.
pub(super) fn of_positions(check: &SessionCheck) -> Vec<Problem> {
    let Ok(geometry) = check.robot.geometry() else { return Vec::new() };
    let shift_s = check.matched.as_ref().map_or(0.0, |matched| matched.clock.offset_s);
    let costs = hypotheses().into_iter().filter_map(|hypothesis| {
        let (mut left, mut count) = (0.0, 0.0);
        for run in &check.runs {
            let Some(miss) = path_miss(run, hypothesis, &geometry, shift_s) else { continue };
            left += miss;
            count += 1.0;
        }
        (count > 0.0).then_some((hypothesis, left / count))
    });
    decided(check, costs.collect(), check.runs.len())
}

/// Root mean square of what is left between a run's positions and its dead-reckoned path, laid over them by
/// the best rotation and shift, over the larger extent of the two.
fn path_miss(run: &RunLog, hypothesis: Hypothesis, geometry: &DriveGeometry, shift_s: f64) -> Option<f64> {
    let mut at = (run.angles_at(run.truth.first()?.t_s - shift_s)?, Pose::IDENTITY);
    let mut pairs: Vec<Placed> = Vec::with_capacity(run.truth.len());
    let mut from_s = run.truth.first()?.t_s - shift_s;
    for sample in &run.truth {
        let to_s = sample.t_s - shift_s;
        at = (run.angles_at(to_s)?, at.1 * driven(run, hypothesis, geometry, from_s, to_s)?.0);
        from_s = to_s;
        pairs.push(((at.1.x_m, at.1.y_m), (sample.x_m, sample.y_m)));
    }
    let count = pairs.len() as f64;
    let mean = |of: fn(&Placed) -> (f64, f64)| {
        let sum = pairs.iter().map(of).fold((0.0, 0.0), |sum, at| (sum.0 + at.0, sum.1 + at.1));
        (sum.0 / count, sum.1 / count)
    };
    let (path, seen) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let (mut dot, mut cross, mut of_path, mut of_seen) = (0.0, 0.0, 0.0, 0.0);
    for (a, b) in &pairs {
        let (a, b) = ((a.0 - path.0, a.1 - path.1), (b.0 - seen.0, b.1 - seen.1));
        dot += a.0 * b.0 + a.1 * b.1;
        cross += a.0 * b.1 - a.1 * b.0;
        of_path += a.0 * a.0 + a.1 * a.1;
        of_seen += b.0 * b.0 + b.1 * b.1;
    }
    // A robot that stays where it is shows no path.
    let is_path = (of_path.max(of_seen) / count).sqrt() > 0.3 * hypothesis.unit * geometry.wheel_separation_m();
    let left = (of_path + of_seen - 2.0 * dot.hypot(cross)).max(0.0);
    is_path.then(|| (left / of_path.max(of_seen)).sqrt())
}

fn wheels_of(hypothesis: Hypothesis, turn: Wheels<f64>) -> Wheels<f64> {
    let turn = if hypothesis.exchanged { Wheels { left: turn.right, right: turn.left } } else { turn };
    turn.zip_with(hypothesis.signs, |rad, sign| hypothesis.wheels * sign * rad)
}

fn judged(check: &SessionCheck, steps: &[Step<'_>]) -> Vec<Problem> {
    let Ok(geometry) = check.robot.geometry() else { return Vec::new() };
    let costs = hypotheses().into_iter().filter_map(|hypothesis| {
        // Of a spin, larger wheels and a smaller separation are one.
        let is_of_size = hypothesis.wheels != 1.0;
        let tells = |step: &&Step<'_>| !is_of_size || goes_somewhere(step, &geometry);
        let misses: Vec<f64> =
            steps.iter().filter(tells).filter_map(|step| miss(step, hypothesis, &geometry)).collect();
        let are_enough = 2 * misses.len() > steps.len();
        are_enough.then(|| (hypothesis, misses.iter().sum::<f64>() / misses.len() as f64))
    });
    decided(check, costs.collect(), steps.len())
}

/// The hypothesis that is decisively better than the sound one, as a problem.
fn decided(check: &SessionCheck, costs: Vec<(Hypothesis, f64)>, count: usize) -> Vec<Problem> {
    let Some((_, sound)) = costs.first().copied() else { return Vec::new() };
    let Some((best, cost)) = costs.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return Vec::new() };
    // A quarter of the motion is what a robot of other sizes misses by.
    let is_decisive = best != SOUND && cost < 0.5 * CHECKS.max_unexplained && cost < 0.4 * sound;
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

/// Motion between two instants, its distance and its turn.
fn driven(
    run: &RunLog,
    hypothesis: Hypothesis,
    geometry: &DriveGeometry,
    from_s: f64,
    to_s: f64,
) -> Option<(Pose, f64, f64)> {
    let first = run.t_s.partition_point(|t_s| *t_s <= from_s);
    let last = run.t_s.partition_point(|t_s| *t_s < to_s);
    let mut before = run.angles_at(from_s)?;
    let mut pose = Pose::IDENTITY;
    let (mut driven_m, mut turned_rad) = (0.0, 0.0);
    for t_s in run.t_s.get(first..last).unwrap_or(&[]).iter().copied().chain([to_s]) {
        let now = run.angles_at(t_s)?;
        let turn = wheels_of(hypothesis, now.zip_with(before, |now, before| now - before));
        before = now;
        let travel_m = turn.zip_with(geometry.m_per_rad(), |rad, m| hypothesis.unit * rad * m);
        let increment = Increment::from_travel(travel_m, hypothesis.unit * geometry.wheel_separation_m());
        pose = pose * increment.arc();
        driven_m += 0.5 * (travel_m.left.abs() + travel_m.right.abs());
        turned_rad += increment.turn_rad;
    }
    Some((pose, driven_m, turned_rad))
}

/// Does the robot go somewhere in a step, by the instrument: farther than a spin about a wheel would take it?
fn goes_somewhere(step: &Step<'_>, geometry: &DriveGeometry) -> bool {
    let (from, to) = (step.from.1, step.to.1);
    (to.x_m - from.x_m).hypot(to.y_m - from.y_m) > geometry.wheel_separation_m()
}

/// What a hypothesis misses of a step, from 0 to about 2: of the distance driven, and of half a turn.
fn miss(step: &Step<'_>, hypothesis: Hypothesis, geometry: &DriveGeometry) -> Option<f64> {
    let (pose, driven_m, turned_rad) = driven(step.run, hypothesis, geometry, step.from.0, step.to.0)?;
    let (sin, cos) = step.from.1.theta_rad.sin_cos();
    let (dx_m, dy_m) = (step.to.1.x_m - step.from.1.x_m, step.to.1.y_m - step.from.1.y_m);
    let (ahead_m, aside_m) = (cos * dx_m + sin * dy_m, cos * dy_m - sin * dx_m);
    let went_m = ahead_m.hypot(aside_m);
    if driven_m.max(went_m) < 0.05 * hypothesis.unit * geometry.wheel_separation_m() {
        return None;
    }
    let far = (ahead_m - pose.x_m).hypot(aside_m - pose.y_m) / driven_m.max(went_m);
    let turn_rad = wrap_to_pi(step.to.1.theta_rad - step.from.1.theta_rad - turned_rad);
    Some(far + turn_rad.abs() / std::f64::consts::PI)
}
