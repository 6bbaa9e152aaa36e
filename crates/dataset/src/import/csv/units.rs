//! The units of wheels and positions, where no name says them: the odds of each reading, by how far the
//! wheels of the stated robot and the poses reach, and by the speeds and distances that robots drive.
//!
//! Model: the logarithm of the ratio of both reaches is normal about 0. Of most robots the stated lengths are
//! right within a few per cent; of some they are not at all, so that the tails are wide (a mixture of three
//! widths). Priors are what people log in. Units that differ by a small factor need more than the odds of a
//! robot that is stated wrongly.

use super::angles::angle_unit;
use super::columns::known_or;
use super::drive::{Drive, WheelUnits, dead_reckoned, wheel_candidates};
use super::gyro;
use super::options::Options;
use super::runs::{Part, RawRun};
use super::times::seconds;
use super::took::{Basis, Confidence};
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::unit::Unit;

use kinematics::Pose;

/// Odds from which on a reading is taken.
const MIN_ODDS: f64 = 20.0;

/// Odds from which on a reading is taken against one that differs by less than [`SMALL_FACTOR`]. Derived: a
/// robot whose stated wheels are right within 5 % has 130 to 1 against a factor of 9.55; one that is stated
/// wrongly by a factor never has more than 60 to 1.
const MIN_ODDS_OF_SMALL_FACTOR: f64 = 100.0;

/// Factors below are those of units that a wrongly stated robot may pass for: rpm and rad/s 9.55, degrees and
/// counts, inches and centimetres 2.54, km/h and m/s 3.6.
const SMALL_FACTOR: f64 = 12.0;

/// From here on a user should look, though the units are known: counts of a turn are mistaken by a factor of
/// 2 or 4, diameters and radii by 2.
const MAX_USUAL_EXTENT_RATIO: f64 = 1.5;

/// Below this reach, metres, wheels say nothing of the unit of length: a spin wanders so far.
const MIN_EXTENT_M: f64 = 0.1;

/// How far the poses of a robot reach that hardly drives, metres, and the logarithm's width.
const IDLE_EXTENT_M: f64 = 0.02;
const IDLE_LOG_SIGMA: f64 = 1.5;

/// Widths of the logarithm of the ratio of both reaches, and the shares of robots that have them: stated by a
/// data sheet, by a ruler, or by guess.
const LOG_RATIO: [(f64, f64); 3] = [(0.3, 0.01), (0.3, 0.05), (0.4, 1.0)];

/// Mean speed of a wheeled robot while it moves, and how far from its start it goes: from a table to a field.
const SPEEDS_M_S: std::ops::RangeInclusive<f64> = 0.01..=10.0;
const EXTENTS_M: std::ops::RangeInclusive<f64> = 0.05..=2000.0;

/// Logarithm of how much less likely a speed or an extent is that no usual robot has, and for each factor e
/// beyond.
const UNUSUAL: f64 = -3.0;

/// The units of one part's columns.
#[derive(Debug, Clone)]
pub(super) struct Units {
    pub(super) wheels: WheelUnits,
    pub(super) wheels_by: Basis,
    pub(super) length: Unit,
    pub(super) length_by: Basis,
    pub(super) angle: Unit,
    pub(super) angle_by: Basis,
    /// The gyroscope's; `None`: there is none, or its rates are left out.
    pub(super) gyro: Option<(Unit, Basis)>,
    pub(super) remarks: Vec<String>,
}

/// One reading of the columns.
struct Reading<'a> {
    wheels: WheelUnits,
    length: Unit,
    /// How many times as far as by the wheels the poses reach; `None` of a robot that hardly drives.
    ratio: Option<f64>,
    log_odds: f64,
    /// Poses by the wheels, a run each.
    poses: &'a [Vec<Pose>],
}

/// What people log in.
fn log_prior(wheels: WheelUnits, length: Unit) -> f64 {
    let of_length: f64 = match length {
        Unit::M => 0.55,
        Unit::Mm => 0.35,
        Unit::Cm => 0.07,
        _ => 0.03,
    };
    let of_wheels: f64 = match wheels.of_wheels() {
        Some(Unit::Ticks | Unit::Rad) => 0.8,
        Some(Unit::RadPerS | Unit::MPerS) => 0.4,
        Some(Unit::Rpm) => 0.2,
        Some(Unit::TicksPerRow) => 0.01,
        _ => 0.1,
    };
    of_length.ln() + of_wheels.ln()
}

fn log_density_of_ratio(ratio: f64) -> f64 {
    let of = |(share, sigma): (f64, f64)| share / sigma * (-0.5 * (ratio.ln() / sigma).powi(2)).exp();
    // Far out the narrow ones are nothing, and the wide one still is not.
    LOG_RATIO.into_iter().map(of).sum::<f64>().max(f64::MIN_POSITIVE).ln()
}

fn log_of_range(value: f64, usual: &std::ops::RangeInclusive<f64>) -> f64 {
    let beyond = (value / usual.end()).max(if value > 0.0 { usual.start() / value } else { 0.0 });
    if beyond <= 1.0 || !beyond.is_finite() { 0.0 } else { UNUSUAL * (1.0 + beyond.ln()) }
}

/// The largest distance from the first of some positions.
fn extent_m(positions: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut positions = positions.peekable();
    let Some(&(x, y)) = positions.peek() else { return 0.0 };
    positions.map(|position| (position.0 - x).hypot(position.1 - y)).fold(0.0, f64::max)
}

/// How many times as far the poses of the runs go as the wheels do, in units of the poses by metres: in
/// pieces of the runs, so that errors of the turns do not count. A piece weighs by its length by the wheels:
/// of spins, in which an instrument beside the centre goes round, nothing counts.
fn ratio_of_pieces(parts: &[Part], runs: &[RawRun], poses: &[Vec<Pose>]) -> f64 {
    /// Pieces of a run: each turns little, and is long against the noise of positions.
    const PIECES: usize = 32;
    let (mut product, mut square) = (0.0, 0.0);
    for (run, poses) in runs.iter().zip(poses) {
        let Some(seen) = &parts[run.truth_part].log.pose else { continue };
        let rows = &run.truth_rows[..poses.len().min(run.truth_rows.len())];
        let Some(last) = rows.len().checked_sub(1) else { continue };
        let step = (last / PIECES).max(1);
        let ends: Vec<usize> = (0..=last).step_by(step).collect();
        for pair in ends.windows(2) {
            let ([a, b], [from, to]) = ([rows[pair[0]], rows[pair[1]]], [poses[pair[0]], poses[pair[1]]]);
            let of_poses = (seen.x[b] - seen.x[a]).hypot(seen.y[b] - seen.y[a]);
            let of_wheels_m = (to.x_m - from.x_m).hypot(to.y_m - from.y_m);
            product += of_poses * of_wheels_m;
            square += of_wheels_m * of_wheels_m;
        }
    }
    product / square
}

/// Mean speed of the wheels while they move, and the one that they exceed in a hundredth of the rows, m/s.
fn speeds_m_s(parts: &[Part], runs: &[RawRun], wheels: WheelUnits, drive: &Drive) -> Option<[f64; 2]> {
    let (mut distance_m, mut time_s, mut speeds_m_s) = (0.0, 0.0, Vec::new());
    for run in runs {
        let part = &parts[run.part];
        let increments = drive.increments(part, &run.rows, wheels);
        for (pair, increment) in run.rows.windows(2).zip(increments.iter().skip(1)) {
            let half_base_m = 0.5 * drive.geometry.wheel_separation_m();
            let of_wheels_m = increment.distance_m.abs().max(increment.turn_rad.abs() * half_base_m);
            let dt_s = seconds(part.log.time[pair[0]], part.log.time[pair[1]]);
            if of_wheels_m > 0.0 && dt_s > 0.0 {
                distance_m += of_wheels_m;
                time_s += dt_s;
                speeds_m_s.push(of_wheels_m / dt_s);
            }
        }
    }
    let index = speeds_m_s.len().checked_sub(1)? * 99 / 100;
    let (_, fast_m_s, _) = speeds_m_s.select_nth_unstable_by(index, f64::total_cmp);
    Some([distance_m / time_s, *fast_m_s])
}

/// Decides the units of the wheels of one part and of the poses that saw its runs.
pub(super) fn units(parts: &[Part], runs: &[RawRun], options: &Options, drive: &Drive) -> Result<Units, DatasetError> {
    let (part, truth) = (&parts[runs[0].part], &parts[runs[0].truth_part]);
    let (wheels, mut wheels_by) = wheel_candidates(part, options);
    let (lengths, mut length_by) = match truth.roles.of.get(&Quantity::X) {
        Some(chosen) => known_or(chosen, options.length_unit, "--length-unit", &Unit::LENGTHS),
        None => (vec![Unit::M], Basis::new(Confidence::Certain, "no poses")),
    };
    let by_unit: Vec<(WheelUnits, Vec<Vec<Pose>>)> = wheels
        .iter()
        .map(|&units| (units, runs.iter().map(|run| dead_reckoned(parts, run, units, drive)).collect()))
        .collect();
    let mut readings: Vec<Reading<'_>> = Vec::new();
    for (units, poses) in &by_unit {
        let (mut seen, mut dead_reckoned_m) = (0.0, 0.0);
        for (run, poses) in runs.iter().zip(poses) {
            let pose = parts[run.truth_part].log.pose.as_ref();
            let position = |&row: &usize| pose.map(|pose| (pose.x[row], pose.y[row]));
            seen += extent_m(run.truth_rows.iter().take(poses.len()).filter_map(position));
            dead_reckoned_m += extent_m(poses.iter().map(|pose| (pose.x_m, pose.y_m)));
        }
        let of_speed = speeds_m_s(parts, runs, *units, drive).map_or(0.0, |[mean_m_s, fast_m_s]| {
            log_of_range(mean_m_s, &SPEEDS_M_S).min(log_of_range(fast_m_s, &(0.0..=*SPEEDS_M_S.end())))
        });
        let ratio = ratio_of_pieces(parts, runs, poses);
        for &length in &lengths {
            let seen_m = length.to_si(seen);
            let ratio = length.to_si(ratio);
            let ratio = (dead_reckoned_m >= MIN_EXTENT_M && ratio > 0.0 && ratio.is_finite()).then_some(ratio);
            let of_extent = match ratio {
                Some(ratio) => log_density_of_ratio(ratio) + log_of_range(seen_m, &EXTENTS_M),
                None if seen > 0.0 => -0.5 * ((seen_m / IDLE_EXTENT_M).ln() / IDLE_LOG_SIGMA).powi(2),
                None => 0.0,
            };
            let log_odds = log_prior(*units, length) + of_speed + of_extent;
            readings.push(Reading { wheels: *units, length, ratio, log_odds, poses });
        }
    }
    readings.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    let best = &readings[0];
    let open: Vec<&Reading<'_>> = readings[1..].iter().filter(|rival| !is_clear(best, rival)).collect();
    if !open.is_empty() {
        return Err(undecided(part, truth, best, &open));
    }
    let mut remarks = Vec::new();
    let against = readings.get(1).map(|rival| {
        let name = name(rival, rival.wheels != best.wheels, rival.length != best.length);
        format!("odds {} against {name}", odds(best.log_odds - rival.log_odds))
    });
    let of_extent = best.ratio.map(|ratio| format!("poses reach {ratio:.3} times as far as wheels"));
    let why: Vec<String> = of_extent.into_iter().chain(against).collect();
    if lengths.len() > 1 {
        length_by = Basis::new(Confidence::Likely, why.join(", "));
    }
    if wheels.len() > 1 {
        let why = if length_by.why == why.join(", ") { why[..why.len() - 1].join("") } else { why.join(", ") };
        let of_name = Some(wheels_by.why).filter(|why| !why.is_empty()).map(|by| format!("{by}; "));
        wheels_by = Basis::new(Confidence::Likely, of_name.unwrap_or_default() + &why);
    }
    if let Some(ratio) = best.ratio
        && !(1.0 / MAX_USUAL_EXTENT_RATIO..=MAX_USUAL_EXTENT_RATIO).contains(&ratio)
    {
        remarks.push(format!(
            "the poses reach {ratio:.3} times as far as the wheels by the nominal robot; look at the units, --wheel and --ticks-per-rev"
        ));
    }
    if options.cut_s.is_some() && wheels.len() > 1 && best.wheels.of_wheels().is_some_and(Unit::is_per_row) {
        return Err(DatasetError::Undecided {
            file: part.sheet.file.clone(),
            what: "a standstill for --cut".to_owned(),
            readings: "rows that say the same or rows of zeros, as the wheels are likely counted a row".to_owned(),
            flag: "--wheel-unit ticks/row or --wheel-unit ticks".to_owned(),
        });
    }
    let (angle, angle_by) = angle_unit(parts, runs, options, best.poses)?;
    let turns_rad: Vec<Vec<f64>> = runs
        .iter()
        .map(|run| drive.increments(&parts[run.part], &run.rows, best.wheels).iter().map(|by| by.turn_rad).collect())
        .collect();
    let is_needed = !truth.roles.has_pose() && options.tape.is_none();
    let gyro = gyro::unit(parts, runs, &turns_rad, is_needed, &mut remarks)?;
    Ok(Units { wheels: best.wheels, wheels_by, length: best.length, length_by, angle, angle_by, gyro, remarks })
}

/// Whether a reading is to be taken against another.
fn is_clear(best: &Reading<'_>, rival: &Reading<'_>) -> bool {
    let are_lengths = [Unit::M, Unit::Mm];
    // No robot drives a thousand times as far as its wheels say.
    if best.wheels == rival.wheels
        && best.ratio.is_some()
        && [best.length, rival.length].iter().all(|unit| are_lengths.contains(unit))
    {
        return true;
    }
    let factor = best.ratio.zip(rival.ratio).map(|(best, rival)| (best / rival).max(rival / best));
    let needed = if factor.is_some_and(|factor| factor < SMALL_FACTOR) { MIN_ODDS_OF_SMALL_FACTOR } else { MIN_ODDS };
    best.log_odds - rival.log_odds >= needed.ln()
}

fn odds(log_odds: f64) -> String {
    /// Odds are no better known than that.
    const MOST: f64 = 1e6;
    let odds = log_odds.exp();
    if odds > MOST { "above a million to 1".to_owned() } else { format!("{odds:.0} to 1") }
}

fn name(reading: &Reading<'_>, of_wheels: bool, of_length: bool) -> String {
    match (of_wheels, of_length) {
        (true, true) => format!("{} with x, y in {}", reading.wheels.name(), reading.length.name()),
        (true, false) => {
            reading.wheels.of_wheels().map_or_else(|| reading.wheels.name(), |unit| unit.name().to_owned())
        }
        (false, _) => reading.length.name().to_owned(),
    }
}

fn undecided(part: &Part, truth: &Part, best: &Reading<'_>, open: &[&Reading<'_>]) -> DatasetError {
    /// So many readings are shown.
    const SHOWN: usize = 4;
    let all = || std::iter::once(best).chain(open.iter().copied()).take(SHOWN);
    let of_wheels = all().any(|reading| reading.wheels != best.wheels);
    let of_length = all().any(|reading| reading.length != best.length);
    let described = |reading: &Reading<'_>| {
        let ratio =
            reading.ratio.map_or("hardly drives".to_owned(), |ratio| format!("poses reach {ratio:.3} times as far"));
        let odds = odds(best.log_odds - reading.log_odds);
        let odds = if std::ptr::eq(reading, best) { String::new() } else { format!(", {odds} against it") };
        format!("{} ({ratio}{odds})", name(reading, of_wheels, of_length))
    };
    let mut flags: Vec<String> = Vec::new();
    for reading in all() {
        let of_wheels =
            reading.wheels.of_wheels().filter(|_| of_wheels).map(|unit| format!("--wheel-unit {}", unit.name()));
        let of_length = of_length.then(|| format!("--length-unit {}", reading.length.name()));
        flags.push(of_wheels.into_iter().chain(of_length).collect::<Vec<_>>().join(" "));
    }
    let why = if best.ratio.is_none() {
        " (the robot does not go far enough to tell)"
    } else {
        " (compared with the wheels of the stated robot)"
    };
    DatasetError::Undecided {
        file: if of_wheels { part.sheet.file.clone() } else { truth.sheet.file.clone() },
        what: format!("the unit of {}{why}", if of_wheels { "the wheels" } else { "x and y" }),
        readings: all().map(described).collect::<Vec<_>>().join(" or "),
        flag: flags.join(" or "),
    }
}
