//! Terms outside of the catalogue: a channel times a product of at most three covariates, normalised.
//!
//! Reference: Brunton, Proctor & Kutz 2016 (sparse terms over a library of functions); columns are normalised because a threshold on raw coefficients depends on
//! units. Every product vanishes at standstill.

use dataset::{Interval, Look, ModelTerm, RunInfo, TermParameter};
use kinematics::{Pose, Side};

/// Which increment a term adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Channel {
    /// Along the robot.
    Along,
    /// Across, to the left.
    Across,
    /// The heading.
    Yaw,
    /// What the instrument sees, ahead of the robot.
    SeenAlong,
    /// What the instrument sees, to the left of the robot.
    SeenAcross,
    /// The heading that the instrument sees.
    SeenHeading,
}

impl Channel {
    /// Of the motion.
    pub(crate) const ALL: [Self; 3] = [Self::Along, Self::Across, Self::Yaw];
    /// Of the instrument.
    pub(crate) const SEEN: [Self; 3] = [Self::SeenAlong, Self::SeenAcross, Self::SeenHeading];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Along => "along",
            Self::Across => "across",
            Self::Yaw => "yaw",
            Self::SeenAlong => "seen_along",
            Self::SeenAcross => "seen_across",
            Self::SeenHeading => "seen_heading",
        }
    }
}

/// What was recorded of an interval, each over a size that makes it about 1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Covariate {
    /// v over 1 m/s.
    Speed,
    /// |v|.
    AbsSpeed,
    /// ω over 1 rad/s.
    YawRate,
    /// |ω|.
    AbsYawRate,
    /// Change of v, m/s².
    Acceleration,
    /// Change of ω, rad/s².
    YawAcceleration,
    /// Cosine of the heading in the room.
    CosHeading,
    /// Sine of the heading in the room.
    SinHeading,
    /// Cosine of a wheel's angle times its speed.
    CosPhase(Side),
    /// Sine of a wheel's angle times its speed.
    SinPhase(Side),
    /// Time in the run over a minute.
    RunTime,
    /// Time on the session's clock over ten minutes.
    SessionTime,
    /// Way driven in the session over 100 m.
    Way,
    /// e^(−s/0.1 m) with the way s since the robot last went the other way.
    SinceReversal,
    /// Place in the room, metres.
    X,
    /// Place in the room, metres.
    Y,
    /// A covariate of the run, less its mean and over its standard deviation.
    OfRun { key: String, mean: f64, sd: f64 },
}

impl Covariate {
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Speed => "v",
            Self::AbsSpeed => "|v|",
            Self::YawRate => "omega",
            Self::AbsYawRate => "|omega|",
            Self::Acceleration => "acceleration",
            Self::YawAcceleration => "yaw_acceleration",
            Self::CosHeading => "cos(theta)",
            Self::SinHeading => "sin(theta)",
            Self::CosPhase(Side::Left) => "v cos(left wheel)",
            Self::CosPhase(Side::Right) => "v cos(right wheel)",
            Self::SinPhase(Side::Left) => "v sin(left wheel)",
            Self::SinPhase(Side::Right) => "v sin(right wheel)",
            Self::RunTime => "time in run",
            Self::SessionTime => "session time",
            Self::Way => "distance driven",
            Self::SinceReversal => "exp(-distance since reversal / 0.1 m)",
            Self::X => "x",
            Self::Y => "y",
            Self::OfRun { key, .. } => return key.clone(),
        }
        .to_owned()
    }
}

/// A channel's rate as a product of covariates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sparse {
    pub(crate) channel: Channel,
    pub(crate) covariates: Vec<Covariate>,
}

impl Sparse {
    pub(crate) fn term(&self) -> Box<dyn ModelTerm> {
        Box::new(Term { of: self.clone(), swung_m: 0.0, ahead: None, since_m: f64::INFINITY, started: false })
    }
}

/// Way back that counts as a reversal, metres: more than the counts of a standstill.
const REVERSAL_M: f64 = 1e-3;

struct Term {
    of: Sparse,
    swung_m: f64,
    ahead: Option<bool>,
    since_m: f64,
    started: bool,
}

/// A rate of 1 per cent at unit covariates would be large for a real robot.
const ALONG: [TermParameter; 1] = [TermParameter { name: "coefficient", unit: "m/s", plausible: 0.02 }];
const YAW: [TermParameter; 1] = [TermParameter { name: "coefficient", unit: "rad/s", plausible: 0.02 }];

const SEEN: [TermParameter; 1] = [TermParameter { name: "coefficient", unit: "m", plausible: 0.02 }];
const SEEN_HEADING: [TermParameter; 1] = [TermParameter { name: "coefficient", unit: "rad", plausible: 0.02 }];

impl ModelTerm for Term {
    fn parameters(&self) -> &'static [TermParameter] {
        match self.of.channel {
            Channel::Along | Channel::Across => &ALONG,
            Channel::Yaw => &YAW,
            Channel::SeenAlong | Channel::SeenAcross => &SEEN,
            Channel::SeenHeading => &SEEN_HEADING,
        }
    }

    fn restart(&mut self, _run: &RunInfo) {
        (self.swung_m, self.ahead, self.since_m, self.started) = (0.0, None, f64::INFINITY, false);
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        if interval.dt_s <= 0.0 || Channel::SEEN.contains(&self.of.channel) {
            return;
        }
        let increment = interval.increment();
        let (v, omega) = (increment.distance_m / interval.dt_s, increment.turn_rad / interval.dt_s);
        let before = interval.previous_speed_m_s();
        let started = std::mem::replace(&mut self.started, true);
        self.swung_m = (self.swung_m + increment.distance_m).clamp(-0.5 * REVERSAL_M, 0.5 * REVERSAL_M);
        if self.swung_m.abs() >= 0.5 * REVERSAL_M {
            let ahead = self.swung_m > 0.0;
            if self.ahead.is_some_and(|before| before != ahead) {
                self.since_m = 0.0;
            }
            self.ahead = Some(ahead);
        }
        self.since_m += increment.distance_m.abs();
        let heading_rad = interval.world_from_body.theta_rad + 0.5 * increment.turn_rad;
        let phase_rad = |side: Side| interval.wheel_rad[side] + 0.5 * interval.turned_rad[side];
        let product: f64 = self
            .of
            .covariates
            .iter()
            .map(|covariate| match covariate {
                Covariate::Speed => v,
                Covariate::AbsSpeed => v.abs(),
                Covariate::YawRate => omega,
                Covariate::AbsYawRate => omega.abs(),
                Covariate::Acceleration if started => {
                    (v - 0.5 * (before.left + before.right)) / (0.5 * (interval.dt_s + interval.previous_dt_s))
                }
                Covariate::YawAcceleration if started => {
                    (omega - (before.right - before.left) / interval.wheel_separation_m)
                        / (0.5 * (interval.dt_s + interval.previous_dt_s))
                }
                Covariate::Acceleration | Covariate::YawAcceleration => 0.0,
                Covariate::CosHeading => heading_rad.cos(),
                Covariate::SinHeading => heading_rad.sin(),
                Covariate::CosPhase(side) => interval.speed_m_s()[*side] * phase_rad(*side).cos(),
                Covariate::SinPhase(side) => interval.speed_m_s()[*side] * phase_rad(*side).sin(),
                Covariate::RunTime => interval.t_s / 60.0,
                Covariate::SessionTime => interval.session_s() / 600.0,
                Covariate::Way => interval.session_m / 100.0,
                Covariate::SinceReversal => (-self.since_m / 0.1).exp(),
                Covariate::X => interval.world_from_body.x_m,
                Covariate::Y => interval.world_from_body.y_m,
                Covariate::OfRun { key, mean, sd } => {
                    interval.run.covariates.get(key).map_or(0.0, |value| (value - mean) / sd)
                }
            })
            .product();
        let size = product * interval.dt_s;
        gradient[0] = match self.of.channel {
            Channel::Along => Pose::new(size, 0.0, 0.0),
            Channel::Across => Pose::new(0.0, size, 0.0),
            _ => Pose::new(0.0, 0.0, size),
        };
    }

    /// The instrument's library knows twist and heading alone.
    fn sight(&mut self, look: &Look<'_>, gradient: &mut [Pose]) {
        let (v, omega, heading_rad) = (look.twist.v_m_s, look.twist.omega_rad_s, look.world_from_body.theta_rad);
        let value = |covariate: &Covariate| match covariate {
            Covariate::Speed => v,
            Covariate::AbsSpeed => v.abs(),
            Covariate::YawRate => omega,
            Covariate::AbsYawRate => omega.abs(),
            Covariate::CosHeading => heading_rad.cos(),
            Covariate::SinHeading => heading_rad.sin(),
            _ => 0.0,
        };
        let size: f64 = self.of.covariates.iter().map(value).product();
        gradient[0] = match self.of.channel {
            Channel::SeenAlong => Pose::new(size, 0.0, 0.0),
            Channel::SeenAcross => Pose::new(0.0, size, 0.0),
            Channel::SeenHeading => Pose::new(0.0, 0.0, size),
            _ => return,
        };
    }
}
