//! Which stretches of large logs are diagnosed.

/// Measurements of the stretches that are diagnosed, together.
/// Budgeted: a diagnosis of them takes a quarter of a minute of one core and 140 MB.
pub(crate) const SUBSAMPLE_MEASUREMENTS: usize = 1 << 16;

/// Measurements of a stretch.
/// Derived: a thirty-second of all that are diagnosed; as many runs tell their scatter to 13 %, 1/√62.
pub(crate) const STRETCH_MEASUREMENTS: usize = SUBSAMPLE_MEASUREMENTS / 32;

/// Number. Most runs of a diagnosis.
/// Budgeted: a run takes half a megabyte and 4 ms of a core, however short it is.
pub(crate) const MAX_RUNS: usize = 10_000;

rules::settings! {
    LargeLog
    /// Most rows of the stretches that are diagnosed, together, where measurements are few.
    /// Budgeted: a quarter of a gigabyte, at half a kilobyte a row.
    subsample_rows: usize = 1 << 19,
    /// Stretches that are diagnosed for each fault of the records that counts show by themselves, beside
    /// those that are spread over the log.
    /// Budgeted: an eighth of the stretches, for each fault.
    max_faulty_stretches: usize = 4,
    /// The fractional part of its multiples is spread over [0, 1) more evenly than that of any other
    /// number's.
    /// Derived: the golden section, (√5 − 1)/2.
    golden_section: f64 = 0.618_033_988_749_894_9,
}
