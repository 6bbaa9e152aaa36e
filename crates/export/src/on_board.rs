//! What the C header computes, in Rust: dead reckoning as a robot does it on line, from counts and from what
//! it is told, with nothing of what comes after.
//!
//! A plain calibration goes by the midpoint rule and an extended model by exact arcs of counts and terms
//! together, as evaluation does; the mean terms of the effects are the estimation model's own, with speeds
//! from the interval itself and those before instead of from rows around it (`causal.rs`). Covariance:
//! `on_board_covariance.rs`.

use dataset::RunInfo;
use effects::{Input, OnBoard, RawInterval};
use kinematics::{Increment, Pose, Wheels};
use model_term::{Interval, ModelTerm};
use nalgebra::Matrix3;

use crate::causal::{FollowedInputs, KnownInputs, OnBoardInputs, PastIntervals};
use crate::error::ExportError;
use crate::on_board_covariance::OnBoardCovariance;
use crate::robot::{CalibratedRobot, RobotEffect};
use crate::settings::DEFAULT_COUNTER_BITS;

/// A mean term on board.
struct Term {
    term: Box<dyn ModelTerm>,
    values: Vec<f64>,
    input: Option<Input>,
    gradient: Vec<Pose>,
}

/// A robot's odometry on line.
pub struct OnBoardOdometry {
    m_per_count: Wheels<f64>,
    rad_per_count: f64,
    wheel_separation_m: f64,
    is_extended: bool,
    counter_bits: u8,
    corrections: Vec<RobotEffect>,
    terms: Vec<Term>,
    past: PastIntervals,
    inputs: FollowedInputs,
    run: RunInfo,
    pose: Pose,
    covariance: Option<OnBoardCovariance>,
    counts: Wheels<i64>,
}

impl OnBoardOdometry {
    /// At the identity, with these counts. `counter_bits` is as in [`crate::Options`].
    ///
    /// # Errors
    /// [`ExportError`] when the robot has no counts, or is no drive.
    pub fn new(robot: &CalibratedRobot, counter_bits: Option<u8>, counts: Wheels<i64>) -> Result<Self, ExportError> {
        let ticks_per_rev = robot.ticks_per_rev()?;
        let geometry = robot.geometry()?;
        let m_per_count = geometry
            .m_per_count(ticks_per_rev)
            .map_err(|source| ExportError::NotADrive { place: robot.place.clone(), source })?;
        let terms = robot.effects.iter().filter(|effect| effect.on_board.has_mean()).flat_map(|effect| {
            let input = effect.on_board.input();
            effect.terms.iter().map(move |(term, values)| {
                let mut term = term.clone();
                term.linearize_at(values);
                term.restart(&RunInfo::default());
                Term { term, values: values.clone(), input, gradient: vec![Pose::IDENTITY; values.len()] }
            })
        });
        let wheel_separation_m = geometry.wheel_separation_m();
        Ok(Self {
            m_per_count,
            rad_per_count: std::f64::consts::TAU / ticks_per_rev,
            wheel_separation_m,
            is_extended: robot.is_extended,
            counter_bits: width(robot, counter_bits),
            corrections: robot.corrections().cloned().collect(),
            terms: terms.collect(),
            past: PastIntervals::default(),
            inputs: FollowedInputs::default(),
            run: RunInfo::default(),
            pose: Pose::IDENTITY,
            covariance: robot.noise.map(|noise| OnBoardCovariance::new(noise, robot, wheel_separation_m)),
            counts,
        })
    }

    /// From this pose on.
    #[must_use]
    pub const fn starting_at(mut self, pose: Pose) -> Self {
        self.pose = pose;
        self
    }

    /// Goes on to these counts, which came so many seconds after those before; nothing new is told.
    pub fn step(&mut self, counts: Wheels<i64>, dt_s: f64) {
        self.step_with(counts, dt_s, &OnBoardInputs::default());
    }

    /// Goes on to these counts, which came so many seconds after those before, with what is told of them.
    pub fn step_with(&mut self, counts: Wheels<i64>, dt_s: f64, logged: &OnBoardInputs) {
        let bits = self.counter_bits;
        let since = counts.zip_with(self.counts, |now, before| difference(now, before, bits));
        self.counts = counts;
        let raw = RawInterval { counts: since, dt_s };
        let RawInterval { counts: since, dt_s } = self.corrections.iter().fold(raw, |raw, effect| {
            let OnBoard::Constant(correction) = effect.on_board else { return raw };
            (correction.correct)(&|name| effect.size(name), raw)
        });
        let travel_m = self.m_per_count.zip_with(since, |m_per_count, counts| m_per_count * counts);
        let speed_m_s = travel_m.map(|travel_m| if dt_s > 0.0 { travel_m / dt_s } else { 0.0 });
        let before = self.pose;
        let increment = Increment::from_travel(travel_m, self.wheel_separation_m);
        let Increment { distance_m, turn_rad } = increment;
        let turned_rad = since.map(|counts| self.rad_per_count * counts);
        let known = self.inputs.after(logged, before, turned_rad, increment, dt_s);
        if let (Some(payload_kg), Some(key)) = (known.payload_kg, Input::Payload.covariate()) {
            self.run.covariates.insert(key.to_owned(), payload_kg);
        }
        let interval = Interval {
            t_s: known.session_s.unwrap_or(0.0),
            dt_s,
            late_s: self.past.lateness(dt_s),
            travel_m,
            speed_m_s,
            speed_at_ends_m_s: self.past.speeds(travel_m, dt_s),
            count_m: self.m_per_count,
            wheel_separation_m: self.wheel_separation_m,
            wheel_rad: known.wheel_rad.map(|from_rad| from_rad.unwrap_or(0.0)),
            turned_rad,
            world_from_body: Pose { theta_rad: known.room_heading_rad.unwrap_or(before.theta_rad), ..before },
            session_m: known.session_m.unwrap_or(0.0),
            run: &self.run,
        };
        let change = of_terms(&mut self.terms, &interval, &known);
        let moved = Increment { distance_m: distance_m + change.x_m, turn_rad: turn_rad + change.theta_rad };
        if let Some(covariance) = &mut self.covariance {
            covariance.after(before, before.theta_rad + moved.turn_rad, &interval);
        }
        let moved = if self.is_extended { moved.arc() } else { moved.midpoint() };
        self.pose = before * moved * Pose::new(0.0, change.y_m, 0.0);
    }

    /// The pose of the drive's centre.
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// Its covariance (x, y, θ) since the start, by the noise of the odometry and what else scatters; `None`
    /// where that was not estimated.
    #[must_use]
    pub fn covariance(&self) -> Option<&Matrix3<f64>> {
        self.covariance.as_ref().map(OnBoardCovariance::matrix)
    }
}

/// What the terms add to the motion by the counts; those without their input add nothing.
fn of_terms(terms: &mut [Term], interval: &Interval<'_>, known: &KnownInputs) -> Pose {
    // Without its angle a wheel does not turn, as far as its phase goes.
    let turned_rad = Wheels::from_sides(|side| known.wheel_rad[side].map_or(0.0, |_| interval.turned_rad[side]));
    let by_phase = Interval { turned_rad, ..*interval };
    let mut change = Pose::IDENTITY;
    for Term { term, values, input, gradient } in terms {
        if input.is_some_and(|input| !known.has(input)) {
            continue;
        }
        gradient.fill(Pose::IDENTITY);
        term.motion(if *input == Some(Input::WheelAngles) { &by_phase } else { interval }, gradient);
        for (by, value) in gradient.iter().zip(values.iter()) {
            change.x_m += value * by.x_m;
            change.y_m += value * by.y_m;
            change.theta_rad += value * by.theta_rad;
        }
    }
    change
}

/// Width of a robot's counters: as chosen, as its records have it, as stated, or the usual one.
pub(crate) fn width(robot: &CalibratedRobot, chosen: Option<u8>) -> u8 {
    let of_record = |effect: &RobotEffect| match effect.on_board {
        OnBoard::Constant(correction) => correction.counter_bits.map(|name| effect.size(name) as u8),
        _ => None,
    };
    let recorded = || robot.effects.iter().find_map(of_record);
    chosen.or_else(recorded).or(robot.counter_bits).unwrap_or(DEFAULT_COUNTER_BITS)
}

/// Counts between two readings of a counter that wraps: the nearer way round.
fn difference(now: i64, before: i64, bits: u8) -> f64 {
    let mask = u64::MAX >> (64 - u32::from(bits));
    let up = now.wrapping_sub(before) as u64 & mask;
    if up <= mask / 2 { up as f64 } else { -((mask - up) as f64) - 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn a_counter_goes_the_nearer_way_round() {
        assert_eq!(difference(3, 65_533, 16), 6.0);
        assert_eq!(difference(65_533, 3, 16), -6.0);
        assert_eq!(difference(-3, 3, 16), -6.0);
        assert_eq!(difference(i64::from(i32::MIN), i64::from(i32::MAX), 32), 1.0);
        assert_eq!(difference(i64::MIN, i64::MAX, 64), 1.0);
        assert_eq!(difference(5_000_000_000, 0, 64), 5e9);
        assert_eq!(difference(0, 1, 8), -1.0);
    }

    /// The same rule from the same counts; headings are summed here and functions of the counts there: they
    /// differ by 6e-16 m over these 100 steps. Seen to reject exact arcs, which differ by 1.4e-5 m.
    #[test]
    fn a_plain_calibration_is_dead_reckoned_as_evaluation_does() {
        let robot = specimen();
        let counts = |step: i64| Wheels { left: 240 * step - step * step, right: 260 * step };
        let mut odometry = OnBoardOdometry::new(&robot, None, counts(0)).expect("a drive");
        let (mut left, mut right) = (vec![0], vec![0]);
        for step in 1..=100 {
            odometry.step(counts(step), 0.05);
            left.push(counts(step).left);
            right.push(counts(step).right);
        }
        let t_s = (0..=100).map(|step| 0.05 * f64::from(step)).collect();
        let wheels = dataset::WheelLog::Ticks(Wheels { left, right });
        let run = dataset::Run {
            odometry: dataset::Odometry { t_s, wheels, extra: Default::default() },
            ..dataset::Run::default()
        };
        let nominal = dataset::NominalRobot {
            left_wheel_diameter_m: 0.2,
            right_wheel_diameter_m: 0.2,
            wheel_separation_m: 0.4,
            ticks_per_rev: Some(10_000.0),
            counter_bits: None,
        };
        let dataset = dataset::Dataset {
            provenance: dataset::Provenance::default(),
            robot: nominal,
            truth_noise: dataset::TruthNoise::default(),
            points: Vec::new(),
            runs: vec![run],
        };
        let session = dataset.session();
        let geometry = robot.geometry().expect("a drive");
        let mut end = Pose::IDENTITY;
        let visit = |_, pose| end = pose;
        session.runs[0].dead_reckon(&nominal, &geometry, kinematics::Rule::Midpoint, Pose::IDENTITY, visit);
        let found = odometry.pose();
        assert!(end.x_m.abs() > 0.5 && end.theta_rad.abs() > 0.5, "{end:?}");
        let off = [found.x_m - end.x_m, found.y_m - end.y_m, found.theta_rad - end.theta_rad];
        assert!(off.iter().all(|off| off.abs() < 1e-12), "{off:?}");
    }

    #[test]
    fn a_turn_on_the_spot_goes_by_the_calibrated_lengths() {
        let robot = specimen();
        let mut odometry = OnBoardOdometry::new(&robot, None, Wheels::both(0)).expect("a drive");
        odometry.step(Wheels { left: -990, right: 1010 }, 0.05);
        // π · (0.202 · 990 + 0.198 · 1010)/10000 m over 0.408 m.
        let expected_rad = std::f64::consts::PI * (0.202 * 0.099 + 0.198 * 0.101) / 0.408;
        assert!((odometry.pose().theta_rad - expected_rad).abs() < 1e-15);
        assert!(odometry.covariance().is_some_and(|covariance| covariance[(2, 2)] > 0.0));
    }
}
