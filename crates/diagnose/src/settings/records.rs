//! What makes records faulty: corrections of the records, rows and clocks of the log, fits that do not hold.

rules::settings! {
    Records
    /// Natural logarithm. A correction of the records is a fault if it raises the log likelihood by more;
    /// dozens of corrections are tried.
    /// Tuned: by hand; no record of what on.
    min_fault_log_likelihood_gain: f64 = 20.0,
    /// Natural logarithm of odds. Cost of each mistake beyond the first that a fault of the records takes.
    /// Budgeted: ln 20, a second mistake in one of twenty robots that have a first.
    log_odds_of_a_mistake: f64 = 3.0,
    /// Seconds. An offset of all runs that is taken off before the fit.
    /// Budgeted: a tenth of a second and less is estimated with everything else.
    min_common_clock_offset_s: f64 = 0.15,
    /// Seconds. The same where the fit takes many measurements for outliers: the instrument is too precise
    /// for the offset to be estimated with everything else.
    /// Budgeted: three standard deviations of an offset that a few runs determine to five milliseconds.
    min_rejecting_clock_offset_s: f64 = 0.015,
    /// Number. Of so many runs one may have another mounting; where more have, it is their errors.
    /// Convention: one in ten.
    min_runs_per_odd_extrinsics: usize = 10,
    /// Relative. Prior standard deviation of the wheels' sizes.
    /// Convention: wheels are known to a few per cent.
    wheel_prior_sigma: f64 = 0.05,
    /// Relative. Prior standard deviation of the wheel separation, to which skid steering adds.
    /// Tuned: by hand; no record of what on.
    separation_prior_sigma: f64 = 0.3,
    /// Standard deviations of the prior. Largest deviation of a wheel's size from nominal of a plausible
    /// drive.
    /// Tuned: by hand; no record of what on.
    max_wheel_deviation_sigmas: f64 = 2.0,
    /// Standard deviations of the prior. Largest deviation of the wheel separation from nominal of a
    /// plausible drive.
    /// Tuned: by hand; no record of what on.
    max_separation_deviation_sigmas: f64 = 1.5,
    /// Relative. A wheel separation that is calibrated farther from the stated one is a finding.
    /// Convention: as for wheels; effective separations of robots that do not skid are within 2 % of nominal.
    max_separation_deviation: f64 = 0.1,
    /// Ratio. Largest effective wheel separation of a robot that skids in turns over that of its wheels.
    /// Published: multipliers of 1.3 to 2 that users of skid-steered robots set.
    max_skid_steered_separation: f64 = 2.0,
    /// Standard deviations of the estimate. Geometry that is less certainly far from the stated one is no
    /// finding.
    /// Convention: five.
    min_deviation_sigmas: f64 = 5.0,
    /// m/√m. Largest wheel noise of a plausible drive.
    /// Tuned: by hand; no record of what on.
    max_wheel_sigma_m_per_sqrt_m: f64 = 0.01,
    /// rad/√rad. Largest turn noise of a plausible drive.
    /// Tuned: by hand; no record of what on.
    max_turn_sigma_rad_per_sqrt_rad: f64 = 0.05,
    /// Ratio. Odometry is uncorrelated with the measurements if its noise is larger than that of a plausible
    /// drive by this.
    /// Tuned: by hand; no record of what on.
    uncorrelated_noise_factor: f64 = 3.0,
    /// Fraction of the extent of the measured path, and radians. Measurements with a larger standard
    /// deviation are uncorrelated with the motion.
    /// Tuned: by hand; no record of what on.
    uncorrelated_measurement_sigma: f64 = 0.3,
    /// Relative standard deviation. Where all measurements together determine both wheels' sizes better than
    /// this, odometry is correlated with them however imprecise single ones are.
    /// Budgeted: by accident wheels that do not move the robot are as large as stated to 2 % once in fifty
    /// times.
    max_correlated_wheel_sigma: f64 = 0.02,
    /// Ratio. Largest wheel noise of a fit without a fault over that with it, where it is more than a
    /// plausible drive's. Rows that were lost beside a fault leave some.
    /// Budgeted: a sixteenth of the variance, which no accident of some tens of measurements gives.
    max_remaining_noise_ratio: f64 = 0.25,
    /// Fraction of the measurements. With more outliers, a fit is not sound and faults without a trace in the
    /// log are tried.
    /// Tuned: by hand; no record of what on.
    max_sound_outlier_fraction: f64 = 0.01,
    /// Ratio. Outliers after a correction of the records over those before it; tails may be heavy, and lost
    /// counts are restored roughly.
    /// Tuned: by hand; no record of what on.
    max_remaining_outlier_ratio: f64 = 0.5,
    /// Fraction of the measurements. Outliers that are accepted after a correction of the records, however
    /// few there were before.
    /// Tuned: by hand; no record of what on.
    max_corrected_outlier_fraction: f64 = 0.1,
    /// Radians. A correction of the records that turns the instrument farther on the robot is refused.
    /// Tuned: by hand; no record of what on.
    max_sensor_heading_rad: f64 = 1.0,
    /// Ratio. Wheels whose mean size differs from nominal by more are not those of the described robot.
    /// Tuned: by hand; no record of what on.
    wrong_wheels_factor: f64 = 1.3,
    /// Ratio. Wheels that differ by more are not another robot's, nor in other units: the fit is of something
    /// else.
    /// Derived: millimetres for metres are 1000, and wheels of another robot up to twice as large or small.
    max_wrong_wheels_factor: f64 = 2000.0,
    /// Relative. Corrections of two sessions undo the same fault if their factors differ by no more.
    /// Tuned: by hand; no record of what on.
    factor_tolerance: f64 = 0.05,
    /// Fraction of the measurements. A base fit that rejects more as outliers is no model of the robot.
    /// Tuned: by hand; no record of what on.
    max_rejected_fraction: f64 = 0.2,
    /// Ranges of the four increments around it. An increment farther off is outlying.
    /// Tuned: by hand; no record of what on.
    outlying_row_ranges: f64 = 20.0,
    /// Rows before and after an increment among which another one as far off says that it is of the motion.
    /// Budgeted: rows two and three away are of one phase where a ripple lasts four or five rows.
    recurrence_rows: usize = 5,
    /// Probability. An increment of a steady wheel is outlying.
    /// Derived: 0.13 r³ at r = 1/20, the distribution of the range of four normal variables.
    outlying_row_probability: f64 = 1.6e-5,
    /// Counts. Least range of increments.
    /// Derived: two increments of a steady wheel each round by one count.
    count_rounding: f64 = 2.0,
    /// Ratio. A wheel slower than this share of its mean rate around a row stands; a robot may stop for a
    /// row.
    /// Tuned: by hand; no record of what on.
    standstill_rate_ratio: f64 = 0.1,
    /// Probability. Level of the test of the log's rows.
    /// Tuned: by hand; no record of what on.
    log_rows_level: f64 = 1e-6,
    /// Ratio. A log whose span differs from that of the measurements by more is of another clock.
    /// Tuned: by hand; no record of what on.
    max_clock_ratio: f64 = 30.0,
    /// Wheel separations. Distance over which windows between measured poses calibrate the wheels before any
    /// fit.
    /// Convention: a half; over less, noise of the instrument is most of it.
    window_distance_separations: f64 = 0.5,
    /// Numbers of measurements that a window spans.
    /// Convention: octaves; from a step between two measurements to a push of seconds.
    window_spans: [usize; 6] = [1, 2, 4, 8, 16, 32],
    /// Number of measured poses. A run with fewer says nothing of windows.
    /// Convention: ten.
    min_window_poses: usize = 10,
    /// Number of iterations of reweighting by the absolute residual.
    /// Convention: the gain of a step is below 1 % after ten.
    reweightings: usize = 15,
    /// Wheel separations. Motion along that no wheel has missed, where it is far beyond the noise.
    /// Budgeted: ten times what a bump of a tenth of a wheel's radius, or a slip at full acceleration, costs
    /// between two measurements.
    min_unknown_along_separations: f64 = 0.1,
    /// Wheel separations. The same of motion across, which rolling wheels cannot make.
    /// Budgeted: a skid of 10 ms at 1 m/s and 1 rad/s is 1 mm in 0.1 s.
    min_unknown_across_separations: f64 = 0.05,
    /// Radians. The same of heading.
    /// Budgeted: three times a large kick of a castor, 2 degrees.
    min_unknown_turn_rad: f64 = 0.1,
    /// Standard deviations, by the 90 % quantile of all windows of that span.
    /// Convention: beyond what normal errors do in any log.
    min_unknown_sigmas: f64 = 10.0,
    /// Standard deviations of a longer window that a displacement has to be, for the window to tell whether
    /// it lasts.
    /// Derived: half of it is asked for, which is then four standard deviations.
    min_surrounding_sigmas: f64 = 8.0,
    /// Seconds before and after a displacement in which it may be undone: rows that are stamped late catch
    /// up.
    /// Budgeted: ten times the mean lateness of rows that a busy computer receives, 50 ms.
    max_undone_s: f64 = 0.5,
    /// Share of all pairs of measurements. Where more are beyond the wheels, the noise is, or the model.
    /// Convention: a tenth.
    max_unknown_share: f64 = 0.1,
    /// Events in all runs for each run, or for each minute, whichever are more.
    /// Convention: a robot that is pushed twice a minute is no subject of a calibration.
    max_unknown_events_per_run: f64 = 2.0,
    /// Ratio to the fastest motion of the log. What is faster than so many times that is the instrument's.
    /// Convention: twice.
    implausible_speed_ratio: f64 = 2.0,
    /// Radians. A run whose instrument is turned on the robot by more than in the other runs is of another
    /// mounting.
    /// Convention: a degree; a clip-on marker is put back to about that.
    min_other_extrinsics_rad: f64 = 0.02,
    /// Wheel separations. The same of its place.
    /// Convention: a fiftieth, 7 mm of 363 mm.
    min_other_extrinsics_separations: f64 = 0.02,
    /// Standard deviations, of the run's own mounting and of how mountings scatter over the runs.
    /// Convention: beyond what normal errors do in any log.
    min_other_extrinsics_sigmas: f64 = 8.0,
    /// Number of runs, or parts of runs, of which one can be the odd one.
    /// Convention: five.
    min_extrinsics: usize = 5,
    /// Number of windows that determine the mounting of a run.
    /// Convention: twice its unknowns.
    min_windows_per_extrinsics: usize = 8,
    /// Metres and radians. Least standard deviation of windows.
    /// Convention: a tenth of a millimetre; records of simulations may have no noise.
    min_window_sigma: f64 = 1e-4,
    /// Share of a run. What is beyond wheels for longer is tried as another mounting.
    /// Convention: a quarter.
    lasting_share: f64 = 0.25,
    /// Ratio to the least other mounting. A run that determines its own to no better than this says nothing.
    /// Convention: ten times.
    max_least_extrinsics: f64 = 10.0,
    /// Median lengths of a row. A row that lasts longer has others missing before it.
    /// Convention: nearer to two than to one, and beyond ordinary jitter.
    min_gap_ratio: f64 = 1.8,
    /// Fraction of what the linear term of a stamp error explains. Restamped records may explain less of the
    /// data by this: rows whose place on the beat is not known stay late.
    /// Tuned: by hand, on single cases of the blind benchmark with stamps of receipt, which lose 2.5 %.
    max_restamping_loss: f64 = 0.05,
    /// Standard deviations. Stamps are wrong by more than half of their irregularity, by counts alone, if the
    /// share is above a half by more.
    /// Derived: a normal deviation of as much has a probability of 0.001.
    min_share_sigmas: f64 = 3.0,
    /// Mean of what stamps are late by, over what they vary by about their beat, root mean square, at the
    /// most.
    /// Budgeted: of exponential delays it is 1, and more where rows that are late hold up others.
    max_mean_lateness_ratio: f64 = 2.0,
    /// What the mean of restored delays is off by, over what stamps vary by, root mean square, at the most.
    /// Tuned: on logs of the blind benchmark with stamps of receipt, whose mean is off by up to a tenth.
    max_restored_lateness_ratio: f64 = 0.25,
}
