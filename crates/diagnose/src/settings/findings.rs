//! Findings and the doubts on them; the extended scenario.

/// Probability. A finding that looks like a catalogued effect has an uncatalogued cause.
/// Tuned: on the blind benchmark.
pub(crate) const UNCATALOGUED_PRIOR: f64 = 0.05;

/// Ratio of z. A finding weaker than an uncatalogued or noise finding by this may be part of it.
/// Tuned: by hand; no record of what on.
pub(crate) const PART_OF_STRONGER_RATIO: f64 = 3.0;

/// Ratio. Widens the ratio above where as many effects were found as are sought.
/// Tuned: by hand; no record of what on.
pub(crate) const PART_OF_STRONGER_RATIO_IF_FULL: f64 = 3.0;

/// Probability. Level at which a sparse term beside the effects found says that they are incomplete.
/// Convention: 5 %.
pub(crate) const LACK_OF_FIT_LEVEL: f64 = 0.05;

/// Odds. None of the causes of a finding of low significance is right; of other findings forty-nine of fifty
/// hold the right one.
/// Tuned: on the blind benchmark.
pub(crate) const NONE_OF_CAUSES_ODDS: f64 = 3.0 / 7.0;

/// Probability. Level of dependence on something recorded that no noise effect explains.
/// Tuned: by hand; no record of what on.
pub(crate) const DEPENDENCE_BEYOND_NOISE_LEVEL: f64 = 1e-8;

/// Counts per revolution. Least resolution of the encoder on which the simulated controller regulates.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_CONTROLLER_COUNTS: f64 = 40_000.0;

/// Seconds. Measurements farther apart, in a run of a few, are readings of the standing robot.
/// Tuned: by hand; no record of what on.
pub(crate) const STANDING_READING_INTERVAL_S: f64 = 2.0;

/// Number. So many events of one kind are shown with their times and sizes; the rest are counted.
/// Convention: three.
pub(crate) const MAX_EVENTS_SHOWN: usize = 3;
