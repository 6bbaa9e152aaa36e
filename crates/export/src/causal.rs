//! What a robot's own odometry knows beside the counts of an interval: speeds and stamps of the intervals
//! before, and inputs that are followed by the counts until they are told again.

use effects::Input;
use kinematics::{Increment, Pose, Wheels};

use crate::settings::{LATENESS_KEPT, MAX_JITTER_SHARE, PERIOD_INTERVALS};

/// What a robot is told beside its counts; `None`: nothing new.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OnBoardInputs {
    /// Angle of each wheel at these counts, radians: what the counter of the log showed there.
    pub wheel_rad: Wheels<Option<f64>>,
    /// Heading at these counts in the room where the calibration was made, radians.
    pub room_heading_rad: Option<f64>,
    /// What the robot carries, kilograms.
    pub payload_kg: Option<f64>,
    /// Time since the session began, seconds.
    pub session_s: Option<f64>,
    /// Distance driven since the session began, metres.
    pub session_m: Option<f64>,
}

/// Inputs as they are known where an interval begins.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct KnownInputs {
    pub(crate) wheel_rad: Wheels<Option<f64>>,
    pub(crate) room_heading_rad: Option<f64>,
    pub(crate) payload_kg: Option<f64>,
    pub(crate) session_s: Option<f64>,
    pub(crate) session_m: Option<f64>,
}

impl KnownInputs {
    /// Whether an effect that needs an input can run. Each wheel's angle is known or not by itself.
    pub(crate) const fn has(&self, input: Input) -> bool {
        match input {
            Input::WheelAngles => true,
            Input::RoomHeading => self.room_heading_rad.is_some(),
            Input::Payload => self.payload_kg.is_some(),
            Input::SessionTime => self.session_s.is_some(),
            Input::SessionDistance => self.session_m.is_some(),
        }
    }
}

/// Follows inputs from interval to interval.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FollowedInputs {
    wheel_rad: Wheels<Option<f64>>,
    room_offset_rad: Option<f64>,
    payload_kg: Option<f64>,
    session_s: Option<f64>,
    session_m: Option<f64>,
}

impl FollowedInputs {
    /// What is known where an interval begins, once what was told at its end is taken.
    pub(crate) fn after(
        &mut self,
        logged: &OnBoardInputs,
        before: Pose,
        turned_rad: Wheels<f64>,
        moved: Increment,
        dt_s: f64,
    ) -> KnownInputs {
        let Increment { distance_m, turn_rad } = moved;
        let from = |logged: Option<f64>, known: Option<f64>, by: f64| logged.map(|logged| logged - by).or(known);
        let wheel_rad = Wheels::from_sides(|side| from(logged.wheel_rad[side], self.wheel_rad[side], turned_rad[side]));
        self.wheel_rad = Wheels::from_sides(|side| wheel_rad[side].map(|from_rad| from_rad + turned_rad[side]));
        if let Some(heading_rad) = logged.room_heading_rad {
            self.room_offset_rad = Some(heading_rad - (before.theta_rad + turn_rad));
        }
        self.payload_kg = logged.payload_kg.or(self.payload_kg);
        let session_s = from(logged.session_s, self.session_s, dt_s);
        self.session_s = session_s.map(|session_s| session_s + dt_s);
        let session_m = from(logged.session_m, self.session_m, distance_m.abs());
        self.session_m = session_m.map(|session_m| session_m + distance_m.abs());
        KnownInputs {
            wheel_rad,
            room_heading_rad: self.room_offset_rad.map(|offset_rad| before.theta_rad + offset_rad),
            payload_kg: self.payload_kg,
            session_s,
            session_m,
        }
    }
}

/// Speeds of the interval before, and how late its stamp was.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PastIntervals {
    speed_m_s: Wheels<f64>,
    intervals: f64,
    period_s: f64,
    late_s: f64,
}

impl PastIntervals {
    /// Speeds of the interval before and of this one; those before where this one has no length.
    pub(crate) fn speeds(&mut self, travel_m: Wheels<f64>, dt_s: f64) -> [Wheels<f64>; 2] {
        let before = self.speed_m_s;
        if dt_s > 0.0 {
            self.speed_m_s = travel_m.map(|travel_m| travel_m / dt_s);
        }
        [before, self.speed_m_s]
    }

    /// How late the stamps at the start and the end of this interval are against the mean period so far. What
    /// is far from it is no irregularity but a pause.
    pub(crate) fn lateness(&mut self, dt_s: f64) -> [f64; 2] {
        let before = self.late_s;
        if dt_s > 0.0 && (self.intervals == 0.0 || (dt_s - self.period_s).abs() <= MAX_JITTER_SHARE * self.period_s) {
            self.intervals = f64::min(self.intervals + 1.0, PERIOD_INTERVALS);
            self.period_s += (dt_s - self.period_s) / self.intervals;
            self.late_s = LATENESS_KEPT * self.late_s + (dt_s - self.period_s);
        }
        [before, self.late_s]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_of_the_past_add_up_to_nothing_over_a_start_and_a_stop() {
        let mut past = PastIntervals::default();
        let mut sum_m_s = 0.0;
        for travel_m in [0.0, 0.01, 0.02, 0.02, 0.005, 0.0] {
            let [start, end] = past.speeds(Wheels::both(travel_m), 0.02);
            sum_m_s += end.left - start.left;
        }
        assert_eq!(sum_m_s, 0.0);
        // An interval without a length has the speed before at both of its ends.
        let _ = past.speeds(Wheels::both(0.01), 0.02);
        assert_eq!(past.speeds(Wheels::both(0.01), 0.0), [Wheels::both(0.5); 2]);
    }

    /// Of white jitter a sixth is left by a fading mean over 20 intervals, √(0.05/1.95); a pause counts for
    /// nothing. Rejects lateness that is the length's departure alone, which leaves all of the jitter.
    #[test]
    fn lateness_is_the_stamps_against_their_period() {
        let mut past = PastIntervals::default();
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let (mut before_s, mut error, mut all) = (0.0, 0.0, 0.0);
        for row in 1..4000 {
            let late_s = 0.01 * uniform();
            let dt_s = 0.02 + late_s - before_s + if row == 2000 { 1.0 } else { 0.0 };
            let [_, found_s] = past.lateness(dt_s);
            if row == 2000 {
                before_s = found_s;
                continue;
            }
            before_s = late_s;
            if !(2000..2200).contains(&row) && row > 200 {
                error += (found_s - late_s).powi(2);
                all += late_s * late_s;
            }
        }
        let left = (error / all).sqrt();
        assert!((0.1..0.25).contains(&left), "{left}");
    }

    #[test]
    fn what_was_told_once_is_followed() {
        let mut followed = FollowedInputs::default();
        let (step, dt_s) = (Increment { distance_m: 0.1, turn_rad: 0.2 }, 0.02);
        let at = |theta_rad: f64| Pose::new(0.0, 0.0, theta_rad);
        let turned = Wheels { left: 1.0, right: 2.0 };
        let nothing = OnBoardInputs::default();
        let known = followed.after(&nothing, at(0.0), turned, step, dt_s);
        assert!(Input::ALL.iter().filter(|input| known.has(**input)).eq([&Input::WheelAngles]));
        assert_eq!(known.wheel_rad, Wheels::both(None));
        let logged = OnBoardInputs {
            wheel_rad: Wheels { left: Some(5.0), right: None },
            room_heading_rad: Some(1.2),
            payload_kg: Some(3.0),
            session_s: Some(60.02),
            session_m: Some(7.1),
        };
        let known = followed.after(&logged, at(0.2), turned, step, dt_s);
        assert_eq!(known.wheel_rad, Wheels { left: Some(4.0), right: None });
        let near = |found: Option<f64>, expected: f64| found.is_some_and(|found| (found - expected).abs() < 1e-12);
        assert!(near(known.room_heading_rad, 1.0) && near(known.session_s, 60.0) && near(known.session_m, 7.0));
        let known = followed.after(&nothing, at(0.5), turned, step, dt_s);
        assert_eq!((known.wheel_rad.left, known.payload_kg), (Some(5.0), Some(3.0)));
        assert!(near(known.room_heading_rad, 1.3) && near(known.session_s, 60.02) && near(known.session_m, 7.1));
    }
}
