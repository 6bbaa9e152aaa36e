//! What covariates and castors remember of a run: which way something last went, and how far since it last
//! reversed.

use kinematics::Wheels;

/// The side to which a value that drifts last went: it is held within a band, which it must cross to go to
/// the other side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hysteresis {
    half_width: f64,
    within: f64,
    sense: f64,
}

impl Hysteresis {
    /// Neither yet.
    pub(crate) const fn beyond(half_width: f64) -> Self {
        Self { half_width, within: 0.0, sense: 0.0 }
    }

    /// The band is at least so wide to either side.
    pub(crate) const fn widen(&mut self, half_width: f64) {
        self.half_width = self.half_width.max(half_width);
    }

    /// 1 or −1, once the value has gone this far on, or back where that is negative; 0 before it has first
    /// left the band's middle.
    pub(crate) fn after(&mut self, by: f64) -> f64 {
        self.within = (self.within + by).clamp(-self.half_width, self.half_width);
        if self.within.abs() >= self.half_width {
            self.sense = self.within.signum();
        }
        self.sense
    }
}

/// Way back that counts as a reversal, metres: more than the counts of a standstill.
const REVERSAL_M: f64 = 1e-3;

/// A turn that counts, radians: what straight driving wanders by is far less.
pub(crate) const TURN_RAD: f64 = 0.03;

/// The distance since something last reversed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reversals {
    went: Hysteresis,
    since_m: f64,
}

impl Reversals {
    /// None yet.
    pub(crate) const NONE: Self = Self { went: Hysteresis::beyond(0.5 * REVERSAL_M), since_m: f64::INFINITY };

    /// Counts of this size do not count: a wheel that stands between two of them reverses nothing.
    pub(crate) const fn debounce(&mut self, count_m: f64) {
        self.went.widen(count_m);
    }

    /// The distance since the last one, after going this far on, or back where that is negative.
    pub(crate) fn after(&mut self, distance_m: f64) -> f64 {
        let before = self.went.sense;
        if self.went.after(distance_m) * before < 0.0 {
            self.since_m = 0.0;
        }
        self.since_m += distance_m.abs();
        self.since_m
    }
}

/// What moments remember of a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotionHistoryTracker {
    centre: Reversals,
    wheels: Wheels<Reversals>,
    turned: Hysteresis,
}

/// What is remembered at a moment: distances since reversals, and the sense of the last turn.
pub(crate) struct MotionHistory {
    pub(crate) since_reversal_m: f64,
    pub(crate) wheel_since_reversal_m: Wheels<[f64; 2]>,
    pub(crate) last_turn: f64,
}

impl MotionHistoryTracker {
    /// Of a run that begins.
    pub(crate) const NONE: Self = Self {
        centre: Reversals::NONE,
        wheels: Wheels { left: Reversals::NONE, right: Reversals::NONE },
        turned: Hysteresis::beyond(TURN_RAD),
    };

    /// Counts of these sizes are no reversals.
    pub(crate) const fn debounce(&mut self, count_m: Wheels<f64>) {
        self.wheels.left.debounce(count_m.left);
        self.wheels.right.debounce(count_m.right);
        self.centre.debounce(0.5 * (count_m.left + count_m.right));
    }

    /// What is remembered once the wheels and the robot have gone on.
    pub(crate) fn after(&mut self, travel_m: Wheels<f64>, distance_m: f64, turn_rad: f64) -> MotionHistory {
        let since_m = Wheels::from_sides(|side| {
            let to_m = self.wheels[side].after(travel_m[side]);
            [to_m - travel_m[side].abs(), to_m]
        });
        MotionHistory {
            since_reversal_m: self.centre.after(distance_m),
            wheel_since_reversal_m: since_m,
            last_turn: self.turned.after(turn_rad),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_is_another_once_the_band_is_crossed() {
        let mut side = Hysteresis::beyond(0.03);
        assert_eq!([0.02, 0.02, -0.05, -0.02, 0.05].map(|by| side.after(by)), [0.0, 1.0, 1.0, -1.0, -1.0]);
    }

    #[test]
    fn a_reversal_takes_more_than_the_counts_of_a_standstill() {
        let mut reversals = Reversals::NONE;
        assert_eq!(reversals.after(0.5), f64::INFINITY);
        assert_eq!(reversals.after(-0.9 * REVERSAL_M), f64::INFINITY);
        assert_eq!(reversals.after(-0.2 * REVERSAL_M), 0.2 * REVERSAL_M);
        assert_eq!(reversals.after(-0.1), 0.2 * REVERSAL_M + 0.1);
    }
}
