//! All words: ids, sentences and what mends a problem.

use kinematics::Side;

use crate::kind::{Kind, MirroredAxis};
use crate::settings::CHECKS;
use crate::shown_numbers::{times, to_ms};

/// The problem's name in JSON and in docs/check.md.
pub(crate) fn id(kind: &Kind) -> &'static str {
    match kind {
        Kind::NothingMoves { .. } => "nothing_moves",
        Kind::TruthUnrelated { .. } => "truth_unrelated",
        Kind::TimeInMilliseconds { .. } => "time_in_milliseconds",
        Kind::TruthTimeUnit { .. } => "truth_time_unit",
        Kind::ClockOffset { .. } => "clock_offset",
        Kind::ClockRate { .. } => "clock_drift",
        Kind::HeadingInDegrees => "heading_in_degrees",
        Kind::HeadingClockwise => "heading_clockwise",
        Kind::AxesMirrored { axis: MirroredAxis::Exchanged } => "axes_exchanged",
        Kind::AxesMirrored { .. } => "axis_mirrored",
        Kind::WheelsExchanged { .. } => "wheels_exchanged",
        Kind::WheelBackwards { .. } => "wheel_backwards",
        Kind::Record(fault) => fault.id(),
        Kind::LengthUnit { of_truth: true, .. } => "truth_length_unit",
        Kind::LengthUnit { .. } => "robot_length_unit",
        Kind::TicksPerTurn { .. } => "ticks_per_turn",
        Kind::OtherRobot { .. } => "other_robot",
        Kind::SeveralRobots { .. } => "several_robots",
        Kind::TruthIsOdometry => "truth_is_odometry",
        Kind::TruthFollowsOdometry { .. } => "truth_follows_odometry",
        Kind::CounterSpike { .. } => "counter_spike",
        Kind::CounterRestart { .. } => "counter_restart",
        Kind::TruthOutlier { .. } => "truth_outlier",
        Kind::InstantRates => "instant_rates",
        Kind::RoundedRates { .. } => "rounded_rates",
        Kind::Gap { .. } => "log_gap",
        Kind::RowsInPackets { .. } => "rows_in_packets",
        Kind::LostRows { .. } => "lost_rows",
        Kind::TooShort { .. } => "too_short",
        Kind::OneWayTurns { .. } => "one_way_turns",
        Kind::NotDetermined { .. } => "not_determined",
        Kind::UnusedMeasurements { .. } => "unused_measurements",
    }
}

/// Names of the units of time.
const TIME_UNIT_NAMES: [&str; 3] = ["milliseconds", "microseconds", "nanoseconds"];

/// What a person reads: what, where, what to do.
pub(crate) fn sentence(kind: &Kind, runs: Option<&[String]>) -> String {
    let place = place(runs);
    let what = match kind {
        Kind::NothingMoves { wheels_turn_rad, truth_extent_m } => nothing_moves(*wheels_turn_rad, *truth_extent_m),
        Kind::TruthUnrelated { unexplained } => format!(
            "the truth does not follow the wheels: {:.0} % of its motion is not explained by theirs, at any clock offset that was tried; check that both tables are of the same drives",
            100.0 * unexplained
        ),
        Kind::TimeInMilliseconds { row } => format!(
            "t_s is in milliseconds: rows lie {row:.0} \"seconds\" apart; divide the times of all tables by 1000"
        ),
        Kind::TruthTimeUnit { unit, of_truth } => truth_time_unit(*unit, *of_truth),
        Kind::ClockOffset { offset_s, sigma_s } => clock_offset(*offset_s, *sigma_s),
        Kind::ClockRate { rate, of_session } => clock_rate(*rate, *of_session),
        Kind::HeadingInDegrees => "theta_rad of truth.csv is in degrees; multiply it by π/180".to_owned(),
        Kind::HeadingClockwise => {
            "theta_rad of truth.csv counts clockwise; it is counter-clockwise positive: change its sign".to_owned()
        }
        Kind::AxesMirrored { axis } => axes_mirrored(*axis),
        Kind::WheelsExchanged { label } => wheels_exchanged(*label).to_owned(),
        Kind::WheelBackwards { sides } => match &sides[..] {
            [side] => format!("the {} wheel counts backwards; change the sign of its column", side.name()),
            _ => "both wheels count backwards; change the sign of both columns".to_owned(),
        },
        Kind::Record(fault) => fault.sentence(),
        Kind::LengthUnit { ratio, unit, of_truth } => length_unit(*ratio, *unit, *of_truth),
        Kind::TicksPerTurn { ratio, stated, simple } => ticks_per_turn(*ratio, *stated, *simple),
        Kind::OtherRobot { parameter, ratio } => {
            format!("{parameter} is {} what dataset.toml states; correct it, or check the log's columns", times(*ratio))
        }
        Kind::SeveralRobots { parameter, sessions, values_m } => several_robots(parameter, sessions, *values_m),
        Kind::TruthIsOdometry => {
            "the truth is computed from the wheels: it follows nominal dead reckoning closer than any instrument could; give what an outside instrument measured".to_owned()
        }
        Kind::TruthFollowsOdometry { share } => format!(
            "the truth moves by the wheels between its corrections: in {:.0} % of its turning steps the turn is that of nominal dead reckoning to 5e-5 rad, as in poses of SLAM or AMCL that odometry carries on; the calibration leans towards the nominal values: give the poses at the corrections alone, or poses of scan matching without the wheels",
            100.0 * share
        ),
        Kind::CounterSpike { side, t_s, count, rows } => counter_spike(*side, *t_s, *count, *rows),
        Kind::CounterRestart { side, t_s } => format!(
            "the {} counter starts again from 0 at t = {} s; cut the run there into two runs",
            side.name(),
            to_ms(*t_s)
        ),
        Kind::TruthOutlier { t_s, distance_m, rows } => truth_outlier(*t_s, *distance_m, *rows),
        Kind::InstantRates => {
            "v_mps and omega_radps are of the instant; a row's rates are to be those of the interval that ends there; average each row with the one before".to_owned()
        }
        Kind::RoundedRates { step, share } => format!(
            "the recorded speeds are in steps of {step}: what a wheel rolls is known to {:.2} % while the robot drives evenly, and longer drives do not average that out; record counts, or more decimals",
            100.0 * share
        ),
        Kind::Gap { t_s, length_s } => format!(
            "the log has a gap of {length_s:.2} s after t = {} s; say continuous = false under its [[run]], or cut it there",
            to_ms(*t_s)
        ),
        Kind::RowsInPackets { rows } => format!(
            "the log's rows are sent {rows} at a time and stamped on receipt: their times do not say when the wheels were read"
        ),
        Kind::LostRows { share } => format!("{:.0} % of the log's rows are missing", 100.0 * share),
        Kind::TooShort { distance_m } => format!(
            "the runs are too short: the wheels cover {distance_m:.2} m in all; drive some metres, straight and round both ways"
        ),
        Kind::OneWayTurns { left } => format!(
            "all turns go {}; drive both ways round, or unequal wheels and a wrong wheel separation look alike",
            if *left { "left" } else { "right" }
        ),
        Kind::NotDetermined { parameters, why } => {
            format!("these runs do not determine {}: {why}", parameters.join(", "))
        }
        Kind::UnusedMeasurements { gyro_alone } => format!(
            "the run's displacements are used, and not its {}, which says less of the same motion; to calibrate from that, leave the run's displacements out",
            if *gyro_alone { "gyro" } else { "gyro, tapes, walls or returns" }
        ),
    };
    format!("{place}{what}")
}

fn nothing_moves(wheels_turn_rad: f64, truth_extent_m: Option<f64>) -> String {
    match truth_extent_m {
        Some(extent_m) => format!(
            "the wheels turn by {} turns but the instrument sees the robot within {:.0} mm; record both while the robot drives",
            turns(wheels_turn_rad),
            1e3 * extent_m
        ),
        None => "nothing moves: the wheels do not turn; record while the robot drives".to_owned(),
    }
}

fn truth_time_unit(unit: usize, of_truth: bool) -> String {
    let (table, other) = if of_truth { ("truth.csv", "odometry.csv") } else { ("odometry.csv", "truth.csv") };
    let (name, factor) = (TIME_UNIT_NAMES[unit], CHECKS.time_units[unit]);
    format!("t_s of {table} is in {name}, that of {other} in seconds; divide the times of {table} by {factor}")
}

fn clock_offset(offset_s: f64, sigma_s: f64) -> String {
    format!(
        "the truth is {:.3} s ± {sigma_s:.3} s {} against the log: the clocks are apart; shift truth's times by {:+.3} s",
        offset_s.abs(),
        if offset_s > 0.0 { "late" } else { "early" },
        -offset_s
    )
}

fn clock_rate(rate: f64, of_session: bool) -> String {
    let way = if rate > 0.0 { "fast" } else { "slow" };
    if of_session {
        let ppm = 1e6 * rate.abs();
        return format!(
            "truth's clock runs {ppm:.0} ppm {way} against the log's from the start of the session on; calibrate undoes that"
        );
    }
    format!(
        "truth's clock runs {:.2} % {way} against the log's, and wheels come out as wrong; multiply truth's times by {:.5}",
        100.0 * rate.abs(),
        1.0 / (1.0 + rate)
    )
}

fn axes_mirrored(axis: MirroredAxis) -> String {
    let what = match axis {
        MirroredAxis::Exchanged => "x_m and y_m of truth.csv are exchanged",
        MirroredAxis::X => "x_m of truth.csv has the wrong sign",
        MirroredAxis::Y => "y_m of truth.csv has the wrong sign",
    };
    format!("{what}: the path turns the other way than the headings; y is to the left of x")
}

const fn wheels_exchanged(label: Option<bool>) -> &'static str {
    match label {
        Some(true) => {
            "left and right wheel are exchanged in the log: the truth turns as the protocol says, the wheels the other way"
        }
        Some(false) => {
            "the truth is mirrored: the wheels turn as the protocol says, the truth the other way; change the sign of y_m and theta_rad"
        }
        None => {
            "left and right wheel are exchanged in the log, or the truth is mirrored: every turn goes the other way; exchange the wheels' columns, or change the sign of y_m and theta_rad"
        }
    }
}

fn length_unit(ratio: f64, unit: Option<&str>, of_truth: bool) -> String {
    let (what, how) = if of_truth {
        ("x_m and y_m of the truth are", ratio)
    } else {
        ("the lengths under [robot] in dataset.toml are", 1.0 / ratio)
    };
    match unit {
        Some(unit) => format!("{what} in {unit} instead of metres; divide them by {how:.4}"),
        None => format!("{what} {} what the rest of the dataset says; check the unit", times(how)),
    }
}

fn ticks_per_turn(ratio: f64, stated: Option<f64>, simple: bool) -> String {
    let value = ticks_per_rev(stated, ratio).map_or_else(String::new, |found| format!(": near {found:.0}"));
    let cause = match (simple, stated.is_some()) {
        (true, true) => "ticks_per_rev is wrong by a simple factor, or a radius is stated for a diameter",
        (true, false) => "a radius is stated for a diameter, or the other way round; or the wheels turn by a gear",
        (false, true) => "check ticks_per_rev and the wheels' diameters",
        (false, false) => "check the wheels' diameters",
    };
    format!("both wheels are {} as large as stated; {cause}{value}", times(ratio))
}

fn several_robots(parameter: &str, [first, second]: &[String; 2], values_m: [f64; 2]) -> String {
    let [first_mm, second_mm] = values_m.map(|value_m| 1e3 * value_m);
    format!(
        "the sessions are of different robots: {parameter} is {first_mm:.2} mm in {first} and {second_mm:.2} mm in {second}; calibrate them apart"
    )
}

fn counter_spike(side: Side, t_s: f64, count: f64, rows: usize) -> String {
    let more = if rows > 1 { format!(", as in {} more rows", rows - 1) } else { String::new() };
    let (side, t_s) = (side.name(), to_ms(t_s));
    format!("the {side} counter shows {count} at t = {t_s} s and comes back in the next row{more}; delete such rows")
}

fn truth_outlier(t_s: f64, distance_m: f64, rows: usize) -> String {
    let more = if rows > 1 { format!(", and {} more rows likewise", rows - 1) } else { String::new() };
    format!("the truth jumps by {distance_m:.3e} m at t = {} s and comes back{more}; delete such rows", to_ms(t_s))
}

/// Turns as people read them.
fn turns(rad: f64) -> String {
    let turns = rad / std::f64::consts::TAU;
    if turns < 1e6 { format!("{turns:.1}") } else { "more than a million".to_owned() }
}

/// Counts a revolution that would mend a ratio; `None` where none would.
fn ticks_per_rev(stated: Option<f64>, ratio: f64) -> Option<f64> {
    stated.map(|stated| (stated / ratio).round()).filter(|ticks| (1.0..f64::MAX).contains(ticks))
}

/// At most so many runs are named one by one.
fn place(runs: Option<&[String]>) -> String {
    match runs {
        None | Some([]) => String::new(),
        Some([run]) => format!("run \"{run}\": "),
        Some([first, second]) => format!("runs \"{first}\" and \"{second}\": "),
        Some([first, rest @ ..]) => format!("run \"{first}\" and {} more: ", rest.len()),
    }
}

/// The key of `dataset.toml` that mends a problem.
pub(crate) fn fix(kind: &Kind) -> Option<String> {
    let corrections = |what: String| Some(format!("[corrections] {what}"));
    match kind {
        Kind::TimeInMilliseconds { .. } => corrections("time_factor = 0.001".to_owned()),
        Kind::TruthTimeUnit { unit, of_truth: true } => {
            corrections(format!("truth_time_factor = {}", CHECKS.time_units[*unit].recip()))
        }
        Kind::ClockOffset { offset_s, .. } => corrections(format!("truth_shift_s = {:.3}", -offset_s)),
        Kind::ClockRate { rate, of_session: true } => corrections(format!("truth_clock_rate = {rate:.6}")),
        Kind::ClockRate { rate, .. } => corrections(format!("truth_time_factor = {:.5}", 1.0 / (1.0 + rate))),
        Kind::HeadingInDegrees => corrections("heading_in_degrees = true".to_owned()),
        Kind::HeadingClockwise => corrections("heading_clockwise = true".to_owned()),
        Kind::AxesMirrored { axis } => corrections(
            match axis {
                MirroredAxis::Exchanged => "exchange_axes = true",
                MirroredAxis::X => "mirror_x = true",
                MirroredAxis::Y => "mirror_y = true",
            }
            .to_owned(),
        ),
        Kind::WheelsExchanged { label: Some(false) } => corrections("mirror_truth = true".to_owned()),
        Kind::WheelsExchanged { .. } => corrections("exchange_wheels = true".to_owned()),
        Kind::WheelBackwards { sides } => {
            let key = |side: &Side| format!("reverse_{}_wheel = true", side.name());
            corrections(sides.iter().map(key).collect::<Vec<_>>().join(", "))
        }
        Kind::LengthUnit { ratio, of_truth: true, unit: Some(_) } => {
            corrections(format!("truth_length_factor = {}", 1.0 / ratio))
        }
        Kind::TicksPerTurn { ratio, stated, .. } => {
            ticks_per_rev(*stated, *ratio).map(|ticks| format!("[robot] ticks_per_rev = {ticks:.0}"))
        }
        Kind::RowsInPackets { .. } => corrections("restore_read_times = true".to_owned()),
        Kind::InstantRates => corrections("instant_rates = true".to_owned()),
        Kind::Gap { .. } => Some("[[run]] continuous = false".to_owned()),
        Kind::SeveralRobots { .. } => Some("--force".to_owned()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_of_absurd_units_has_a_number_or_a_bound() {
        let shown = [1.015, 0.5, 12345.0, 1e9, 1e-9, f64::INFINITY, 0.0].map(times);
        let expected = ["1.015", "0.500", "12345.000", "1.00e9", "1.00e-9", "more than 1e308", "less than 1e-307"];
        assert_eq!(shown, expected.map(|number| format!("{number} times")));
        // Found by fuzzing: truth in units of 1e300 m made of a wheel "inf times what dataset.toml states".
        for ratio in [f64::INFINITY, 1e300, 0.0, 1e-300] {
            let kinds = [
                Kind::OtherRobot { parameter: "left_wheel_diameter_m", ratio },
                Kind::LengthUnit { ratio, unit: None, of_truth: true },
                Kind::LengthUnit { ratio, unit: None, of_truth: false },
                Kind::TicksPerTurn { ratio, stated: Some(4096.0), simple: false },
            ];
            for kind in kinds {
                let said = format!("{} {}", sentence(&kind, None), fix(&kind).unwrap_or_default());
                let has = |word: &str| said.split(|letter: char| !letter.is_alphanumeric()).any(|of| of == word);
                assert!(!has("inf") && !has("NaN") && !said.contains("ticks_per_rev = 0"), "{said}");
            }
        }
        let kind = Kind::TicksPerTurn { ratio: 2.0, stated: Some(4096.0), simple: true };
        assert_eq!(fix(&kind).as_deref(), Some("[robot] ticks_per_rev = 2048"));
    }
}
