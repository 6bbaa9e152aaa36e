//! Of the rates of the wheels.

rules::settings! {
    WheelRates
    /// Widths of the windows of rows by which rates are found, in turn: rows before, and as many after.
    /// Budgeted: steps of a factor of about 1.4; with 48 rows of 100 Hz a second is blurred.
    rate_windows: [usize; 12] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 40, 48],
    /// Variance of a rate's noise, over that of the rate itself, at which a window is wide enough.
    /// Budgeted: a term's size is then estimated a tenth too small at the most (errors in variables).
    rate_noise_fraction: f64 = 0.1,
    /// The same of the noise that is the rounding of counts.
    /// Budgeted: accelerations, by which delays show, are a tenth of the speeds and rarer; at 0.1 delays were
    /// not resolved with 264 counts a turn. Wider windows blur first where encoders are coarse.
    rate_rounding_fraction: f64 = 0.01,
    /// Variance of the noise of a single row's rate, over the rates' mean square, up to which a row's speed
    /// is taken from its own counts.
    /// Budgeted: 3 % of the speed; the square of it biases terms by a thousandth.
    max_row_rate_noise: f64 = 1e-3,
    /// Share of the usual row's length that rows are apart at the least when they were read.
    /// Derived: rows that a timer reads are a whole row apart; stamps that a scheduler delays by less than
    /// half a row are left as they are.
    min_row_share: f64 = 0.5,
    /// The same of rows that are sent in packets.
    /// Derived: they are read by a timer too; a mean that is a twentieth too long, as some rows are lost,
    /// does not push one packet into the one before.
    min_packet_row_share: f64 = 0.95,
    /// Mean row over the median row from which on rows are held to be sent in packets.
    /// Derived: of packets of four rows and more the median is nothing; of rows that a scheduler delays it is
    /// near the mean.
    max_row_spread: f64 = 3.0,
    /// Rows whose median is the usual row of a stretch of the log.
    /// Budgeted: a pause and the rows that waited in it are fewer than half of them.
    rows_of_stretch: usize = 64,
}
