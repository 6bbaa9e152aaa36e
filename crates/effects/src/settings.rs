//! Every threshold by which an effect of the catalogue decides about a log: unit, meaning and source. The
//! constants of its law stand in its own file.

/// Increments to either side of a row of counts whose middle one says how fast the wheel turns.
/// Budgeted: torn samples spoil two each, and the median stands most of them.
pub(crate) const NEIGHBOUR_ROWS: usize = 4;

rules::settings! {
    CounterFaults
    /// Rows that are torn, or read zero, one after another at the most.
    /// Tuned: by hand; no record of what on.
    max_fault_rows: usize = 2,
    /// Torn or zero rows from which on the log itself shows the fault.
    /// Budgeted: one may be an accident, or a row of another device.
    min_visible_faults: usize = 2,
    /// Increments of the rows around that a wheel does not come back by so soon.
    /// Tuned: by hand; no record of what on.
    far_increments: f64 = 4.0,
    /// Counts beside these that a wheel makes as it sets off.
    /// Tuned: by hand; no record of what on.
    far_counts: f64 = 16.0,
    /// Largest share of its count that a counter makes while it reads zero, where it comes back.
    /// Derived: a counter that goes on from zero has lost all of it.
    max_counted_share: f64 = 0.5,
    /// Times the usual departure by which half of the torn samples miss the step of a byte at the most.
    /// Budgeted: they miss it by what increments are out of line; tears come in ramps as well.
    max_miss_ratio: f64 = 8.0,
    /// Counts by which increments are out of line usually, at the least.
    /// Derived: rounding.
    min_miss_counts: f64 = 1.0,
    /// Times the usual departure that a jump is at the least, for jumps to be plain.
    /// Budgeted: stamps that jitter make some departures that large alike.
    clear_jump_ratio: f64 = 64.0,
}

rules::settings! {
    Gaps
    /// Ratio to the usual interval of one that may be a gap, where rows are too few for a sampling period.
    /// Derived: nearer to two rows than to one.
    gap_ratio: f64 = 1.5,
    /// Share of the most counts of a row that a row held up beside it shows at the least.
    /// Budgeted: a row that came by itself shows what its length says, which is anything.
    min_whole_row: f64 = 0.75,
    /// Rows to either side of a gap among which those are that it holds up.
    /// Tuned: by hand; no record of what on.
    held_up_rows: usize = 4,
    /// Counts by which both wheels are off over a row or a gap, as they are rounded.
    /// Derived: one of each.
    max_rounding_counts: f64 = 2.0,
    /// Rows to either side of a gap that say how fast the wheels turned.
    /// Budgeted: their rounding is a third of a row's.
    rows_around: usize = 3,
    /// Where so many times as many gaps lost counts as did not, all did.
    /// Budgeted: those that did not are mistakes.
    all_lost_ratio: usize = 4,
    /// Gaps that lost counts from which on the log itself shows the fault.
    /// Tuned: by hand; no record of what on.
    min_visible_gaps: usize = 3,
    /// Largest share of the gaps that are taken for such that lost their counts and did not.
    /// Tuned: on logs whose counters go on; four times what they show.
    max_misjudged_share: f64 = 0.1,
    /// Wheels of gaps from which on they tell together.
    /// Tuned: by hand; no record of what on.
    min_wheels_together: usize = 20,
    /// Standard errors by which their share is nearer to all than to none, or to none than to all.
    /// Derived: by chance in three logs of a thousand.
    together_sigmas: f64 = 3.0,
    /// Share of the pairs of successive measurements that gaps may spoil.
    /// Budgeted: the other half is enough for a fit.
    max_spoiled_pairs: f64 = 0.5,
}

rules::settings! {
    Intervals
    /// Largest share of the irregularity of stamps that a fit may find to be false.
    /// Budgeted: the period is of the same stamps, and delays of several rows are taken for the clock's.
    max_found_share: f64 = 1.5,
    /// Standard deviations within which an estimated share is all of it.
    /// Convention: three; a timer reads, and the stamp has nothing of it.
    whole_share_sigmas: f64 = 3.0,
    /// Share of the period that rows are apart at the least.
    /// Budgeted: what rounded stamps of a file leave.
    min_gap: f64 = 1e-3,
    /// Rows to either side whose counts say how fast a wheel turns, at the least.
    /// Budgeted: more are taken where stamps are late by periods, for which these are few.
    rate_rows: usize = 10,
    /// Times by which a row counts more than the middle one at the most.
    /// Budgeted: robots do not speed up so within a row; a counter that wraps counts otherwise.
    max_count_ratio: f64 = 20.0,
    /// Least standard deviation of a share by counts.
    /// Budgeted: the period is found from the same stamps.
    min_share_sigma: f64 = 0.05,
}

rules::settings! {
    Factors
    /// Logarithm by which an estimate is off a factor that people err by, at the most.
    /// Budgeted: wheels are out by less, and the list of factors is not that dense.
    factor_tolerance: f64 = 0.12,
    /// Share by which a factor differs from one at the least.
    /// Budgeted: wheels are out by less.
    min_departure: f64 = 0.3,
    /// Metres and radians. Shortest distance and shortest turn that are compared.
    /// Budgeted: far above what instruments err.
    min_compared_motion: [f64; 2] = [0.2, 0.5],
    /// Seconds. A displacement goes on where the one before ended.
    /// Budgeted: the rounding of a file.
    same_instant_s: f64 = 1e-6,
    /// Measurements of a run from which on what lies between two of them is a distance.
    /// Budgeted: with fewer, paths turn and may lead back.
    min_measurements: usize = 4,
    /// Ratio to a factor between units of time of the ratio of log and measurements, at the most.
    /// Budgeted: measurements need not begin and end with the log.
    max_span_ratio: f64 = 4.0,
    /// Metres a second. Speed of a usual robot.
    /// Convention: of robots on floors.
    usual_speed_m_s: f64 = 0.3,
}

rules::rooms! {
    counter_faults: CounterFaults as COUNTER_FAULTS,
    gaps: Gaps as GAPS,
    intervals: Intervals as INTERVALS,
    factors: Factors as FACTORS,
}
