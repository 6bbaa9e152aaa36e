//! Every limit on the files that are read here: memory stays within them and the files' own sizes. Beside
//! them what every reader of a table must agree on, and what decides when rows were read and what was counted
//! in them.

/// Bytes. Longest line of any table, and longest object of a `.tuple` file.
/// Budgeted: ten numbers of 400 digits and an id fit; a binary file rarely gets this far.
pub(crate) const LINE_LIMIT_BYTES: usize = 64 * 1024;

/// Rows of one table of a dataset.
/// Budgeted: a month at 400 Hz; its columns take 24 GB.
pub(crate) const MAX_ROWS: usize = 1_000_000_000;

/// Counts. Largest count of a wheel, to either side of zero.
/// Budgeted: a counter of 10⁹ counts a second runs for two years; sums of a dozen counts stay within 64 bits.
pub(crate) const MAX_COUNT: u64 = 1 << 56;

/// Bytes. Longest `dataset.toml`; it bounds the number of runs, at 15 bytes each.
/// Budgeted: tens of thousands of runs with covariates; the parser takes up to a hundred times the
/// memory.
pub(crate) const MANIFEST_LIMIT_BYTES: u64 = 4 * 1024 * 1024;

/// Bytes. Largest file of `import csv` and `import tum`, which are held in memory as a whole.
/// Budgeted: ten million rows.
pub(crate) const FILE_LIMIT_BYTES: u64 = 1 << 30;

/// Lines of a file of settings beside a log of another format.
/// Budgeted: they have some dozens.
pub(crate) const SHORT_FILE_LINES: u64 = 1000;

/// Characters of a file's text that a message shows.
/// Convention: a message stays on one or two lines.
pub(crate) const SHOWN_CHARS: usize = 60;

/// Radians. Least range of a run's headings in which a lidar whose place on the robot is sought measures
/// distances. In a straight its yaw cannot be told from how obliquely the robot drives at the wall, by which
/// a distance is a length: calibrated so, wheels had biases of 0.07 % and intervals that covered 65 %.
/// Budgeted: the lever of the lidar swings by nearly its own length.
pub const MIN_LIDAR_TURN_RAD: f64 = 1.0;

/// Seconds. Rows that lie farther apart on average are not stamped in seconds.
/// Convention: wheels are logged at 1 Hz or more.
pub const MAX_ROW_S: f64 = 4.0;

/// Largest number of a document that is read back: calibrations, kept results, states and baselines.
/// Derived: its fourth power, of a Monte-Carlo error, times that of a count is a double.
pub(crate) const LARGEST_NUMBER: f64 = 1e60;

/// Smallest number above zero there.
/// Derived: quotients with the largest one, and their squares, are doubles.
pub(crate) const SMALLEST_POSITIVE: f64 = 1e-60;

/// Lengths of quaternions that are rotations: rounded ones are 1 to within some 1e-3.
/// Budgeted: messages that were never filled have 0, and a component that was overwritten is rarely near.
pub(crate) const QUATERNION_LENGTH: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Least determinant of a matrix of correlations: below it a combination of coordinates would be known
/// exactly.
/// Derived: rows with six digits have determinants that are off by some 1e-6 at most; no instrument
/// correlates its errors to 1 − 1e-9.
pub(crate) const MIN_DETERMINANT: f64 = 1e-9;

/// Ratio of turning to driving from which on wheels go in opposite directions; a wheel that stands does not.
/// Budgeted: rounding.
pub(crate) const OPPOSITE_WHEELS: f64 = 1.0 + 1e-9;

/// Bits. Widths that counters come in.
/// Convention: those of registers and of encoder chips.
pub const USUAL_COUNTER_BITS: [u8; 4] = [8, 16, 24, 32];

/// Cells in a sampling period of the grid over which a row's read time is smoothed.
/// Budgeted: rounding to a cell adds a 28th of a period, far less than delays do.
pub(crate) const GRID_CELLS: i64 = 8;

/// Rows whose probabilities over that grid are kept at once.
/// Budgeted: some megabytes, whatever the length of a log.
pub(crate) const BLOCK_ROWS: usize = 1024;

rules::settings! {
    TimeBase
    /// Rows of a log from which on it has a sampling period, and its rows have a usual length.
    /// Budgeted: the line through so many is off by a fifth of what stamps jitter by.
    min_rows: usize = 24,
    /// Most rounds in which period and numbers of rows are found from each other; each round mends what wrong
    /// numbers do to the period.
    /// Tuned: by hand; no record of what on.
    rounds: usize = 5,
    /// Share of the period by which gaps that are whole numbers of it depart at the most.
    /// Tuned: by hand; no record of what on.
    max_whole_gap_error: f64 = 0.05,
    /// The same where stamps are exact and some rows came by themselves.
    /// Budgeted: far below the tenths of a per mil by which stamps are off that were restored from receipt.
    max_exact_gap_error: f64 = 1e-4,
    /// Share of the period by which a row that came by itself is off the tick that it counts as. A row that
    /// is further off came after the tick before it.
    /// Tuned: by hand; no record of what on.
    max_off_next_tick: f64 = 0.01,
    /// Largest share of rows that came by themselves beside an exact period.
    /// Budgeted: a quarter of what the period is told from.
    max_share_by_themselves: f64 = 0.25,
    /// Rows of the spans whose phases say the period, one length after another.
    /// Tuned: by hand; no record of what on.
    phase_span_rows: [usize; 5] = [2, 8, 23, 100, 400],
    /// Ratios to the period known before between which each length of span seeks it.
    /// Budgeted: a fifth of the rows may be lost or come by themselves; then three times what is left open.
    phase_span_ratios: [[f64; 2]; 5] = [[0.8, 1.2], [0.97, 1.03], [0.99, 1.01], [0.9975, 1.0025], [0.9994, 1.0006]],
    /// Steps in which each length of span seeks it.
    /// Tuned: by hand; no record of what on.
    phase_span_steps: [u32; 5] = [80, 24, 20, 20, 20],
    /// Spans that a run has one after another at the least.
    /// Budgeted: a period that begins anew spoils few of them.
    min_spans: usize = 8,
    /// Number. Spans whose phases are compared.
    /// Budgeted: a mean over so many is known to 3 % of what one scatters by.
    phases_taken: usize = 1000,
    /// Ticks by which two periods that number the rows alike are apart at the end of a log.
    /// Budgeted: far below the jitter of any log that is not exact.
    same_period_ticks: f64 = 0.01,
    /// Share of the period. Where stamps are later, root mean square, some numbers of rows are wrong.
    /// Derived: half a period is then two standard deviations.
    max_certain_lateness: f64 = 0.25,
    /// Share of the period by which stamps jitter, up to which a row that came by itself is told from a late
    /// row.
    /// Derived: halfway between ticks is then five standard deviations.
    max_jitter_by_themselves: f64 = 0.1,
    /// Rows to either side whose line says when a row was due.
    /// Budgeted: 500 rows know it to a twentieth of their jitter, and a clock is steady for five seconds.
    line_rows: usize = 250,
    /// Share of the rows of a log with gaps whose lengths depart from the usual one by jitter alone.
    /// Budgeted: the median would not do: lengths come in two sorts, and the more frequent hardly departs.
    jitter_quantile: f64 = 0.9,
    /// Departures beyond so many times that quantile are true.
    /// Derived: 4.9 standard deviations of normal lengths.
    max_jitter_ratio: f64 = 3.0,
}

rules::settings! {
    Receipt
    /// Step of the share of lost rows that is sought first; a negative share is of rows between two ticks.
    /// Derived: half a period of 500 rows; between wider steps the likelihood may have a peak of its own.
    lost_step: f64 = 1e-3,
    /// Steps of either sign that are all tried, to two rows in a hundred; beyond them every
    /// fifth is.
    /// Tuned: by hand; no record of what on.
    max_fine_steps: i32 = 20,
    /// Most steps of either sign: eight rows in a hundred.
    /// Tuned: by hand; no record of what on.
    max_lost_steps: i32 = 80,
    /// Steps in which the share is then sought: the first, and the least.
    /// Derived: half of those before; half a period of 3000 rows.
    lost_steps: [f64; 2] = [5e-4, 1.5e-4],
    /// Log odds against any rows that are lost or came between ticks.
    /// Tuned: by hand; no record of what on.
    any_lost_cost: f64 = 8.0,
    /// Mean of the prior of the share of lost rows, which falls off exponentially.
    /// Convention: a row in a hundred; where delays are periods long, rows hardly tell more.
    usual_lost: f64 = 0.01,
    /// Probability of a step of one period at a row, in either direction, where none is expected.
    /// Tuned: by hand; no record of what on.
    min_step_probability: f64 = 3e-4,
    /// Rows by which the share of lost rows is found.
    /// Budgeted: time; the share is known to half a period of them.
    lost_rows: usize = 3000,
    /// Probability that the clock walks by a cell of the grid at a row.
    /// Budgeted: a period in 60,000 rows, root mean square of a walk.
    walk_probability: f64 = 1e-3,
    /// Ratio to the likeliest cell's probability below which cells at the ends are left out.
    /// Budgeted: what is left out is far below the probability of a lost row.
    min_cell_ratio: f64 = 1e-9,
    /// Predicted probability of a row below which the clock begins anew, as after a pause of no whole number
    /// of periods.
    /// Tuned: by hand; no record of what on.
    min_row_probability: f64 = 1e-12,
    /// Periods by which a row is received before it was read, in the mean.
    /// Budgeted: what the period is not known to.
    early_periods: f64 = 0.05,
    /// Mean delays over which a first row is sought.
    /// Derived: a longer exponential delay has a probability of 6e-6.
    first_delays: f64 = 12.0,
    /// Steps of the mean delay in a factor of e.
    /// Budgeted: a mean delay is found to a twentieth.
    mean_steps_per_e: f64 = 20.0,
    /// Steps of that by which it is sought first.
    /// Derived: a factor of 2.2 in the mean delay.
    first_mean_step: f64 = 16.0,
    /// Periods. Longest mean delay of rows that are received one by one; a log that is written in blocks has
    /// one stamp a block.
    /// Budgeted: memory and time; the grid grows with the delay.
    max_mean_delay: f64 = 40.0,
    /// Share of the period. A row that comes so soon behind another was held up by it.
    /// Tuned: by hand; no record of what on.
    held_up_gap: f64 = 0.2,
    /// Rows come in bunches where more than this share of them was held up.
    /// Tuned: by hand; no record of what on.
    min_held_up_share: f64 = 0.1,
    /// Periods without a row from which on a log pauses.
    /// Tuned: by hand; no record of what on.
    pause_periods: f64 = 100.0,
}

rules::settings! {
    Numbering
    /// Numberings of the rows that are followed side by side.
    /// Tuned: by hand; no record of what on.
    paths: usize = 8,
    /// Rows over which a numbering's usual lateness forgets.
    /// Budgeted: two seconds at 100 Hz, in which a clock is steady.
    memory_rows: f64 = 200.0,
    /// First rows of a log whose median is the usual lateness at its start.
    /// Budgeted: four of them may be late themselves.
    first_rows: usize = 9,
    /// Log odds against a lost row, before anything is known of a log.
    /// Convention: a few rows in ten thousand are lost.
    lost_cost: f64 = 8.0,
    /// Log odds against a row that came by itself, before anything is known of a log.
    /// Convention: fewer come by themselves.
    by_itself_cost: f64 = 10.0,
    /// Log odds against each further row that is lost with another.
    /// Convention: several rows are lost together more often than independently.
    further_lost_cost: f64 = 2.0,
    /// Log odds against a pause, however long.
    /// Tuned: by hand; no record of what on.
    pause_cost: f64 = 14.0,
    /// Least log odds against a row that is lost or came by itself, where they are taken from their shares.
    /// Derived: those of one row in fifty.
    min_cost: f64 = 4.0,
    /// Standard deviations beyond which a lateness costs in proportion to its size.
    /// Convention: Huber 1964, efficient to 96 % with normal errors.
    huber_sigmas: f64 = 1.5,
    /// Share of the period by which stamps jitter at the least.
    /// Budgeted: what rounded file formats leave.
    min_jitter: f64 = 0.02,
}

rules::settings! {
    PacketSizes
    /// Least share of the packets that have as many rows.
    /// Budgeted: of rows that hold up each other by chance, bunches of one size are half at most.
    min_whole_share: f64 = 0.5,
    /// Largest share of the packets that have more rows.
    /// Budgeted: of rows that hold up each other by chance, many have more.
    max_larger_share: f64 = 0.02,
    /// Least share of the packets that have half to twice as many rows as the middle one.
    /// Budgeted: of bunches by chance about half do.
    min_similar_share: f64 = 0.9,
    /// Rows of a packet at the least.
    /// Convention: one row is no packet.
    min_packet_rows: usize = 2,
    /// Periods of the rows by which packets of varying size are off them at the most, root mean square.
    /// Budgeted: a sender that looks now and then is late by up to one, 0.29; see `min_short_packets`.
    max_packet_off: f64 = 0.45,
    /// Short packets from which on they may be of varying size; where fewer are short, rows were lost.
    /// Derived: so many lost rows make √(n/15) of a random walk about its line, twice `max_packet_off`.
    min_short_packets: usize = 12,
}

rules::settings! {
    Counters
    /// Times by which unwrapping must make the largest increment smaller.
    /// Budgeted: a robot that once moved fast has increments of all sizes; a wrap leaves none in between.
    min_unwrapped_shrinkage: u64 = 4,
    /// Times by which an unwrapped jump may be larger than any of the increments beside it.
    /// Budgeted: so many rows may be lost there; a counter that is set to 0 near 2ⁿ leaves more.
    max_unwrapped_ratio: u64 = 10,
    /// Increments that count on each side of a jump.
    /// Budgeted: a robot may stand before it.
    steps_beside_jump: usize = 3,
    /// Times by which the two leaps of a spike are larger than any other increment.
    /// Tuned: by hand; no record of what on.
    min_spike_ratio: u64 = 1000,
    /// Radians. Counters that read what is no farther apart at the starts of two runs were set back.
    /// Budgeted: a log begins some counts after the reset; 0.1 rad cost half a per cent of an amplitude.
    same_start_rad: f64 = 0.1,
}

rules::settings! {
    RoundedRates
    /// Most decimals of recorded rates that count as rounded.
    /// Budgeted: 10 µm/s for a minute displace a robot by a fraction of a millimetre.
    max_decimals: i32 = 5,
    /// How far a rounded rate, in its steps, is from a whole number.
    /// Budgeted: files say six digits of a number, and single precision has seven.
    decimal_tolerance: f64 = 1e-3,
    /// Distinct values of the rates of a run from which on their decimals are those of rounding.
    /// Budgeted: robots are told to drive at some round speeds, and speed up through many.
    min_distinct_rates: usize = 8,
    /// Counts that the rounding of a rate is at the most, for the nearest to be the right one.
    /// Derived: half of it is halfway to the next.
    max_rounded_counts: f64 = 0.25,
    /// Counts by which a rate is off a whole number beside its rounding at the most.
    /// Budgeted: periods are known to some 1e-4, of a hundred counts.
    max_count_tolerance: f64 = 0.02,
    /// The same as a share of the counts.
    /// Budgeted: twice what periods are known to.
    count_tolerance_ratio: f64 = 2e-4,
    /// The same of few counts.
    /// Budgeted: stamps that jitter by half a period leave as much of a hundred rows; numbers of counts that
    /// are taken for each other, 1000 and 1024, differ by five times as much.
    min_count_tolerance: f64 = 5e-3,
    /// What counts are taken to be off whole numbers by at the least.
    /// Budgeted: periods are known to some 1e-4, of a count; of equal rates all are off by as much.
    min_count_error: f64 = 1e-4,
    /// Share of the rows in which a wheel turns that are made of counts at the least.
    /// Budgeted: rows at the ends of gaps have times of their own.
    min_counted_share: f64 = 0.98,
    /// Probability at the most that rates which are not made of counts are within their rounding of such.
    /// Budgeted: one log in 1e12.
    max_chance_of_counts: f64 = 1e-12,
    /// Counts of a counter that are told from others by a number of double precision, and of any log.
    /// Derived: a number of 1e12 has steps of 1e-4, far below the tolerance.
    max_counts: f64 = 1e12,
    /// Median steps. Longest step between two rates of a gyroscope that is bridged.
    /// Derived: at up to 3 rad/s² and 50 Hz the mean over 3 steps is off by 3 · 0.06 / 8 = 0.02 rad/s.
    max_bridged_steps: f64 = 3.5,
}

rules::settings! {
    Labels
    /// Radians by which a turn of a square is off a right angle at the most.
    /// Budgeted: a robot is stated wrongly or driven by hand.
    max_turn_error_rad: f64 = std::f64::consts::PI / 6.0,
    /// Ratio of the longest to the shortest side of a square.
    /// Budgeted: as for its turns.
    max_side_ratio: f64 = 1.25,
    /// Radians. Smaller turns are of a controller that keeps its course.
    /// Tuned: by hand; no record of what on.
    min_turn_rad: f64 = std::f64::consts::PI / 18.0,
    /// Metres. A robot with a shorter path is on the spot.
    /// Tuned: by hand; no record of what on.
    min_path_m: f64 = 0.1,
    /// Radians. Least turn of a spin, and most by which a square's is off a whole turn.
    /// Convention: an eighth of a turn.
    eighth_turn_rad: f64 = std::f64::consts::TAU / 8.0,
    /// Radians. Range of the headings of a straight.
    /// Tuned: the straights of the study keep within 4°.
    max_straight_rad: f64 = std::f64::consts::TAU / 36.0,
    /// Least share of a path, or of the headings, that goes one way.
    /// Tuned: the squares of the study have 2 % the other way.
    min_one_way_share: f64 = 0.95,
    /// Largest unevenness of a circle, as a share of its turn.
    /// Tuned: the spirals of the study are uneven by 0.043 to 0.068; two different arcs by more.
    max_uneven_share: f64 = 0.1,
    /// Largest share of a circle's turning with wheels in opposite directions.
    /// Tuned: the circles of the study turn so for 3 %, as they start and stop.
    max_on_the_spot_share: f64 = 0.1,
    /// Share by which a square's sides are off the stated ones at the most.
    /// Tuned: the squares of the study are 1 % short by the nominal robot.
    max_side_error: f64 = 0.1,
}

rules::settings! {
    AngleCounts
    /// Steps of an angle below this, radians, are rounding of the file's numbers and no counts.
    /// Budgeted: files with six decimals round by half of 1e-6, and a step twice.
    quantum_tolerance: f64 = 3e-6,
    /// Counts of angles below this, radians, are as good as exact.
    /// Budgeted: 200 000 counts a turn; on a wheel of 80 mm, 2.5 µm.
    min_quantum_rad: f64 = 3e-5,
    /// Steps that must be there before angles are taken for counts.
    /// Budgeted: chance does not put 98 of 100 on a grid.
    min_grid_steps: usize = 100,
    /// Share of steps that are multiples of the smallest one, from which on angles are counts.
    /// Budgeted: chance has a tenth of them within a twentieth.
    min_grid_fraction: f64 = 0.98,
}

rules::rooms! {
    angle_counts: AngleCounts as ANGLE_COUNTS,
    time_base: TimeBase as TIME_BASE,
    receipt: Receipt as RECEIPT,
    numbering: Numbering as NUMBERING,
    packet_sizes: PacketSizes as PACKET_SIZES,
    counters: Counters as COUNTERS,
    rounded_rates: RoundedRates as ROUNDED_RATES,
    labels: Labels as LABELS,
}
