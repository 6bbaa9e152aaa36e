//! Every threshold of the checks before a fit: unit, meaning and source.

rules::settings! {
    Checks
    /// Seconds. Length of the windows whose motion by the wheels is compared with that of the instrument.
    /// Budgeted: a robot turns by less than a radian in it, and moves by many roundings of its counters.
    window_s: f64 = 0.5,
    /// Seconds. Longest window: in a longer one, a robot may drive more than one arc.
    /// Budgeted: an instrument of 1 Hz is still compared.
    max_window_s: f64 = 1.6,
    /// Windows of a session at the most.
    /// Budgeted: a session is checked in less than a tenth of a second.
    max_windows: usize = 1600,
    /// Windows of a session at the least, for any verdict on what they say.
    /// Convention: twelve for each of the parameters of a window's motion, two a component.
    min_windows: usize = 24,
    /// Radians. Largest turn of a window: beyond, chord and heading no longer follow from one arc.
    /// Derived: below half a turn by the errors of nominal values.
    max_window_turn_rad: f64 = 2.0,
    /// Ratio to the 90th percentile. A window whose instrument moves farther is an outlier of the
    /// instrument's.
    /// Budgeted: robots drive at most a few times as fast as usual.
    outlying_motion_ratio: f64 = 5.0,
    /// Residuals over their median absolute value, at which a window has half of its weight.
    /// Convention: Cauchy's weights, tuned to 95 % efficiency, 2.385 standard deviations of 1.48 medians.
    cauchy_medians: f64 = 3.5,
    /// Passes of reweighted least squares.
    /// Budgeted: weights change by less than a per cent after ten.
    robust_passes: usize = 10,
    /// Groups of consecutive windows that the jackknife leaves out in turn.
    /// Convention: eight; standard deviations are then known to a quarter.
    groups: usize = 8,
    /// Windows at the least in which a wheel's records say something else than in the others.
    /// Budgeted: four seconds of driving, over which the error of one window does not pass for a gain.
    min_faulty_windows: usize = 8,
    /// Parts of a session's windows between which a span of them is looked for first.
    /// Budgeted: the 2000 spans between them are compared in a few milliseconds.
    span_grid: usize = 64,
    /// Share of a session's windows for which all of them count beside those outside of a span.
    /// Tuned: on 230 sound logs of all kinds and 300 mixed ones; a regression on straights alone then says
    /// nothing of turns, and a gain comes out wrong by less than a hundredth.
    whole_log_share: f64 = 0.01,
    /// Ratio to the usual motion of a window, below which it is at rest.
    /// Budgeted: a robot that goes so slowly says a twentieth of what it says at speed.
    max_still_ratio: f64 = 0.05,
    /// Ratio of a wheel's gains in two parts of a log from which on its records say something else.
    /// Tuned: on 230 sound logs of all kinds and 300 mixed ones, none of which has such a part; gains of 0.8
    /// and 1.2 are found in 46 of 48 logs. Loads and tyres change a wheel by less than 3 %.
    min_gain_change: f64 = 1.1,
    /// Quantile of the residuals in such a part that its gains must explain.
    /// Budgeted: one window in four may be an outlier; of a square that is driven the other way round, one in
    /// three is a turn.
    explained_quantile: f64 = 0.75,
    /// Gain below which a wheel is dead.
    /// Tuned: on 96 logs with a dead wheel: where a part of it begins a window too early, it is 0.08.
    dead_gain: f64 = 0.1,
    /// Share of a wheel's turning that its records gain by themselves, from which on it is said.
    /// Tuned: on 115 sound logs of all kinds and 150 mixed ones, none of which gains as much; records that
    /// gain 0.02 to 0.3 rad/s are found in 46 of 48 logs.
    min_runs_on_share: f64 = 2e-3,
    /// Share of a column's range by which a speed leaps that wraps, at the least.
    /// Derived: from near one end of the range to near the other; what the instrument saw decides.
    min_wrap_share: f64 = 0.7,
    /// First rows of a moving robot that say the step of its values.
    /// Budgeted: a hundred say it; the mean of so many is that of a drive.
    step_rows: usize = 10_000,
    /// Share of the mean value that a step is, from which on what is cut from values matters.
    /// Budgeted: half of it is what an ordinary calibration corrects.
    min_cut_share: f64 = 0.01,
    /// Ratio of the unexplained motion with half of a step added to values that are whole ones to that
    /// without, at the most, for them to be cut toward zero.
    /// Tuned: on 690 sound logs of 115 kinds and six cut ones of seed 67101: 0.96 and more with values that
    /// are rounded, 0.86 to 0.93 with whole millimetres and degrees of a twentieth of a second.
    max_cut_ratio: f64 = 0.95,
    /// Runs by which ids of the truth are shifted at the most.
    /// Budgeted: files that are missing, and numbers that are counted from one.
    max_run_shift: usize = 8,
    /// Steps of a position's rounding that a wheel rolls between two poses, at the least, for the second one
    /// to differ from the first.
    /// Budgeted: of a robot that turns, poses move by less than its wheels roll.
    min_held_steps: f64 = 3.0,
    /// Share of the poses that repeat the one before though the wheels turn, from which on it is said.
    /// Tuned: on 20 logs: poses that are held for up to two seconds in 5 to 30 % of the time cost no standard
    /// deviation, since a fit leaves these out; poses that are logged twice or more cost up to three.
    min_held_share: f64 = 0.4,
    /// Seconds for which a pose is held at the most, from which on it is said.
    /// Tuned: on 20 logs: five times 0.02 s cost 1.5 standard deviations at the most, twice 0.1 s cost up to
    /// 2.4, and five times 0.1 s cost 2.7.
    min_held_s: f64 = 0.09,
    /// Instants of a run at which its position or pose tells of the drive's parameters.
    /// Budgeted: the sides of a square have two each.
    instants: usize = 8,
    /// Ratio of the smaller to the larger eigenvalue of the wheels' second moments, below which their motions
    /// are all of one direction: straights alone, or spins alone.
    /// Budgeted: corrections of a heading while going straight are a hundredth of the motion, squared.
    collinear_ratio: f64 = 2e-3,
    /// Ratio of the unexplained motion with a correction of the records to that without it, at the most, for
    /// the correction to be believed.
    /// Budgeted: twice as good a fit is no chance; other causes change it by less.
    decisive_ratio: f64 = 0.5,
    /// Nats. Log likelihood gained by a correction, at the least.
    /// Budgeted: odds of 1e13 before errors that are alike for seconds, which make ten windows one.
    min_gain: f64 = 30.0,
    /// Nats. Logarithm of the odds of a sound log against one with a given fault, before any data.
    /// Convention: a fault in a thousand logs.
    prior_log_odds: f64 = 6.9,
    /// Largest share of the motion that is left unexplained by a correction that is believed.
    /// Budgeted: records that do not follow the robot leave all of it.
    max_unexplained: f64 = 0.6,
    /// Largest share of the turns, and of the displacements, that is left unexplained with a correction of
    /// headings, axes or a clock's rate that is named.
    /// Budgeted: a log with the right correction leaves less than a tenth where its noise is ordinary.
    max_left_by_fix: f64 = 0.4,
    /// Share of the motion that is left unexplained by records that have nothing to do with the robot.
    /// Budgeted: of independent motions a straight line explains 1/n.
    unrelated: f64 = 0.95,
    /// Seconds. Farthest offset of the clocks that is looked for beside the one that lets the records
    /// overlap.
    /// Convention: clocks that nobody set are minutes apart.
    max_clock_offset_s: f64 = 600.0,
    /// Seconds. Farthest offset that is looked for where the records explain each other without one.
    /// Budgeted: records that are farther apart do not explain each other.
    max_near_offset_s: f64 = 5.0,
    /// Seconds. Steps of the search for an offset, from coarse to fine.
    /// Budgeted: the first is half of a window, so that none is passed over.
    clock_steps_s: [f64; 4] = [0.25, 0.05, 0.01, 0.002],
    /// Seconds. Offset of the clocks from which on it is said, as a hint.
    /// Convention: instruments are late by a frame.
    min_clock_offset_s: f64 = 0.02,
    /// Seconds. Offset of the clocks from which on it is a warning; a smaller one is estimated as a latency.
    /// Convention: cameras and networks are late by less.
    min_warned_offset_s: f64 = 0.15,
    /// Seconds. Offset that no fit of a latency reaches from 0.
    /// Budgeted: three standard deviations of its prior.
    max_fitted_offset_s: f64 = 0.3,
    /// Share of half a row by which a delay may differ from it, beside its own error, and be that of rates of
    /// the instant.
    /// Budgeted: offsets are looked for in steps of 2 ms, and a robot that speeds up within a row is seen
    /// later.
    half_row_share: f64 = 0.15,
    /// Share of what a delay gains by which rates of the instant may explain less than it.
    /// Budgeted: the best of many offsets gains by chance, and by smoothing between rows; one and a half per
    /// cent with simulated robots at 20 Hz.
    delay_gain_share: f64 = 0.05,
    /// Share of the windows that must lie within both records at an offset that is looked at.
    /// Budgeted: a match of half of the records is no accident of one manoeuvre.
    min_overlap: f64 = 0.5,
    /// Relative. Clock rate from which on no result is right.
    /// Budgeted: wheels at a steady speed are off by as much, ten times what calibrations promise.
    max_clock_rate: f64 = 5e-4,
    /// Ratio to the stated value, or its inverse, that calibration corrects; beyond, the log says something
    /// else than it means.
    /// Convention: wheels are known to a few per cent; `calib` remarks on the same ratio.
    max_wheel_ratio: f64 = 1.3,
    /// As for wheels, of the wheel separation.
    /// Convention: skid steering makes the effective separation 1.5 to 2.5 times as large, 4 at the most.
    max_separation_ratio: f64 = 4.0,
    /// Relative. A factor is a simple one if it is as near as this.
    /// Convention: wheels are known to a few per cent.
    factor_tolerance: f64 = 0.15,
    /// Relative. A unit that other mistakes are near to is named only if the ratio is as near as this.
    /// Convention: wheels are stated to a per cent.
    unit_tolerance: f64 = 0.01,
    /// Standard deviations by which a verdict on a factor or on two sessions must be certain.
    /// Budgeted: errors that are alike for seconds make standard deviations up to three times too small.
    certain_sigmas: f64 = 8.0,
    /// Factors by which the ticks of a turn are wrong: edges of quadrature, and gears counted or not.
    /// Convention: one, two or four edges of a slot are counted.
    tick_factors: [f64; 8] = [0.125, 0.25, 0.5, 2.0, 4.0, 8.0, 16.0, 0.0625],
    /// Ratios of units of length to the metre's, as a file of them shows: mm, cm, inches, feet.
    /// Derived: from the units.
    length_units: [f64; 4] = [1000.0, 100.0, 39.370_078_740_157_48, 3.280_839_895_013_123],
    /// Relative. Wheels of one robot differ from session to session by less.
    /// Convention: tyres, load and floors change an effective diameter by up to 2 %.
    same_wheel: f64 = 0.03,
    /// Relative. Separations of one robot differ from session to session by less.
    /// Convention: floors and loads change an effective separation by up to 8 %, skid steering more.
    same_separation: f64 = 0.12,
    /// Radians. Headings of the instrument that are nearer to those of the wheels, all of them, are computed
    /// from the wheels.
    /// Convention: no instrument is better than 1e-4, and no robot goes straight so well.
    own_heading_rad: f64 = 1e-4,
    /// Relative. Distances of the instrument that are nearer to those of the wheels are computed from the
    /// wheels.
    /// Convention: wheels are known to a per cent before they are calibrated.
    own_distance: f64 = 1e-3,
    /// Radians. Turns of the instrument from one pose to the next that are nearer to those of the wheels are
    /// computed from the wheels.
    /// Convention: half of what the heading of the best instrument errs by; poses in files of four decimals
    /// keep within it.
    own_step_rad: f64 = 5e-5,
    /// Radians. Least turn of a step that is compared for it.
    /// Derived: wheels that are off by half a per cent miss it by as much as `OWN_STEP_RAD`.
    min_own_step_rad: f64 = 0.01,
    /// Metres. Steps of the path that are compared for it.
    /// Budgeted: files with four decimals round them by a hundredth.
    min_own_step_m: f64 = 5e-3,
    /// Radians. Least turning of a log whose headings are compared with those of the wheels.
    /// Budgeted: a turn, over which wheels err by more than a milliradian.
    min_own_turn_rad: f64 = 3.0,
    /// Rows of a log whose times can be judged.
    /// Convention: logs of a protocol that is read at its ends have two rows a run.
    min_rows: usize = 20,
    /// m/s. A robot whose wheels never go faster, in a log of so long rows, is not logged in seconds.
    /// Convention: robots creep at centimetres a second.
    min_speed_m_s: f64 = 2e-3,
    /// Ratio of truth's time to the log's, over a unit of [`TIME_UNITS`], that makes it one of that unit.
    /// Budgeted: an instrument sees a run for a third of it, or for three times as long.
    clock_unit_ratio: [f64; 2] = [0.3, 3.0],
    /// Units of time, one second in each: milli-, micro- and nanoseconds.
    /// Derived: from the units.
    time_units: [f64; 3] = [1e3, 1e6, 1e9],
    /// Counts, radians or metres a row over the largest usual one, beyond which no wheel goes.
    /// Budgeted: twice the ratio with which outlying rows are found where a fit follows.
    impossible_step_ratio: f64 = 20.0,
    /// Quantile of the steps that are not zero, which is the usual one.
    /// Budgeted: some rows in a hundred may be faulty.
    usual_step_quantile: f64 = 0.95,
    /// Counts. A usual step is taken for at least as large.
    /// Budgeted: a robot that stands or creeps has steps of one count, and then drives off.
    min_usual_counts: f64 = 12.0,
    /// Bits of counters whose wrapping is no restart.
    /// Convention: widths that counters come in.
    counter_bits: [i32; 4] = [8, 16, 24, 32],
    /// Metres. A position that lies farther from those before and after it, which are near each other, is an
    /// error of the instrument.
    /// Budgeted: ten steps of a fast robot at 20 Hz.
    min_outlier_m: f64 = 0.5,
    /// Metres. A position beyond is no measurement.
    /// Convention: rooms are smaller than a thousand kilometres.
    max_position_m: f64 = 1e6,
    /// Radians. Wheels that turn by less, all together, stand.
    /// Budgeted: a hundredth of a turn, above the flicker of a count.
    min_wheel_turn_rad: f64 = 0.06,
    /// Metres. An instrument whose positions lie within such a square has seen nothing move.
    /// Budgeted: noise of instruments; robots that move at all go farther.
    standing_m: f64 = 0.02,
    /// Relative. Precision below which a parameter is not determined.
    /// Convention: nominal values are as good.
    determined_sigma: f64 = 0.05,
    /// Metres. Standard deviation of a distance by tape measure.
    /// Convention: a mark of a pencil at both ends.
    tape_sigma_m: f64 = 2e-3,
    /// Metres. Least length of a straight that is worth a tape.
    /// Budgeted: a tape is then good to 1 %.
    min_taped_m: f64 = 0.2,
    /// Radians. Standard deviation of a heading against a mark on the floor.
    /// Convention: 2 mm over the length of a robot.
    mark_sigma_rad: f64 = 5e-3,
    /// Radians. Standard deviation of a turn by a lidar's readings of a wall.
    /// Convention: what scans of 1 cm make of a wall of some metres.
    wall_sigma_rad: f64 = 2e-3,
    /// Metres. Standard deviation of the distance driven towards a wall.
    /// Convention: as above.
    wall_sigma_m: f64 = 5e-3,
    /// Metres. Standard deviation of a position from outside.
    /// Convention: SLAM of a small room; motion capture is better.
    pose_sigma_m: f64 = 0.02,
    /// Radians. Standard deviation of a heading from outside.
    /// Convention: as above.
    pose_sigma_rad: f64 = 0.02,
    /// Ratio of a gap in a log to its median row, from which on it is said.
    /// Budgeted: an operating system delays by less.
    gap_ratio: f64 = 10.0,
    /// Seconds. Least gap that is said.
    /// Budgeted: robots turn by a radian in it.
    min_gap_s: f64 = 0.5,
    /// Share of rows that are missing, by the median row, from which on it is said.
    /// Convention: one in twenty.
    lost_rows: f64 = 0.05,
    /// Metres. Shortest distance of a session that calibrates anything.
    /// Budgeted: a wheel's turn.
    min_distance_m: f64 = 0.5,
    /// Radians. Turning of all runs of a session from which on its direction is judged.
    /// Budgeted: a square has one turn.
    min_turning_rad: f64 = 5.0,
    /// Radians. A heading that comes back by more has turned the other way.
    /// Budgeted: steering on straights, and the noise of rates, turn a robot by less.
    min_reversal_rad: f64 = 0.2,
    /// Ratio of the wheel separation to the radius of the path, up to which it is straight.
    /// Convention: within a tenth the wheels roll alike.
    max_straight_curvature: f64 = 0.1,
    /// Share of the turning that goes one way, from which on it all does.
    /// Budgeted: corrections of a path's heading are a twentieth of its turns.
    one_way: f64 = 0.95,
    /// Radians. What a gyroscope's turn over a run is off by beside its scale.
    /// Convention: an angle random walk of 1 mrad/√s, coarse for a consumer gyroscope, over two minutes.
    gyro_turn_sigma_rad: f64 = 0.01,
    /// Radians. Turn of a run below which a gyroscope tells the ratio of the wheels whatever its scale.
    /// Convention: a scale that is off by 5 % then errs by the standard deviation of its turn.
    max_straight_turn_rad: f64 = 0.2,
    /// Share of what wheels roll that rounded rates are off by, from which on it is said, and from which on a
    /// calibration is worse for it than people take it to be.
    /// Budgeted: wheels are calibrated to some 1e-4; a tyre's pressure changes them by 5e-4.
    min_rounded_share: f64 = 1e-4,
    /// As said above.
    /// Budgeted: as said above.
    max_rounded_share: f64 = 5e-4,
    /// Relative. Largest standard deviation of a drive that a fit starts from.
    /// Budgeted: steps of a fit are of this size, and a start that is nearer gains nothing.
    max_start_sigma: f64 = 0.1,
    /// Seconds. Length of the windows in which a gyroscope's turns give a separation to start from.
    /// Budgeted: what wheels of a skid-steered robot err by in a window dilutes the separation by a
    /// thirtieth; in half a second by a sixth.
    gyro_window_s: f64 = 2.0,
}

rules::settings! {
    Clocks
    /// Seconds. Offsets of a run's clock are sought up to this, beside the clock of all runs.
    /// Convention: an instrument that is later than a second is another recording.
    max_offset_s: f64 = 1.0,
    /// Seconds. The same of few runs whose clocks are not so near.
    /// Budgeted: time; a run that is later than it is long says nothing of its clock.
    max_far_offset_s: f64 = 20.0,
    /// Seconds. Step of the offsets that are tried.
    /// Budgeted: a parabola through three of them finds the best to a hundredth of a second.
    step_s: f64 = 0.04,
    /// Seconds. Step of those beside the best, between which it is found to a tenth.
    /// Tuned: on 12 logs whose clocks drift by 100 and 500 ppm: steps of 0.04 s alone leave 3 %.
    fine_step_s: f64 = 0.01,
    /// Seconds. A run's own clock is off by this at the least.
    /// Budgeted: smaller offsets leave the fit sound, and compete with effects that resemble them.
    min_own_offset_s: f64 = 0.08,
    /// Standard deviations. A run's own clock is off by as many of its estimate at the least.
    /// Budgeted: errors of rounded turns are alike, and the estimate is less certain than it says.
    min_own_sigmas: f64 = 6.0,
    /// Natural logarithm. Likelihood that an offset or a rate gains at the least.
    /// Tuned: on 907 logs of seeds 63001 to 63003, where coarse counts of slow robots gain up to 26 with no
    /// offset, and clocks that are off hundreds; of 486 logs of 67001 and 67002 two lose a false offset.
    min_gain: f64 = 40.0,
    /// Fraction. Share of the turns and distances between poses that counts leave unexplained where their
    /// clock is right; of counts that leave more, nothing is said.
    /// Budgeted: swapped wheels leave four times what there is.
    max_unexplained: f64 = 0.5,
    /// Fraction. The same share above which poses are taken farther apart.
    /// Budgeted: a tenth, so that errors of poses are a third of what lies between them.
    unexplained: f64 = 0.1,
    /// Radians. Turns between poses below this, root mean square, are noise of headings.
    /// Budgeted: ten times the noise of an ordinary instrument.
    min_turn_rad: f64 = 0.01,
    /// Number. Fewer runs do not say which of them is the odd one.
    /// Derived: of two, either is.
    min_runs: usize = 4,
    /// Number. Of so many runs one may have a clock of its own; where more have, their errors are no clock's.
    /// Convention: one in ten.
    min_runs_per_odd: usize = 10,
    /// Ratio to the fastest wheel of the run. A robot whose wheels are slower in the first row sets off
    /// there, and one whose are in the last row comes to rest.
    /// Budgeted: a row of 50 ms of a robot that takes half a second to its speed has a twentieth on average.
    max_rate_at_rest: f64 = 0.1,
    /// Number. Fewer pairs of poses do not say an offset.
    /// Budgeted: three seconds at ten a second.
    min_pairs: usize = 30,
    /// Number. Of more pairs of poses in a run, so many are taken.
    /// Budgeted: a run takes a millisecond.
    max_pairs: usize = 600,
    /// Number. A drift of the clocks is sought between so many parts of a run at the most.
    /// Budgeted: a clock that is off by a hundredth is off by less than a second within one of ten minutes.
    parts_per_run: usize = 8,
    /// Number. Poses of a part at the least.
    /// Budgeted: twice the pairs that an offset needs.
    min_part_poses: usize = 60,
    /// Number. Fewer parts do not say that an offset grows evenly.
    /// Derived: through two goes a line, and of three one may be off.
    min_drift_parts: usize = 4,
    /// Number. Of more parts so many are taken.
    /// Budgeted: two thousand lines go through pairs of them.
    max_drift_parts: usize = 64,
    /// Seconds a second. No clock drifts by more.
    /// Convention: the upper end of what users report is 3 %.
    max_rate: f64 = 0.05,
    /// Number. Times that a drift is set right, and what is left is sought again.
    /// Budgeted: a line through the first half of a log leaves a third of the drift, and the next one a
    /// hundredth.
    max_drift_steps: usize = 4,
}

rules::rooms! {
    clocks: Clocks as CLOCKS,
    checks: Checks as CHECKS,
}
