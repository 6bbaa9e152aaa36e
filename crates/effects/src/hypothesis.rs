//! The estimation model: how recorded data would show an effect.
//!
//! Most effects add to the mean of a motion or of what the instrument sees, linearly in their sizes
//! ([`Hypothesis::Terms`]); what is not linear, a hinge speed or a decay length, is one of a few shapes.
//! Gross faults rewrite the records ([`Hypothesis::Records`]). What only scatters has no mean: the checks of
//! a fit show it ([`Hypothesis::Scatter`]).

use dataset::{Dataset, NominalRobot, Run, WheelLog};
use kinematics::{Pose, Twist, Wheels, sin_cos};
use model_term::{Interval, ModelTerm};

/// How data would show an effect: the estimation model. It sees recorded quantities, and nothing of the
/// simulation model's state.
pub enum Hypothesis {
    /// The three geometry parameters of the drive, which every calibration fits.
    Geometry,
    /// A mean term; several where a shape parameter is to be tried at several values, which then pay for
    /// their trials.
    Terms(Vec<Variant>),
    /// The records as they would be without the fault, one for each form that it takes; `None` where the
    /// fault is impossible in these records.
    Records(fn(&Dataset) -> Vec<RecordCorrection>),
    /// It scatters: it shows in these checks of a fit and in no mean.
    Scatter(&'static [Sign]),
    /// Both: a mean, and a variance beside it.
    TermsAndScatter(Vec<Variant>, &'static [Sign]),
    /// It leaves open how the robot moved between some measurements: sought before any fit, as motion that no
    /// wheel makes.
    UnknownMotion {
        /// The robot did not move at all: its instrument did.
        is_of_instrument: bool,
    },
    /// Innocent, or not told from data alone.
    Silent,
}

/// A mean term with its shape parameters held.
pub struct Variant {
    /// What is held, by the name in the effect's simulation model where that has it.
    pub fixed: Vec<(&'static str, f64)>,
    /// The term.
    pub term: Box<dyn ModelTerm>,
    /// The term at any other value of what is held, where that is one continuous number.
    pub at: Option<fn(f64) -> Box<dyn ModelTerm>>,
}

impl Hypothesis {
    /// Its mean terms, if it has any.
    #[must_use]
    pub fn into_variants(self) -> Option<Vec<Variant>> {
        match self {
            Self::Terms(variants) | Self::TermsAndScatter(variants, _) => Some(variants),
            _ => None,
        }
    }

    /// Its signs in the checks of a fit.
    #[must_use]
    pub const fn signs(&self) -> &'static [Sign] {
        match self {
            Self::Scatter(signs) | Self::TermsAndScatter(_, signs) => signs,
            _ => &[],
        }
    }
}

impl Variant {
    /// A term without shape parameters.
    #[must_use]
    pub fn plain(term: impl ModelTerm + 'static) -> Vec<Self> {
        vec![Self { fixed: Vec::new(), term: Box::new(term), at: None }]
    }

    /// A term at each of several values of one shape parameter, which is a number of things.
    #[must_use]
    pub fn over<T: ModelTerm + 'static>(name: &'static str, values: &[f64], term: impl Fn(f64) -> T) -> Vec<Self> {
        values.iter().map(|&value| Self { fixed: vec![(name, value)], term: Box::new(term(value)), at: None }).collect()
    }

    /// A term at each of several values of one positive shape parameter, between which it may be anything.
    #[must_use]
    pub fn along(name: &'static str, values: &[f64], at: fn(f64) -> Box<dyn ModelTerm>) -> Vec<Self> {
        values.iter().map(|&value| Self { fixed: vec![(name, value)], term: at(value), at: Some(at) }).collect()
    }
}

/// Records without a fault.
pub struct RecordCorrection {
    /// The parameters of the fault that it undoes: names and values.
    pub values: Vec<(&'static str, f64)>,
    /// What the fault was, for people: "the left and the right counter are swapped".
    pub sentence: String,
    /// Whether the log itself shows the fault, whatever an instrument saw.
    pub visible_in_log: bool,
    /// Separate mistakes that it takes, such as one for each wheel that is wired the wrong way round.
    pub mistakes: u32,
    /// The records as they would be without it.
    pub records: Dataset,
}

/// A size by its name.
pub(crate) fn value_of(values: &[(&str, f64)], name: &str) -> Option<f64> {
    values.iter().find(|(of, _)| *of == name).map(|(_, value)| *value)
}

/// A motion in the room, metres along its axes, along and across the middle of an interval.
pub(crate) fn in_room(interval: &Interval<'_>, [x_m, y_m]: [f64; 2]) -> Pose {
    let (sin, cos) = sin_cos(interval.world_from_body.theta_rad + 0.5 * interval.increment().turn_rad);
    Pose::new(cos * x_m + sin * y_m, cos * y_m - sin * x_m, 0.0)
}

/// Sine and cosine of an angle at which an interval ends and the next begins: found once for both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LastAngle {
    rad: f64,
    sin_cos: (f64, f64),
}

impl LastAngle {
    pub(crate) const NONE: Self = Self { rad: 0.0, sin_cos: (0.0, 1.0) };

    /// Those of this angle, which is the last one from now on.
    #[inline]
    pub(crate) fn sin_cos(&mut self, rad: f64) -> (f64, f64) {
        if rad != self.rad {
            *self = Self { rad, sin_cos: sin_cos(rad) };
        }
        self.sin_cos
    }
}

/// Every run of a dataset with its wheels' record changed.
///
/// `columns` takes both wheels' cumulative counts or angles of a run, `twist` the twist of a row where that
/// is all that a robot reports.
pub(crate) fn rewrite_wheels(
    dataset: &Dataset,
    mut columns: impl FnMut(&mut WheelLog),
    twist: impl Fn(Twist) -> Twist,
) -> Dataset {
    let mut records = dataset.clone();
    for Run { odometry, .. } in &mut records.runs {
        if let WheelLog::Twist { v_mps, omega_radps } = &mut odometry.wheels {
            for (v_m_s, omega_rad_s) in v_mps.iter_mut().zip(omega_radps) {
                let turned = twist(Twist { v_m_s: *v_m_s, omega_rad_s: *omega_rad_s });
                (*v_m_s, *omega_rad_s) = (turned.v_m_s, turned.omega_rad_s);
            }
        } else {
            columns(&mut odometry.wheels);
        }
    }
    records
}

/// A twist whose wheels, by the nominal drive, turn otherwise; the twist itself where the drive is not
/// physical.
pub(crate) fn by_wheels(robot: &NominalRobot, twist: Twist, change: impl Fn(Wheels<f64>) -> Wheels<f64>) -> Twist {
    robot.geometry().map_or(twist, |geometry| geometry.twist(change(geometry.wheel_speed_m_s(twist))))
}

/// The middle of the first `N` of some values, without memory of their own; `None` of none.
pub(crate) fn median_of_few<const N: usize>(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut few, mut count) = ([0.0; N], 0);
    for (place, value) in few.iter_mut().zip(values) {
        *place = value;
        count += 1;
    }
    let few = &mut few[..count];
    few.sort_unstable_by(f64::total_cmp);
    let (low, high) = (few.get(count.checked_sub(1)? / 2)?, few.get(count / 2)?);
    Some(0.5 * (low + high))
}

/// What a scatter does to a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Single measurements of the instrument that lie far off and come back in the next.
    IsolatedErrors,
    /// Jumps of the heading that stay.
    HeadingJumps,
    /// Persistent jumps of the travelled distance.
    DistanceJumps,
    /// Measurements whose errors resemble those of the measurements before.
    AutocorrelatedErrors,
    /// A heading that scatters in proportion to the turn, manoeuvre by manoeuvre.
    ScatterWithTurn,
    /// Errors that grow with the speed at the instant of a measurement.
    ScatterWithSpeed,
    /// Errors of measurements of a creeping robot, and of none of a fast one.
    TailsAtLowSpeed,
}
