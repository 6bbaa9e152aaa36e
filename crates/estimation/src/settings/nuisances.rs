//! Numbers of the instrument's nuisances: what lets extrinsics and latency into a fit.

rules::settings! {
    Nuisances
    /// Factor by which nuisances must reduce the number of outliers to explain them.
    /// Tuned: by hand; no record of what on.
    min_outlier_reduction: usize = 2,
    /// Growth of the errors of final headings, or of positions, that extrinsics are allowed for each share
    /// that those of the other fall by.
    /// Tuned: markers turned by 0.19 rad cut positions to a quarter and moved headings by up to 0.7 %; those
    /// of real robots that predict ends worse cut one by 4 % where the other grew by 2 %.
    max_end_growth_ratio: f64 = 0.1,
    /// Factor by which nuisances must reduce the time between measurements whose errors are not
    /// autocorrelated.
    /// Tuned: on real robots, where millimetres and milliradians reduced it up to eightfold and ends were
    /// predicted worse with them, and on poses 0.1 s late of a marker turned by 0.2 rad, where it was 85.
    min_thinning_reduction: f64 = 10.0,
    /// Fewer runs are cut into blocks to be held out.
    /// Derived: one run or block for each fold.
    min_runs_to_hold_out: usize = 6,
    /// Folds of cross-validation.
    /// Tuned: by hand; no record of what on.
    folds: usize = 6,
    /// Blocks of each run when each run has its own extrinsics: they are fitted to some and judged on the
    /// others.
    /// Tuned: by hand; no record of what on.
    blocks_per_run: usize = 3,
    /// Gain in log-likelihood on held-out runs, standard errors, that lets a nuisance into the model.
    /// Convention: two standard errors, a one-sided level of 2.3 %.
    min_held_out_gain_sigma: f64 = 2.0,
}
