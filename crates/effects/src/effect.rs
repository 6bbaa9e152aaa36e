//! What every effect of the catalogue offers.

use kinematics::DriveGeometry;

use crate::benchmark::{HostRobot, ParameterValue};
use crate::description::Description;
use crate::forward::Forward;
use crate::hypothesis::Hypothesis;

/// Why the sizes of an effect make no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EffectError {
    /// A parameter is outside its physical range.
    #[error("effect {id}: {parameter} is {value}; it must be {must_be}")]
    OutOfRange {
        /// The effect.
        id: &'static str,
        /// The parameter, with its unit suffix.
        parameter: &'static str,
        /// The offending value.
        value: f64,
        /// The range.
        must_be: &'static str,
    },
    /// The parts of a term outside of the catalogue make none.
    #[error("effect term: {problem}")]
    NoTerm {
        /// What is wrong with it, and what is known.
        problem: String,
    },
}

impl EffectError {
    /// An error unless `holds`.
    pub(crate) fn unless(
        holds: bool,
        id: &'static str,
        parameter: &'static str,
        value: f64,
        must_be: &'static str,
    ) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self::OutOfRange { id, parameter, value, must_be }) }
    }

    /// An error unless every value is finite.
    pub(crate) fn unless_finite<const N: usize>(
        id: &'static str,
        values: [(&'static str, f64); N],
    ) -> Result<(), Self> {
        values.into_iter().try_for_each(|(name, value)| Self::unless(value.is_finite(), id, name, value, "finite"))
    }

    /// An error unless every value is finite and 0 or more.
    pub(crate) fn unless_negative<const N: usize>(
        id: &'static str,
        values: [(&'static str, f64); N],
    ) -> Result<(), Self> {
        let holds = |value: f64| value.is_finite() && value >= 0.0;
        values.into_iter().try_for_each(|(name, value)| Self::unless(holds(value), id, name, value, "0 or more"))
    }

    /// An error unless every value is finite and positive.
    pub(crate) fn unless_positive<const N: usize>(
        id: &'static str,
        values: [(&'static str, f64); N],
    ) -> Result<(), Self> {
        let holds = |value: f64| value.is_finite() && value > 0.0;
        values.into_iter().try_for_each(|(name, value)| Self::unless(holds(value), id, name, value, "positive"))
    }
}

/// An effect with its sizes: what a file of the catalogue implements. Sizes are fields in SI units, with the
/// unit at the end of the name.
pub trait PhysicalEffect {
    /// Checks that the sizes are physical.
    ///
    /// # Errors
    /// [`EffectError`] names the parameter and its range.
    fn check(&self) -> Result<(), EffectError>;

    /// What the effect makes of the drive's geometry for good. Only the geometry effects, which every
    /// calibration fits, answer here.
    fn true_geometry(&self, geometry: DriveGeometry) -> DriveGeometry {
        geometry
    }

    /// Standard deviation of the wheel separation from motion to motion, metres; what a bound on calibration
    /// takes a motion's scatter from. `Err` says why the scatter is none that is drawn once a motion.
    ///
    /// # Errors
    /// The reason, for people.
    fn wheel_separation_sigma_m(&self) -> Result<f64, &'static str> {
        Ok(0.0)
    }

    /// Standard deviation of where a contact is that the effect's mean cannot be without, metres: where
    /// measurements scatter far less, it is another effect.
    fn scatter_of_contact_m(&self) -> f64 {
        0.0
    }

    /// The simulation model: the effect's state during one run, or `None` when all it does is in
    /// [`Self::true_geometry`].
    fn forward(&self) -> Option<Box<dyn Forward>> {
        None
    }

    /// The estimation model: how recorded data would show the effect, of whatever size.
    fn hypothesis() -> Hypothesis
    where
        Self: Sized;

    /// What is known of the effect beside its two models.
    fn description() -> Description
    where
        Self: Sized;

    /// The effect with the sizes that a fit of its hypothesis found, by name, or `None` when they do not make
    /// one.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self>
    where
        Self: Sized,
    {
        let _ = values;
        None
    }

    /// The sizes as a fit of the hypothesis names them, where they have other names there: the inverse of
    /// [`Self::from_estimates`].
    fn estimates(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// Whether only records can show it whose motions go by the lengths of the log's rows: displacements that
    /// are measured row by row.
    fn needs_row_lengths(&self) -> bool {
        false
    }

    /// Whether only records can show it that have distances from elsewhere than the instrument's map.
    fn needs_distances(&self) -> bool {
        false
    }

    /// The effect of sizes that the blind benchmark drew, in force at a scale in a robot, where that is
    /// another than [`Self::from_estimates`] makes of them.
    fn at_scale(values: &[ParameterValue], scale: f64, robot: &HostRobot) -> Option<Self>
    where
        Self: Sized,
    {
        let _ = (scale, robot);
        Self::from_estimates(values)
    }

    /// The effect without any harm, for records that have what it needs though it is not hidden: so such
    /// records tell nothing.
    fn harmless(robot: &HostRobot) -> Option<Self>
    where
        Self: Sized,
    {
        let _ = robot;
        None
    }
}
