//! What carries over to other sessions and kinds of path.

/// Standard deviations. A unit is asked where the others determine the size so well.
/// Convention: three standard deviations.
pub(crate) const MIN_SIGMAS_OF_OTHERS: f64 = 3.0;

/// Standard deviations. Half of the others' size over the standard deviation of the contrast: a unit is asked
/// where it would show that size.
/// Derived: Φ⁻¹(0.95) + Φ⁻¹(0.9), power 0.9 at a one-sided level of 5 %.
pub(crate) const MIN_POWER_SIGMAS: f64 = 2.93;

/// Number. Testable units that must agree.
/// Convention: one unit agrees with anything.
pub(crate) const MIN_TESTABLE_UNITS: usize = 2;

/// Standard deviations. A unit supports a term where its contrast is above nothing by more.
/// Derived: Φ⁻¹(0.95), one-sided.
pub(crate) const SUPPORTED_SIGMAS: f64 = 1.645;

/// Probability. Family-wise level at which one of the units refutes a term.
/// Convention: 5 %, one-sided.
pub(crate) const REFUTED_LEVEL: f64 = 0.05;

/// Ratio. A run spins where its wheels travel so much farther against each other than along.
/// Convention: four times.
pub(crate) const MIN_SPIN_TURN_RATIO: f64 = 4.0;

/// Ratio. A run is straight where its wheels travel less against each other, over what they travel along.
/// Convention: a tenth of a radian on a path as long as the wheelbase.
pub(crate) const MAX_STRAIGHT_TURN_RATIO: f64 = 0.05;

/// Fraction of all turns, left or right, that a circle turns one way.
/// Convention: nine tenths.
pub(crate) const ONE_SENSE_SHARE: f64 = 0.9;

/// Ratio. Standard deviation of a circle's curvature along its path over the mean.
/// Convention: a half; a square with corners on the spot has several times its mean.
pub(crate) const CONSTANT_CURVATURE_SPREAD: f64 = 0.5;

/// Probability. A term stays open where a new unit has less than half of its size more probably.
/// Convention: 5 %.
pub(crate) const MAX_LESS_THAN_HALF: f64 = 0.05;

/// Probability. Level of Cochran's Q at which units are taken to differ.
/// Convention: 10 %, as its power is low with few units (Higgins and Thompson 2002).
pub(crate) const HETEROGENEITY_LEVEL: f64 = 0.1;

/// Probability. Where no other session or kind of path was driven, a term is in the extended model whose
/// cause is so probable.
/// Derived: more likely than all others together.
pub(crate) const MIN_ESTABLISHED_PROBABILITY: f64 = 0.5;
