//! The beam of models for experiments on their comparison.

rules::settings! {
    Beam
    /// Number by size of the model. Models that are extended: the one without effects, with one, with two.
    /// Budgeted: five seconds a log.
    models_extended: [usize; 3] = [1, 4, 3],
    /// Number by size of the model. Effects that are added to each of these and refitted, the likeliest
    /// first.
    /// Budgeted: five seconds a log.
    refitted_beside: [usize; 3] = [12, 5, 4],
    /// Number by size of the model, from one effect on. Models that are likelier than none and whose
    /// continuous variants are fitted.
    /// Budgeted: five seconds a log.
    models_profiled: [usize; 3] = [3, 2, 0],
    /// Relative. Another variant that is refitted explains at least this share of what the best one does.
    /// Budgeted: five seconds a log.
    min_other_variant_ratio: f64 = 0.8,
    /// Number. Further variants of an effect that are refitted.
    /// Budgeted: five seconds a log.
    max_other_variants: usize = 2,
}
