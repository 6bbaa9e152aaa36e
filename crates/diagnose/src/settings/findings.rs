//! Findings and the doubts on them; the extended scenario.

rules::settings! {
    Findings
    /// Probability. A finding that looks like a catalogued effect has an uncatalogued cause.
    /// Tuned: on the blind benchmark.
    uncatalogued_prior: f64 = 0.05,
    /// Ratio of z. A finding weaker than an uncatalogued or noise finding by this may be part of it.
    /// Tuned: by hand; no record of what on.
    part_of_stronger_ratio: f64 = 3.0,
    /// Ratio. Widens the ratio above where as many effects were found as are sought.
    /// Tuned: by hand; no record of what on.
    part_of_stronger_ratio_if_full: f64 = 3.0,
    /// Probability. Level at which a sparse term beside the effects found says that they are incomplete.
    /// Convention: 5 %.
    lack_of_fit_level: f64 = 0.05,
    /// Odds. None of the causes of a finding of low significance is right; of other findings forty-nine of
    /// fifty hold the right one.
    /// Tuned: on the blind benchmark.
    none_of_causes_odds: f64 = 3.0 / 7.0,
    /// Probability. Level of dependence on something recorded that no noise effect explains.
    /// Tuned: by hand; no record of what on.
    dependence_beyond_noise_level: f64 = 1e-8,
    /// Counts per revolution. Least resolution of the encoder on which the simulated controller regulates.
    /// Tuned: by hand; no record of what on.
    min_controller_counts: f64 = 40_000.0,
    /// Seconds. Measurements farther apart, in a run of a few, are readings of the standing robot.
    /// Tuned: by hand; no record of what on.
    standing_reading_interval_s: f64 = 2.0,
    /// Number. So many events of one kind are shown with their times and sizes; the rest are counted.
    /// Convention: three.
    max_events_shown: usize = 3,
}
