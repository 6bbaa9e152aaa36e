//! The beam of models for experiments on their comparison.

/// Number by size of the model. Models that are extended: the one without effects, with one, with two.
/// Budgeted: three seconds a log.
pub(crate) const MODELS_EXTENDED: [usize; 3] = [1, 4, 3];

/// Number by size of the model. Effects that are added to each of these and refitted, the likeliest first.
/// Budgeted: three seconds a log.
pub(crate) const REFITTED_BESIDE: [usize; 3] = [12, 5, 4];

/// Number by size of the model, from one effect on. Models that are likelier than none and whose continuous
/// variants are fitted.
/// Budgeted: three seconds a log.
pub(crate) const MODELS_PROFILED: [usize; 3] = [3, 2, 0];

/// Relative. Another variant that is refitted explains at least this share of what the best one does.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_OTHER_VARIANT_RATIO: f64 = 0.8;

/// Number. Further variants of an effect that are refitted.
/// Budgeted: three seconds a log.
pub(crate) const MAX_OTHER_VARIANTS: usize = 2;
