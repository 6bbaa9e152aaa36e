//! A product of covariates on a channel: its value at a moment, and what it adds there.

use std::collections::BTreeMap;

use kinematics::{Pose, Twist, Wheels};
use model_term::TermParameter;

use crate::channel::Channel;
use crate::covariate::{Covariate, KinematicSample};

/// How a product of no covariates is written.
pub(super) const CONSTANT: &str = "1";

/// A channel and the product of covariates that it goes with.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse {
    /// What it adds to.
    pub channel: Channel,
    /// The factors; none for a constant.
    pub covariates: Vec<Covariate>,
}

impl Sparse {
    /// The names of its covariates, as findings and scenarios have them.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        if self.covariates.is_empty() {
            return vec![CONSTANT.to_owned()];
        }
        self.covariates.iter().map(Covariate::name).collect()
    }

    /// Whether it goes with what is found once for all products of an interval: those do that add to the
    /// motion or to the wheels' travel, but for what goes with rows.
    #[must_use]
    pub fn shares_samples(&self) -> bool {
        !self.channel.is_of_instrument() && !self.is_of_rows()
    }

    /// What goes with how much longer rows are by their stamps than by the beat behind them: the only term
    /// that does.
    #[must_use]
    pub fn of_rows() -> Self {
        Self { channel: Channel::Wheels, covariates: vec![Covariate::WheelSpeed, Covariate::RowLength] }
    }

    pub(super) fn is_of_rows(&self) -> bool {
        self.covariates.iter().any(Covariate::is_of_rows)
    }

    pub(super) fn product(&self, at: &KinematicSample<'_>) -> f64 {
        self.covariates.iter().map(|covariate| covariate.value(at)).product()
    }

    /// The product for each wheel by what it does itself; 0 for one that the channel leaves alone.
    pub(super) fn of_wheels(&self, channel: Channel, at: &KinematicSample<'_>) -> Wheels<f64> {
        Wheels::from_sides(|side| if channel.is_of(side) { self.product(&at.of_wheel(side)) } else { 0.0 })
    }
}

/// A moment at which an instrument measures: twist, heading and time alone are known of it.
pub(super) fn seen(twist: Twist, world_from_body: Pose, run_s: f64) -> KinematicSample<'static> {
    static NONE: BTreeMap<String, f64> = BTreeMap::new();
    KinematicSample {
        v_m_s: twist.v_m_s,
        omega_rad_s: twist.omega_rad_s,
        acceleration_m_s2: 0.0,
        yaw_acceleration_rad_s2: 0.0,
        heading_rad: world_from_body.theta_rad,
        wheel_m_s: Wheels::both(0.0),
        wheel_m_s2: Wheels::both(0.0),
        own_m_s: 0.0,
        own_m_s2: 0.0,
        own_since_reversal_m: [f64::INFINITY; 2],
        wheel_rad: Wheels::both(0.0),
        turned_rad: Wheels::both(0.0),
        run_s,
        session_s: 0.0,
        session_m: 0.0,
        since_reversal_m: f64::INFINITY,
        wheel_since_reversal_m: Wheels::both([f64::INFINITY; 2]),
        last_turn: 0.0,
        x_m: 0.0,
        y_m: 0.0,
        of_run: &NONE,
    }
}

/// A size on a channel that is none of the wheels', by v and ω.
pub(super) fn on_channel(channel: Channel, size: f64, twist: Twist) -> Pose {
    match channel {
        Channel::Along | Channel::OffsetAlong => Pose::new(size, 0.0, 0.0),
        Channel::Across | Channel::OffsetAcross => Pose::new(0.0, size, 0.0),
        Channel::Yaw | Channel::OffsetHeading => Pose::new(0.0, 0.0, size),
        Channel::MeasurementDelay => Pose::new(-size * twist.v_m_s, 0.0, -size * twist.omega_rad_s),
        // What both wheels or one of them gain needs their separation: `Sparse::of_wheels`.
        Channel::Wheels | Channel::LeftWheel | Channel::RightWheel => Pose::IDENTITY,
    }
}

/// What would be large for a real robot: two per cent at unit covariates, two hundredths of a second; more of
/// what fades after a reversal.
pub(super) fn parameter(of: &Sparse) -> TermParameter {
    let unit = match of.channel {
        Channel::Yaw => "rad/s",
        Channel::OffsetAlong | Channel::OffsetAcross => "m",
        Channel::OffsetHeading => "rad",
        Channel::MeasurementDelay => "s",
        _ => "m/s",
    };
    let faded: f64 = of.covariates.iter().map(Covariate::fades).product();
    TermParameter { name: "coefficient", unit, prior_sigma: 0.02 * faded }
}
