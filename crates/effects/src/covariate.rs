//! The covariates of terms outside of the catalogue: their names, normalisation and values.
//!
//! Both models of [`crate::SparseTerm`] read this one list, and so do scenarios and findings: a name means
//! the same wherever it stands. How the speeds, the heading or the distance come about is each model's own.

use std::collections::BTreeMap;

use kinematics::{Side, Twist, Wheels, sin_cos, sinc};

/// What was recorded of an interval, each over a size that makes it about 1.
#[derive(Debug, Clone, PartialEq)]
pub enum Covariate {
    /// `v`: speed over 1 m/s.
    Speed,
    /// `|v|`.
    AbsSpeed,
    /// `omega`: yaw rate over 1 rad/s.
    YawRate,
    /// `|omega|`.
    AbsYawRate,
    /// `acceleration`: change of v, over 1 m/s².
    Acceleration,
    /// `yaw_acceleration`: change of ω, over 1 rad/s².
    YawAcceleration,
    /// `wheel v`: speed of the wheel's own contact over 1 m/s.
    WheelSpeed,
    /// `|wheel v|`.
    AbsWheelSpeed,
    /// `wheel sense`: 1 where the wheel's contact goes forward, −1 where it goes back, 0 where it stands.
    WheelSense,
    /// `wheel acceleration`: change of the contact's speed, over 1 m/s².
    WheelAcceleration,
    /// `exp(-|wheel v| / 0.05 m/s)`: of the speed of the wheel's own contact; 1 where it stands.
    SlowWheel,
    /// `exp(-wheel distance since reversal / 2 mm)`: of the distance since the wheel's contact last reversed,
    /// on average over the interval; 0 before it first does.
    WheelSinceReversal,
    /// `row length`: how much longer the logged interval is by its stamps than by the beat of its run's rows,
    /// over 2 % of itself.
    RowLength,
    /// `cos(theta)`: of the heading in the room.
    CosHeading,
    /// `sin(theta)`: of the heading in the room.
    SinHeading,
    /// `v cos(left wheel)`, `v cos(5 right wheel)`: cosine of so many times a wheel's angle, on average over
    /// the interval, times its contact's speed.
    CosPhase(Side, u8),
    /// `v sin(left wheel)`, `v sin(5 right wheel)`: the same of the sine.
    SinPhase(Side, u8),
    /// `time in run`, over a minute.
    RunTime,
    /// `session time`: on the session's clock, over ten minutes.
    SessionTime,
    /// `distance driven` in the session, over 100 m.
    Way,
    /// `exp(-distance since reversal / 0.1 m)`: of the distance since the robot last reversed; 0 before it
    /// first does.
    SinceReversal,
    /// `curvature`: ω over √(ω² + (v / 0.2 m)²): 1 on the spot to the left, −1 to the right, 0 straight on.
    Curvature,
    /// `last turn`: 1 where the robot last turned to the left, −1 to the right; 0 before it first does.
    LastTurn,
    /// `x`: place in the room, over 1 m.
    X,
    /// `y`: place in the room, over 1 m.
    Y,
    /// A covariate of the run, by its own name, less its mean and over its standard deviation. A run that
    /// does not say it has none of it: no payload is a payload of 0.
    OfRun {
        /// Its name in the run's record.
        key: String,
        /// Mean over the runs.
        mean: f64,
        /// Standard deviation over the runs.
        sd: f64,
    },
}

/// Most cycles of a wheel's phase in one turn.
const MAX_CYCLES: u8 = 24;

/// How often a wheel's angle is taken, in words.
fn turned(side: Side, cycles: u8) -> String {
    let wheel = if side == Side::Left { "left wheel" } else { "right wheel" };
    if cycles == 1 { wheel.to_owned() } else { format!("{cycles} {wheel}") }
}

impl Covariate {
    /// Those that have a name of their own: all but [`Self::OfRun`] and phases of several cycles.
    pub const NAMED: [Self; 27] = [
        Self::Speed,
        Self::AbsSpeed,
        Self::YawRate,
        Self::AbsYawRate,
        Self::Acceleration,
        Self::YawAcceleration,
        Self::WheelSpeed,
        Self::AbsWheelSpeed,
        Self::WheelSense,
        Self::WheelAcceleration,
        Self::SlowWheel,
        Self::WheelSinceReversal,
        Self::RowLength,
        Self::CosHeading,
        Self::SinHeading,
        Self::CosPhase(Side::Left, 1),
        Self::CosPhase(Side::Right, 1),
        Self::SinPhase(Side::Left, 1),
        Self::SinPhase(Side::Right, 1),
        Self::RunTime,
        Self::SessionTime,
        Self::Way,
        Self::SinceReversal,
        Self::Curvature,
        Self::LastTurn,
        Self::X,
        Self::Y,
    ];

    /// Its name in findings and scenarios.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Speed => "v",
            Self::AbsSpeed => "|v|",
            Self::YawRate => "omega",
            Self::AbsYawRate => "|omega|",
            Self::Acceleration => "acceleration",
            Self::YawAcceleration => "yaw_acceleration",
            Self::WheelSpeed => "wheel v",
            Self::AbsWheelSpeed => "|wheel v|",
            Self::WheelSense => "wheel sense",
            Self::WheelAcceleration => "wheel acceleration",
            Self::SlowWheel => "exp(-|wheel v| / 0.05 m/s)",
            Self::WheelSinceReversal => "exp(-wheel distance since reversal / 2 mm)",
            Self::RowLength => "row length",
            Self::CosHeading => "cos(theta)",
            Self::SinHeading => "sin(theta)",
            Self::CosPhase(side, cycles) => return format!("v cos({})", turned(*side, *cycles)),
            Self::SinPhase(side, cycles) => return format!("v sin({})", turned(*side, *cycles)),
            Self::RunTime => "time in run",
            Self::SessionTime => "session time",
            Self::Way => "distance driven",
            Self::SinceReversal => "exp(-distance since reversal / 0.1 m)",
            Self::Curvature => "bend",
            Self::LastTurn => "last turn",
            Self::X => "x",
            Self::Y => "y",
            Self::OfRun { key, .. } => return key.clone(),
        }
        .to_owned()
    }

    /// The covariate of a name; `None` where it is none of [`Self::NAMED`], nor a wheel's phase with up to 24
    /// cycles a turn.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let of = |cycles| {
            Side::BOTH.into_iter().flat_map(move |side| [Self::CosPhase(side, cycles), Self::SinPhase(side, cycles)])
        };
        Self::NAMED.into_iter().chain((2..=MAX_CYCLES).flat_map(of)).find(|covariate| covariate.name() == name)
    }

    /// The covariate of a run whose values over the runs are these, 0 for one that does not say it; `None`
    /// where they do not differ.
    #[must_use]
    pub fn of_run(key: &str, values: &[f64]) -> Option<Self> {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let sd = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
        (sd > 1e-9 * mean.abs().max(1e-9)).then(|| Self::OfRun { key: key.to_owned(), mean, sd })
    }

    /// Is it 0 whenever the robot stands?
    #[must_use]
    pub const fn vanishes_at_rest(&self) -> bool {
        matches!(
            self,
            Self::Speed
                | Self::AbsSpeed
                | Self::YawRate
                | Self::AbsYawRate
                | Self::Acceleration
                | Self::YawAcceleration
                | Self::CosPhase(..)
                | Self::SinPhase(..)
                | Self::WheelSpeed
                | Self::AbsWheelSpeed
                | Self::WheelSense
                | Self::WheelAcceleration
        )
    }

    /// Is it what the wheel does whose way it is about? Channels of wheels have it alone.
    #[must_use]
    pub const fn is_of_a_wheel(&self) -> bool {
        matches!(
            self,
            Self::WheelSpeed
                | Self::AbsWheelSpeed
                | Self::WheelSense
                | Self::WheelAcceleration
                | Self::SlowWheel
                | Self::WheelSinceReversal
        )
    }

    /// Is it of the log's rows, and not of the robot? It goes with the speed of both wheels alone: a stamp
    /// that is off.
    #[must_use]
    pub const fn is_of_rows(&self) -> bool {
        matches!(self, Self::RowLength)
    }

    /// Is it known of a measurement: of the robot's twist and heading then, and of the time?
    #[must_use]
    pub const fn is_of_a_measurement(&self) -> bool {
        matches!(self, Self::CosHeading | Self::SinHeading | Self::RunTime) || self.is_a_speed()
    }

    /// Is it v or ω, with or without its sign?
    pub(crate) const fn is_a_speed(&self) -> bool {
        matches!(self, Self::Speed | Self::AbsSpeed | Self::YawRate | Self::AbsYawRate)
    }

    /// How many times as large as others a product with it may be, as it has faded soon: after a reversal 20
    /// mm or 20 mrad of the robot in all, and all of a wheel's travel.
    pub(crate) const fn fades(&self) -> f64 {
        match self {
            Self::SinceReversal => 10.0,
            Self::WheelSinceReversal => 50.0,
            _ => 1.0,
        }
    }

    /// Its value at a moment.
    pub(crate) fn value(&self, at: &KinematicSample<'_>) -> f64 {
        match self {
            Self::Speed => at.v_m_s,
            Self::AbsSpeed => at.v_m_s.abs(),
            Self::YawRate => at.omega_rad_s,
            Self::AbsYawRate => at.omega_rad_s.abs(),
            Self::Acceleration => at.acceleration_m_s2,
            Self::YawAcceleration => at.yaw_acceleration_rad_s2,
            Self::WheelSpeed => at.own_m_s,
            Self::AbsWheelSpeed => at.own_m_s.abs(),
            Self::WheelSense if at.own_m_s == 0.0 => 0.0,
            Self::WheelSense => at.own_m_s.signum(),
            Self::WheelAcceleration => at.own_m_s2,
            Self::SlowWheel => (-at.own_m_s.abs() / 0.05).exp(),
            Self::WheelSinceReversal => mean_left(at.own_since_reversal_m),
            // Of the log's rows, which no moment knows: a term of it is [`crate::IntervalError`]'s.
            Self::RowLength => 0.0,
            Self::CosHeading => at.heading_rad.cos(),
            Self::SinHeading => at.heading_rad.sin(),
            Self::CosPhase(side, cycles) => at.of_cycle(*side, *cycles).1,
            Self::SinPhase(side, cycles) => at.of_cycle(*side, *cycles).0,
            Self::RunTime => at.run_s / 60.0,
            Self::SessionTime => at.session_s / 600.0,
            Self::Way => at.session_m / 100.0,
            Self::SinceReversal => (-at.since_reversal_m / CASTOR_DECAY_M).exp(),
            Self::Curvature if at.omega_rad_s == 0.0 => 0.0,
            Self::Curvature => at.omega_rad_s / at.omega_rad_s.hypot(at.v_m_s / CURVATURE_RADIUS_M),
            Self::LastTurn => at.last_turn,
            Self::X => at.x_m,
            Self::Y => at.y_m,
            Self::OfRun { key, mean, sd } => (at.of_run.get(key).copied().unwrap_or(0.0) - mean) / sd,
        }
    }
}

/// Radius at which a bend is half-way, in the square, between straight on and on the spot, metres.
const CURVATURE_RADIUS_M: f64 = 0.2;

/// Way of the robot since its reversal over which 1/e is left, metres: that of castors.
const CASTOR_DECAY_M: f64 = 0.1;
/// Way of a wheel since its reversal over which 1/e is left, metres: that of teeth, keys and tyres.
const WHEEL_FADES_M: f64 = 2e-3;

/// What is left of 1 on average between two distances since a reversal.
fn mean_left([from_m, to_m]: [f64; 2]) -> f64 {
    let left = |distance_m: f64| (-distance_m / WHEEL_FADES_M).exp();
    let over = (to_m - from_m) / WHEEL_FADES_M;
    // Infinite before the first.
    if over > 0.0 { (left(from_m) - left(to_m)) / over } else { left(to_m) }
}

/// What covariates are made of.
#[derive(Clone, Copy)]
pub(crate) struct KinematicSample<'r> {
    pub(crate) v_m_s: f64,
    pub(crate) omega_rad_s: f64,
    pub(crate) acceleration_m_s2: f64,
    pub(crate) yaw_acceleration_rad_s2: f64,
    pub(crate) heading_rad: f64,
    pub(crate) wheel_m_s: Wheels<f64>,
    pub(crate) wheel_m_s2: Wheels<f64>,
    /// In the middle of the interval.
    pub(crate) wheel_rad: Wheels<f64>,
    /// Turned in all of it.
    pub(crate) turned_rad: Wheels<f64>,
    /// Of the wheel in question.
    pub(crate) own_m_s: f64,
    pub(crate) own_m_s2: f64,
    pub(crate) own_since_reversal_m: [f64; 2],
    pub(crate) run_s: f64,
    pub(crate) session_s: f64,
    pub(crate) session_m: f64,
    pub(crate) since_reversal_m: f64,
    /// Of each wheel, where the interval begins and where it ends.
    pub(crate) wheel_since_reversal_m: Wheels<[f64; 2]>,
    /// Sense of the last turn, 0 before any.
    pub(crate) last_turn: f64,
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) of_run: &'r BTreeMap<String, f64>,
}

impl KinematicSample<'_> {
    pub(crate) const fn twist(&self) -> Twist {
        Twist { v_m_s: self.v_m_s, omega_rad_s: self.omega_rad_s }
    }

    /// A wheel's speed times the mean over the interval of a sine, and of a cosine, that comes back so many
    /// times a turn.
    pub(crate) fn of_cycle(&self, side: Side, cycles: u8) -> (f64, f64) {
        let cycles = f64::from(cycles);
        let (sin, cos) = sin_cos(cycles * self.wheel_rad[side]);
        let (speed_m_s, mean) = (self.wheel_m_s[side], sinc(0.5 * cycles * self.turned_rad[side]));
        (speed_m_s * sin * mean, speed_m_s * cos * mean)
    }

    /// The same for what a wheel does itself.
    pub(crate) fn of_wheel(&self, side: Side) -> Self {
        Self {
            own_m_s: self.wheel_m_s[side],
            own_m_s2: self.wheel_m_s2[side],
            own_since_reversal_m: self.wheel_since_reversal_m[side],
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_what_they_name() {
        for covariate in Covariate::NAMED {
            assert_eq!(Covariate::named(&covariate.name()), Some(covariate));
        }
        let of_five = Covariate::SinPhase(Side::Right, 5);
        assert_eq!(
            (of_five.name().as_str(), Covariate::named("v sin(5 right wheel)")),
            ("v sin(5 right wheel)", Some(of_five.clone()))
        );
        assert_eq!(Covariate::named("v sin(25 right wheel)"), None);
        assert_eq!(Covariate::named("speed"), None);
    }

    #[test]
    fn every_covariate_is_what_the_document_says_over_its_size() {
        let load = BTreeMap::from([("load".to_owned(), 7.0)]);
        let at = KinematicSample {
            v_m_s: -0.3,
            omega_rad_s: -0.7,
            acceleration_m_s2: 0.2,
            yaw_acceleration_rad_s2: 0.9,
            heading_rad: 0.5,
            wheel_m_s: Wheels { left: 0.4, right: -0.6 },
            wheel_m_s2: Wheels { left: 0.0, right: 0.8 },
            wheel_rad: Wheels { left: 1.1, right: 2.3 },
            turned_rad: Wheels { left: 0.4, right: 0.6 },
            own_m_s: 0.0,
            own_m_s2: 0.0,
            own_since_reversal_m: [f64::INFINITY; 2],
            run_s: 30.0,
            session_s: 900.0,
            session_m: 25.0,
            since_reversal_m: 0.2,
            wheel_since_reversal_m: Wheels { left: [f64::INFINITY; 2], right: [0.001, 0.004] },
            last_turn: -1.0,
            x_m: 1.5,
            y_m: -2.5,
            of_run: &load,
        }
        .of_wheel(Side::Right);
        let (cos, sin) = (f64::cos, f64::sin);
        let expected = [
            -0.3,
            0.3,
            -0.7,
            0.7,
            0.2,
            0.9,
            -0.6,
            0.6,
            -1.0,
            0.8,
            f64::exp(-12.0),
            (f64::exp(-0.5) - f64::exp(-2.0)) / 1.5,
            0.0,
            cos(0.5),
            sin(0.5),
            0.4 * cos(1.1) * sin(0.2) / 0.2,
            -0.6 * cos(2.3) * sin(0.3) / 0.3,
            0.4 * sin(1.1) * sin(0.2) / 0.2,
            -0.6 * sin(2.3) * sin(0.3) / 0.3,
            0.5,
            1.5,
            0.25,
            f64::exp(-2.0),
            -0.7 / f64::hypot(0.7, 1.5),
            -1.0,
            1.5,
            -2.5,
        ];
        for (covariate, expected) in Covariate::NAMED.into_iter().zip(expected) {
            // 0.2 / 0.1 rounds.
            assert!((covariate.value(&at) - expected).abs() < 1e-15, "{covariate:?}: {}", covariate.value(&at));
        }
        let of_run = |key: &str| Covariate::OfRun { key: key.to_owned(), mean: 3.0, sd: 2.0 }.value(&at);
        assert_eq!((of_run("load"), of_run("payload_kg")), (2.0, -1.5));
    }

    #[test]
    fn a_covariate_of_runs_is_normalised_by_their_values() {
        let Some(Covariate::OfRun { key, mean, sd }) = Covariate::of_run("load", &[1.0, 5.0]) else {
            panic!("they differ")
        };
        assert_eq!((key.as_str(), mean, sd), ("load", 3.0, 2.0));
        assert_eq!(Covariate::of_run("load", &[5.0, 5.0]), None);
        assert_eq!(Covariate::of_run("load", &[]), None);
    }
}
