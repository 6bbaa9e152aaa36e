//! How recorded data show a product of covariates.

use dataset::RunInfo;
use kinematics::{Increment, Pose, Wheels};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};

use super::sparse::{Sparse, on_channel, parameter, seen};
use crate::covariate::KinematicSample;
use crate::motion_history::{MotionHistory, MotionHistoryTracker};

/// The estimation model in a run.
#[derive(Clone)]
pub(super) struct Recorded {
    of: Sparse,
    own: [TermParameter; 1],
    past: PreviousIntervals,
}

/// What moments need to know of the intervals before.
#[derive(Debug, Clone, Copy)]
pub(super) struct PreviousIntervals {
    memory: MotionHistoryTracker,
}

impl PreviousIntervals {
    pub(super) const NONE: Self = Self { memory: MotionHistoryTracker::NONE };

    /// The middle of an interval that takes time.
    pub(super) fn sample<'i>(&mut self, interval: &Interval<'i>) -> KinematicSample<'i> {
        let Increment { distance_m, turn_rad } = interval.increment();
        let wheel_m_s = interval.speed_m_s;
        let Increment { distance_m: v_m_s, turn_rad: omega_rad_s } =
            Increment::from_travel(wheel_m_s, interval.wheel_separation_m);
        let wheel_m_s2 = interval.speed_change_m_s().map(|gained_m_s| gained_m_s / interval.dt_s);
        let Wheels { left, right } = wheel_m_s2;
        self.memory.debounce(interval.count_m);
        let MotionHistory { since_reversal_m, wheel_since_reversal_m, last_turn } =
            self.memory.after(interval.travel_m, distance_m, turn_rad);
        KinematicSample {
            v_m_s,
            omega_rad_s,
            acceleration_m_s2: 0.5 * (left + right),
            yaw_acceleration_rad_s2: (right - left) / interval.wheel_separation_m,
            heading_rad: interval.world_from_body.theta_rad + 0.5 * turn_rad,
            wheel_m_s,
            wheel_m_s2,
            own_m_s: 0.0,
            own_m_s2: 0.0,
            own_since_reversal_m: [f64::INFINITY; 2],
            wheel_rad: interval.wheel_rad.zip_with(interval.turned_rad, |angle, turned| angle + 0.5 * turned),
            turned_rad: interval.turned_rad,
            run_s: interval.t_s,
            session_s: interval.session_s(),
            session_m: interval.session_m,
            since_reversal_m,
            wheel_since_reversal_m,
            last_turn,
            x_m: interval.world_from_body.x_m,
            y_m: interval.world_from_body.y_m,
            of_run: &interval.run.covariates,
        }
    }
}

impl Recorded {
    pub(super) fn new(of: &Sparse) -> Self {
        Self { of: of.clone(), own: [parameter(of)], past: PreviousIntervals::NONE }
    }
}

impl ModelTerm for Recorded {
    fn parameters(&self) -> &[TermParameter] {
        &self.own
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.past = PreviousIntervals::NONE;
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        if interval.dt_s > 0.0 && !self.of.channel.is_of_instrument() {
            let at = self.past.sample(interval);
            gradient[0] = if self.of.channel.is_of_wheels() {
                interval.change(self.of.of_wheels(self.of.channel, &at).map(|product| product * interval.dt_s))
            } else {
                on_channel(self.of.channel, self.of.product(&at) * interval.dt_s, at.twist())
            };
        }
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        if self.of.channel.is_of_instrument() {
            let product = self.of.product(&seen(measurement.twist, measurement.world_from_body, measurement.t_s));
            gradient[0] = on_channel(self.of.channel, product, measurement.twist);
        }
    }
}

/// Unit of how much longer a row is than by the beat, as a share of itself.
pub(super) const ROW_SHARE: f64 = 0.02;

/// What goes with how much longer rows are by their stamps: a share of the stamps' irregularity that is
/// false. Which speed it goes with is not that by the same stamps.
#[derive(Clone)]
pub(super) struct OfRows {
    pub(super) of: Box<dyn ModelTerm>,
    pub(super) own: [TermParameter; 1],
}

impl ModelTerm for OfRows {
    fn parameters(&self) -> &[TermParameter] {
        &self.own
    }

    fn restart(&mut self, run: &RunInfo) {
        self.of.restart(run);
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        self.of.motion(interval, gradient);
        let Pose { x_m, y_m, theta_rad } = gradient[0];
        gradient[0] = Pose::new(x_m / ROW_SHARE, y_m / ROW_SHARE, theta_rad / ROW_SHARE);
    }
}
