//! Of the rounding of recorded rates.

rules::settings! {
    RecordedRates
    /// Recorded rates whose errors are shared, at the most.
    /// Budgeted: a pass each, which together take as long as some fits do.
    max_shared_rates: usize = 96,
    /// Steps of a recorded rate that one count of a wheel makes, from which on the noise of counts dithers
    /// nothing.
    /// Derived: an interval of rounding then has two numbers of counts at the most, and errors of their own.
    min_count_steps: f64 = 0.5,
}
