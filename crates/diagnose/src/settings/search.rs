//! The search of the mean model: scan, rivals, refits, profiles, sparse terms, held-out runs.

rules::settings! {
    Search
    /// Correlation coefficient at lag one. Smaller ones count as white, however significant.
    /// Tuned: by hand; no record of what on.
    min_autocorrelation: f64 = 0.05,
    /// Standard errors. Less significant autocorrelation counts as white.
    /// Tuned: by hand; no record of what on.
    autocorrelation_sigmas: f64 = 4.0,
    /// Measurements in a part of many runs that says whether all have to be thinned.
    /// Budgeted: a part costs an eighth of a search among the 133,000 measurements of 102 runs; its
    /// autocorrelation is certain to a hundredth (1/√16384).
    measurements_of_part: f64 = 16_384.0,
    /// Share of all measurements. A larger part saves little where it says that measurements have to be
    /// thinned, and costs its share where not.
    /// Budgeted: a third more time at the most.
    max_share_of_part: f64 = 1.0 / 3.0,
    /// Runs of a part. Fewer do not have all kinds of paths, nor do intervals over runs hold.
    /// Tuned: by hand; sandwich intervals are asked of six runs.
    min_runs_of_part: f64 = 6.0,
    /// Probability. Family-wise false-positive rate of the scan where residuals depend on something recorded.
    /// Tuned: by hand; no record of what on.
    scan_level_if_dependent: f64 = 0.2,
    /// Standard deviations. A direction is tested if a plausible effect along it is at least so significant.
    /// Tuned: by hand; no record of what on.
    min_detectable_sigmas: f64 = 1.0,
    /// Fraction of a column's information that is left beside the free columns. Smaller shares are rounding.
    /// Tuned: by hand; no record of what on.
    min_column_share: f64 = 1e-9,
    /// Number. Scales of the prior of sizes, each half of the one before: down to a thousandth of what is
    /// plausible.
    /// Derived: 2⁻¹⁰ is a thousandth.
    prior_scales: i32 = 11,
    /// Columns. Largest number of candidates' columns in one pass: a whole number of products on three
    /// channels.
    /// Tuned: by hand, on the time of a diagnosis.
    max_columns_per_pass: usize = 126,
    /// Seconds. Rows of a faster log are taken together in scans.
    /// Tuned: by hand, on an hour of 100 Hz: z of 25 of 27 candidates stays within 0.06 of that by single
    /// rows.
    decimation_step_s: f64 = 0.1,
    /// Natural logarithm per component. Cost of a component of a rejected measurement beside its variance.
    /// Derived: half of the outlier gate's χ² of three degrees of freedom, over its three components.
    outlier_cost: f64 = 0.5 * 25.9 / 3.0,
    /// Number. Refits of candidates that go on at a time.
    /// Budgeted: one needs 150 bytes a measurement beside what all share, and two occupy the cores where runs
    /// are few.
    max_fits_at_a_time: usize = 2,
    /// Fraction of the measurements that the fit before took. A refit that takes fewer has diverged.
    /// Tuned: by hand; no record of what on.
    min_taken_fraction: f64 = 0.5,
    /// Number. Candidates that are tried for the next effect where the best is not confirmed.
    /// Tuned: by hand; no record of what on.
    max_candidates_tried: usize = 3,
    /// Probability. Where no score is significant among all, candidates are refitted whose own is so far.
    /// Budgeted: one in four logs without an effect has one.
    refitted_level: f64 = 0.01,
    /// Number. Halvings that find which share a regression explains.
    /// Derived: 2⁻³⁰ is 1e-9.
    share_bisections: u32 = 30,
    /// Number. So many of these are refitted at the most.
    /// Budgeted: a refit costs as much as a scan, and causes that are alike have the same ratio.
    max_refitted_by_score: usize = 3,
    /// Share of the motion in a term's information, the rest being the rounding of counts in the rates that
    /// it goes by, below which the encoders do not resolve it.
    /// Budgeted: below it a size is nearer to nothing than to the truth. At 0.9 drifting clocks and delays
    /// that large logs show well are lost to coarse encoders, and what is not in the catalogue comes in their
    /// place.
    min_reliability: f64 = 0.5,
    /// Half-widths of the 95 % interval. An effect is refused if odometry drifts more with it by more; at one
    /// half-width an effect that leaves the drift alone would be refused once in forty times.
    /// Tuned: by hand; no record of what on.
    max_drift_increase_intervals: f64 = 2.0,
    /// Ratio of χ². Effects of which one would explain more by itself than so many times what all explain
    /// together cancel each other.
    /// Derived: equal and opposite ones reach it at a correlation of 0.8. Of the models with several effects
    /// among 440 cases of the blind benchmark one is above it, with 12.5; the next has 4.0.
    max_cancellation: f64 = 5.0,
    /// Ratio of score statistics. A candidate with less than this share of the best one's is no rival.
    /// Tuned: by hand; no record of what on.
    min_rival_statistic_ratio: f64 = 0.5,
    /// χ². A candidate whose score statistic is less than the best one's by no more is a close rival.
    /// Derived: half of it is log odds: the margin of 3, and as much again that the refit may find.
    close_rival_statistic: f64 = 12.0,
    /// Fraction of the best score statistic. The same for strong effects.
    /// Tuned: by hand; no record of what on.
    close_rival_fraction: f64 = 0.1,
    /// Number. Rivals that are refitted.
    /// Tuned: by hand; no record of what on.
    max_rivals: usize = 6,
    /// Number. Rivals that are refitted, close ones included.
    /// Tuned: by hand; no record of what on.
    max_close_rivals: usize = 10,
    /// Number. Further variants that are tried of an effect whose best variant has unphysical estimates.
    /// Tuned: by hand; no record of what on.
    max_further_variants: usize = 3,
    /// Ratio of variances. Contacts that scatter by more than this over a measurement's variance would show
    /// in the noise; sticking wheels reach 2.7, backlash that is taken for them 6.8.
    /// Tuned: on the blind benchmark.
    max_contact_variance_ratio: f64 = 4.0,
    /// Standard deviations. A smaller estimate counts as zero when an effect is checked for being physical.
    /// Tuned: by hand; no record of what on.
    insignificant_estimate_sigmas: f64 = 3.0,
    /// Times what is plausible. A larger size of an effect names nothing.
    /// Convention: an order of magnitude, as what is plausible is known to no better.
    max_plausible_sizes: f64 = 10.0,
    /// Number. Parabolas that are fitted to a profile likelihood, each on a smaller step.
    /// Tuned: by hand; no record of what on.
    profile_iterations: usize = 2,
    /// Ratio. Smallest step of a parabola over the one before.
    /// Tuned: by hand; no record of what on.
    min_profile_step_ratio: f64 = 0.25,
    /// Standard deviations of the profiled parameter. Step of the next parabola.
    /// Tuned: by hand; no record of what on.
    profile_step_sigmas: f64 = 1.5,
    /// Number. Sparse terms that are refitted, best score first.
    /// Tuned: by hand; no record of what on.
    max_sparse_refits: usize = 3,
    /// Number. Sparse terms of one cause.
    /// Derived: a cosine and a sine of the phase of each of two wheels.
    max_sparse_terms: usize = 4,
    /// Cycles per revolution of a wheel: gear teeth, spokes, poles, turns of a motor.
    /// Tuned: by hand; no record of what on.
    wheel_cycles: [u8; 11] = [2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24],
    /// Number. Folds of cross-validation.
    /// Tuned: by hand; no record of what on.
    hold_out_folds: usize = 6,
    /// Number. Fewer runs, or blocks of runs, have no standard error over units.
    /// Tuned: by hand; no record of what on.
    min_held_out_units: usize = 3,
    /// Relative. A smaller increase of the drift does not speak against a term.
    /// Tuned: by hand; no record of what on.
    material_drift_increase: f64 = 0.05,
    /// Prior standard deviations. A larger detection limit is rounding, not information.
    /// Tuned: by hand; no record of what on.
    max_detection_limit_prior_sigmas: f64 = 1e6,
}
