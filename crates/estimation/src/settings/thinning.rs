//! Numbers of thinning: at which spacing measurements are taken whose errors are autocorrelated.

rules::settings! {
    Spacing
    /// Phases in which thinned measurements are taken.
    /// Tuned: by hand; no record of what on.
    thinning_phases: usize = 4,
    /// Factor from one thinning to the next.
    /// Convention: doubling.
    thinning_factor: f64 = 2.0,
    /// Share of a measurement's interval by which the spacing may be short: instruments jitter.
    /// Derived: half of an interval, so that jitter does not pass over the measurement that is due.
    spacing_slack: f64 = 0.5,
    /// Fewest measurements of a run, on average, that thinning leaves.
    /// Derived: with fewer a run would be no more than its ends.
    min_measurements_per_run: f64 = 1.0,
}
