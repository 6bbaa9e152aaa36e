//! `traction_loss`: a wheel that is accelerated harder than the floor can hold slides until it is caught.
//!
//! Model: the contact sticks while the acceleration stays under μ_s g; then it slides with Stribeck friction
//! μ(u) = μ_k + (μ_s − μ_k) exp(−|u|/u_s) of the sliding speed u, until the speeds meet. Signature: a one-sided heavy tail of e_dx above some |a|; where many
//! starts and stops are as hard, a mean: ground lost at starts and gained at stops, by the wheel that is accelerated harder than the floor holds.
//! Observability: hard starts and stops. Alias: `bumps`; `slip_acceleration` where looks are few. Reference: Stribeck friction, Armstrong-Hélouvry et al. 1994.

use dataset::{Interval, ModelTerm, RunInfo, TermParameter};
use kinematics::{Pose, Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Shape, Sign, size};

/// Standard gravity, m/s² (CGPM 1901).
const GRAVITY_M_S2: f64 = 9.806_65;

/// Friction between tread and floor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TractionLoss {
    /// Static friction coefficient times the driven wheel's share of what it must push (μ_s).
    pub static_friction: f64,
    /// The same when sliding fast (μ_k).
    pub kinetic_friction: f64,
    /// Sliding speed at which friction has fallen by 1/e of the way (u_s), m/s.
    pub stribeck_speed_m_s: f64,
}

impl PhysicalEffect for TractionLoss {
    fn check(&self) -> Result<(), EffectError> {
        let id = "traction_loss";
        let positive = |parameter, value: f64| {
            EffectError::unless(value.is_finite() && value > 0.0, id, parameter, value, "positive")
        };
        positive("static_friction", self.static_friction)?;
        positive("stribeck_speed_m_s", self.stribeck_speed_m_s)?;
        let holds = self.kinetic_friction > 0.0 && self.kinetic_friction <= self.static_friction;
        EffectError::unless(
            holds,
            id,
            "kinetic_friction",
            self.kinetic_friction,
            "positive and at most static_friction",
        )
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self, ground_m_s: Wheels::both(0.0), sliding: Wheels::both(false) }))
    }

    fn hypothesis() -> Hypothesis {
        let terms = Shape::along("holds_m_s2", &HOLDS_M_S2, |holds_m_s2| Box::new(Term::new(holds_m_s2)));
        Hypothesis::TermsAndScatter(terms, &[Sign::WayJumps, Sign::HeadingJumps])
    }

    /// By the frictions, or by the acceleration up to which the floor holds and how much of a usual floor's sliding there is beyond it.
    fn of_sizes(sizes: &[(&str, f64)]) -> Option<Self> {
        if let Some((sliding, holds_m_s2)) = size(sizes, "sliding").zip(size(sizes, "holds_m_s2")) {
            return (sliding >= 0.0).then(|| Self::usual(holds_m_s2));
        }
        Some(Self {
            static_friction: size(sizes, "static_friction")?,
            kinetic_friction: size(sizes, "kinetic_friction")?,
            stribeck_speed_m_s: size(sizes, "stribeck_speed_m_s")?,
        })
    }
}

#[derive(Clone)]
struct State {
    size: TractionLoss,
    ground_m_s: Wheels<f64>,
    sliding: Wheels<bool>,
}

impl State {
    fn held_m_s2(&self, sliding_m_s: f64) -> f64 {
        let TractionLoss { static_friction, kinetic_friction, stribeck_speed_m_s } = self.size;
        let excess = (static_friction - kinetic_friction) * (-sliding_m_s.abs() / stribeck_speed_m_s).exp();
        GRAVITY_M_S2 * (kinetic_friction + excess)
    }
}

impl State {
    /// Slides for a while under a tread of some speed, until the speeds meet; the ground's speed then.
    fn slide(&mut self, side: Side, speed_m_s: f64, dt_s: f64) -> f64 {
        let before_m_s = self.ground_m_s[side];
        let gap_m_s = speed_m_s - before_m_s;
        let gain_m_s = self.held_m_s2(gap_m_s) * dt_s;
        if gap_m_s.abs() <= gain_m_s {
            self.ground_m_s[side] = speed_m_s;
            self.sliding[side] = false;
        } else {
            self.ground_m_s[side] = before_m_s + gain_m_s * gap_m_s.signum();
        }
        self.ground_m_s[side]
    }
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { start_motion: true, floor: true, ..Hooks::NONE }
    }

    fn start_motion(&mut self) {
        self.ground_m_s = Wheels::both(0.0);
        self.sliding = Wheels::both(false);
    }

    fn floor(&mut self, step: &mut Step) {
        let (speed_m_s, acceleration_m_s2) = (step.contact_speed_m_s(), step.contact_acceleration_m_s2());
        for side in Side::BOTH {
            let before_m_s = self.ground_m_s[side];
            if !self.sliding[side] {
                if acceleration_m_s2[side].abs() <= GRAVITY_M_S2 * self.size.static_friction {
                    self.ground_m_s[side] = speed_m_s[side];
                    continue;
                }
                self.sliding[side] = true;
            }
            self.slide(side, speed_m_s[side], step.dt_s);
            // While sliding the ground passes at the contact's own speed and not at the tread's.
            step.travel_m[side] = 0.5 * (before_m_s + self.ground_m_s[side]) * step.dt_s;
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("sliding is a transient")
    }
}

/// Accelerations up to which the floor holds that are tried, m/s².
const HOLDS_M_S2: [f64; 6] = [0.1, 0.2, 0.35, 0.55, 0.8, 1.2];
/// Kinetic over static friction, and the Stribeck speed, m/s, of a usual floor: rubber slides with two thirds to four fifths of what it holds.
const USUAL_KINETIC: f64 = 0.7;
const USUAL_STRIBECK_M_S: f64 = 0.05;

impl TractionLoss {
    /// A usual floor that holds up to an acceleration.
    fn usual(holds_m_s2: f64) -> Self {
        let static_friction = holds_m_s2 / GRAVITY_M_S2;
        let kinetic_friction = USUAL_KINETIC * static_friction;
        Self { static_friction, kinetic_friction, stribeck_speed_m_s: USUAL_STRIBECK_M_S }
    }
}

/// Longest step in which sliding is followed within a row, seconds: a hundredth of what friction takes to fall.
const STEP_S: f64 = 2.5e-3;
/// Most steps of a piece of a row: rows as long say nothing of a start.
const MOST_STEPS: f64 = 40.0;
/// Rows that a start may have lasted before its acceleration shows: it begins anywhere within one.
const ROWS_TO_SHOW: f64 = 2.5;

/// What a usual floor would lose, by the treads' speeds from row to row: within a row they change steadily.
#[derive(Clone)]
struct Term {
    floor: State,
    holds_m_s2: f64,
    row: Option<Row>,
}

/// The logged interval in force.
#[derive(Debug, Clone, Copy)]
struct Row {
    from_s: f64,
    end_s: f64,
    /// Mean speeds of the treads in it and in the one before, m/s.
    speed_m_s: Wheels<f64>,
    before_m_s: Wheels<f64>,
    acceleration_m_s2: Wheels<f64>,
}

impl Row {
    /// A tread's speed in it, by the steady change from its row before.
    fn speed_at_m_s(&self, side: Side, t_s: f64) -> f64 {
        self.speed_m_s[side] + self.acceleration_m_s2[side] * (t_s - 0.5 * (self.from_s + self.end_s))
    }
}

impl Term {
    fn new(holds_m_s2: f64) -> Self {
        let floor = State {
            size: TractionLoss::usual(holds_m_s2),
            ground_m_s: Wheels::both(0.0),
            sliding: Wheels::both(false),
        };
        Self { floor, holds_m_s2, row: None }
    }

    /// A row begins. Where its acceleration shows that a wheel slides, it has slid since that began: the way that it has lost until now.
    fn begin(&mut self, [from_s, end_s]: [f64; 2], speed_m_s: Wheels<f64>) -> Wheels<f64> {
        let length_s = end_s - from_s;
        let rest = Wheels::both(0.0);
        let (last_s, last_m_s, before_m_s) =
            self.row.map_or((length_s, rest, rest), |row| (row.end_s - row.from_s, row.speed_m_s, row.before_m_s));
        let acceleration_m_s2 = speed_m_s.zip_with(last_m_s, |now, before| (now - before) / (0.5 * (length_s + last_s)));
        let row = Row { from_s, end_s, speed_m_s, before_m_s: last_m_s, acceleration_m_s2 };
        self.row = Some(row);
        Wheels::from_sides(|side| {
            let changes_m_s2 = acceleration_m_s2[side];
            if self.floor.sliding[side] || changes_m_s2.abs() <= self.holds_m_s2 {
                return 0.0;
            }
            // It began at the speed of the last row that knew nothing of it.
            self.floor.sliding[side] = true;
            self.floor.ground_m_s[side] = before_m_s[side];
            let since_s = (row.speed_at_m_s(side, from_s) - before_m_s[side]) / changes_m_s2;
            let since_s = since_s.clamp(0.0, ROWS_TO_SHOW * last_s.max(length_s));
            self.slide(side, since_s, |t_s| before_m_s[side] + changes_m_s2 * t_s)
        })
    }

    /// The way that a wheel loses in some time, its tread's speed being what it is at each instant of it.
    fn slide(&mut self, side: Side, time_s: f64, tread_m_s: impl Fn(f64) -> f64) -> f64 {
        let steps = (time_s / STEP_S).ceil().clamp(1.0, MOST_STEPS);
        let step_s = time_s / steps;
        let (mut lost_m, mut passed_s) = (0.0, 0.5 * step_s);
        while passed_s < time_s && self.floor.sliding[side] {
            let (speed_m_s, before_m_s) = (tread_m_s(passed_s), self.floor.ground_m_s[side]);
            let after_m_s = self.floor.slide(side, speed_m_s, step_s);
            lost_m += (speed_m_s - 0.5 * (before_m_s + after_m_s)) * step_s;
            passed_s += step_s;
        }
        lost_m
    }
}

impl ModelTerm for Term {
    /// Plausible: what a usual floor loses.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "sliding", unit: "1", plausible: 1.0 }]
    }

    fn restart(&mut self, _run: &RunInfo) {
        *self = Self::new(self.holds_m_s2);
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let begins = self.row.is_none_or(|row| row.end_s != interval.row_s[1]);
        let mut lost_m =
            if begins { self.begin(interval.row_s, interval.speed_m_s()) } else { Wheels::both(0.0) };
        if let Some(row) = self.row {
            for side in Side::BOTH {
                lost_m[side] += self.slide(side, interval.dt_s, |t_s| row.speed_at_m_s(side, interval.t_s + t_s));
            }
        }
        gradient[0] = interval.change(lost_m.map(|lost_m| -lost_m));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    /// Ground travel of the left wheel over a start at `acceleration_m_s2` to 0.4 m/s and 0.3 s of cruise, and the tread's.
    fn start(acceleration_m_s2: f64) -> (f64, f64) {
        let mut state = TractionLoss { static_friction: 0.1, kinetic_friction: 0.06, stribeck_speed_m_s: 0.05 }
            .forward()
            .expect("acts");
        state.start_motion();
        let (mut speed_m_s, mut ground_m, mut tread_m, dt_s) = (0.0_f64, 0.0, 0.0, 1e-4);
        let ramp_s = 0.4 / acceleration_m_s2;
        for k in 0..((ramp_s + 0.9) / dt_s) as u32 {
            let a_m_s2 = if f64::from(k) * dt_s < ramp_s { acceleration_m_s2 } else { 0.0 };
            let mut step = specimen_step();
            step.dt_s = dt_s;
            step.travel_m.left = (speed_m_s + 0.5 * a_m_s2 * dt_s) * dt_s;
            tread_m += step.travel_m.left;
            speed_m_s += a_m_s2 * dt_s;
            step.rate_rad_s.left = speed_m_s / 0.08;
            step.acceleration_rad_s2.left = a_m_s2 / 0.08;
            state.floor(&mut step);
            ground_m += step.travel_m.left;
        }
        (ground_m, tread_m)
    }

    #[test]
    fn a_gentle_start_holds_and_a_hard_one_loses_ground() {
        let (ground_m, tread_m) = start(0.5);
        assert!((ground_m - tread_m).abs() < 1e-12, "0.5 m/s² is under 0.1 g");
        let (ground_m, tread_m) = start(3.0);
        // Between the loss under μ_s throughout and under μ_k throughout: v²/2·(1/a_held − 1/a).
        let loss = |held_m_s2: f64| 0.08 * (1.0 / held_m_s2 - 1.0 / 3.0);
        let lost_m = tread_m - ground_m;
        assert!(lost_m > loss(0.1 * GRAVITY_M_S2) && lost_m < loss(0.06 * GRAVITY_M_S2), "{lost_m}");
    }

    /// The hypothesis sees rows of the log and no frictions, but for a usual floor's.
    #[test]
    fn rows_of_the_log_show_what_a_usual_floor_loses() {
        let (holds_m_s2, acceleration_m_s2, cruise_m_s) = (0.98, 3.0, 0.4);
        let mut floor = State { size: TractionLoss::usual(holds_m_s2), ..Term::new(holds_m_s2).floor };
        let mut term = Term::new(holds_m_s2);
        let run = RunInfo::default();
        let (mut lost_m, mut expected_m, mut previous_m) = (0.0, 0.0, 0.0);
        let (dt_s, steps) = (1e-4, 200_u32);
        for row in 0..50 {
            let mut travel_m = 0.0;
            for k in 0..steps {
                let t_s = dt_s * f64::from(row * steps + k);
                let speed_m_s = (acceleration_m_s2 * t_s).min(cruise_m_s);
                let mut step = specimen_step();
                step.dt_s = dt_s;
                step.travel_m.left = speed_m_s * dt_s;
                step.rate_rad_s.left = speed_m_s / 0.08;
                step.acceleration_rad_s2.left = if speed_m_s < cruise_m_s { acceleration_m_s2 / 0.08 } else { 0.0 };
                travel_m += step.travel_m.left;
                floor.floor(&mut step);
                expected_m += speed_m_s * dt_s - step.travel_m.left;
            }
            let (from_s, length_s) = (0.02 * f64::from(row), 0.02);
            let interval = Interval {
                t_s: from_s,
                dt_s: length_s,
                row_s: [from_s, from_s + length_s],
                travel_m: Wheels { left: travel_m, right: 0.0 },
                previous_m: Wheels { left: previous_m, right: 0.0 },
                previous_dt_s: length_s,
                wheel_separation_m: 0.4,
                wheel_rad: Wheels::both(0.0),
                turned_rad: Wheels { left: travel_m / 0.08, right: 0.0 },
                world_from_body: Pose::IDENTITY,
                session_m: 0.0,
                run: &run,
            };
            let mut gradient = [Pose::IDENTITY];
            term.motion(&interval, &mut gradient);
            // Half of a wheel's way is the centre's.
            lost_m -= 2.0 * gradient[0].x_m;
            previous_m = travel_m;
        }
        // A start of 0.13 s is seven rows: the instant at which it ends is known to half a row.
        assert!((lost_m / expected_m - 1.0).abs() < 0.05, "{lost_m} for {expected_m}");
    }
}
