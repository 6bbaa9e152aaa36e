//! The dataset of a bag, and what was taken for what.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use dataset::import::csv::{Rates, RobotGiven};
use dataset::{
    Dataset, ExtraChannel, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
    moving_pieces, recognise_protocols, wrap_warnings,
};
use kinematics::{DriveGeometry, Wheels};

use crate::bag::Bag;
use crate::choice::{self, Reference};
use crate::clock::{self, Clock, Times, seconds};
use crate::error::RosBagError;
use crate::gyro::IMU;
use crate::gyro_column::GyroColumn;
use crate::recorded::recorded;
use crate::rows::{self, BothRows, GyroRows, Others, RECEIPT_MARGIN_S, Rows, WheelRows, WheelSource};
use crate::scan_walls::{self, RunSpan};
use crate::took::Took;
use crate::topics::{Survey, Topic};
use crate::truth::{self, TruthReader, TruthReading};
use crate::wheel_pair::{Resampling, WheelPair};
use crate::wheels::{WheelFields, WheelQuantity, WheelReader};

/// Largest tilt of the instrument's poses that the plane bears, radians: at 10° a length in the plane is
/// 1.5 % short (1 − cos 10°), more than what calibration looks for.
const MAX_TILT_RAD: f64 = 10.0 * PI / 180.0;
/// Largest count that a double holds exactly.
const LARGEST_COUNT: f64 = 9_007_199_254_740_992.0;
/// Angles that are wrapped exceed half a turn, or a turn, by rounding alone, radians.
const WRAPPED_MARGIN_RAD: f64 = 1e-3;
/// Poses that all have the same heading are of an instrument of positions if they reach so far in both
/// directions, metres: a robot that drives on a straight alone does so in one of its own.
const MIN_EXTENT_M: f64 = 0.3;
/// Speeds say nothing of the motion in a gap; this long it is metres, seconds.
const MAX_GAP_OF_RATES_S: f64 = 1.0;

/// All that a user may say.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Topic of the wheels, or `LEFT_TOPIC[.field],RIGHT_TOPIC[.field]`.
    pub wheels: Option<String>,
    /// Topic of the poses of an outside instrument; `none` where wheels and a gyroscope are all there is.
    pub truth: Option<String>,
    /// Topic of the scans of a lidar in which walls are sought; where none is said, the only one of a bag
    /// that has no poses.
    pub scan: Option<String>,
    /// Topic of a gyroscope's rates; where nothing is said, the only one of the bag; `none` leaves it out.
    pub gyro: Option<String>,
    /// Which joints or fields are the wheels.
    pub fields: WheelFields,
    /// Parent and child frame of the poses, in a topic of transforms.
    pub truth_frames: Option<(String, String)>,
    /// Files that define types which the bag itself does not: `…/PACKAGE/msg/TYPE.msg`, or
    /// `PACKAGE/TYPE=FILE`. Usual types are known.
    pub definitions: Vec<PathBuf>,
    /// What a speed holds for.
    pub rates: Option<Rates>,
    /// Runs are cut at standstills and gaps that are longer, seconds.
    pub cut_s: Option<f64>,
    /// The robot.
    pub robot: RobotGiven,
    /// Joints of the wheels by the robot's own files, for topics that hold them.
    pub known_wheels: Option<Wheels<String>>,
}

/// A dataset from a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct FromBag {
    /// The dataset.
    pub dataset: Dataset,
    /// What was taken for what.
    pub took: Took,
    /// What is no error but should be known, one line each.
    pub warnings: Vec<String>,
}

/// The dataset of a bag whose topics are known.
///
/// # Errors
/// [`RosBagError`] of the first fault; what could not be read of a damaged bag is a warning.
pub(crate) fn import_of(bag: &Bag, survey: &Survey, options: &Options) -> Result<FromBag, RosBagError> {
    let path = &bag.path;
    let wheels = match &options.wheels {
        Some(topics) => match WheelPair::parse(survey, topics, options.fields.quantity)? {
            Some(pair) => WheelTopics::Two(pair),
            None => WheelTopics::One(survey.named("--wheels", topics)?),
        },
        None => WheelTopics::One(choice::wheels(survey, path)?),
    };
    let named = [&options.truth, &options.scan].map(Option::as_deref);
    let Reference { truth, scan } = choice::reference(survey, path, named)?;
    let (gyro, gyro_open) = match &options.gyro {
        Some(topic) if topic == choice::NONE => (None, None),
        Some(topic) => (Some(choice::named_gyro(survey, topic)?), None),
        None => choice::gyro(survey),
    };
    if truth.is_none() && scan.is_none() && gyro.is_none() {
        return Err(choice::nothing_beside_the_wheels(path, gyro_open));
    }
    if let Some(truth) = truth.filter(|truth| wheels.has(&truth.name)) {
        let (topic, type_name) = (truth.name.clone(), truth.type_name.clone());
        let why = "its poses are computed from its wheels; --truth takes poses of an outside instrument".to_owned();
        return Err(RosBagError::Unusable { topic, type_name, why });
    }
    let (source, wheels_what, counter_bits) = match wheels {
        WheelTopics::One(topic) => {
            let (reader, counter_bits) = WheelReader::new(topic, &options.fields)?;
            let what = reader.describe();
            (WheelSource::One(topic.name.clone(), reader), what, counter_bits)
        }
        WheelTopics::Two(pair) => {
            let rates = options.rates.unwrap_or(Rates::IntervalEnd);
            let resampling = Resampling { quantity: pair.quantity, rates, counter_bits: options.robot.counter_bits };
            let what = pair.describe();
            (WheelSource::Two(pair, resampling), what, None)
        }
    };
    let reader = |truth: &Topic| TruthReader::new(truth, options.truth_frames.as_ref(), &survey.mounted);
    let truth_reader = truth.map(reader).transpose()?;
    let of_truth = truth.map(|topic| &topic.name[..]).zip(truth_reader.as_ref());
    let others = Others { truth: of_truth, gyro: gyro.map(|topic| &topic.name[..]) };
    let both = rows::read(bag, &source, others)?;

    let given = RobotGiven { counter_bits: options.robot.counter_bits.or(counter_bits), ..options.robot };
    let is_counted = both.quantity == WheelQuantity::Ticks;
    let what = || match &source {
        WheelSource::One(topic, _) => format!("wheels are {wheels_what} of {topic}"),
        WheelSource::Two(..) => format!("wheels are {wheels_what}"),
    };
    let (robot, geometry) = given.nominal(is_counted, path, what)?;
    let mut warnings = both.losses.clone();
    warnings.extend(both.wheels.warnings());
    warnings.extend(both.truth.iter().flat_map(Rows::warnings));
    let own_estimate = truth.filter(|truth| choice::is_own_estimate(truth, options.truth_frames.as_ref()));
    if let Some(truth) = own_estimate {
        warnings.push(format!(
            "topic {}: poses of this name and type are mostly computed from the wheels themselves; calibration needs an independent instrument",
            truth.name
        ));
    }
    let clocks = clocks(&both, &mut warnings)?;
    warnings.extend(gyro_open);
    let must_have_gyro = options.gyro.is_some() || (truth.is_none() && scan.is_none());
    let gyro = gyro_column(&both, clocks[0], (options, must_have_gyro), &mut warnings)?;
    let has_gyro = gyro.is_some();
    let (mut dataset, spans) = assemble(&both, clocks, gyro, (robot, geometry), bag, options, &mut warnings)?;
    if truth.is_none() && scan.is_none() {
        dataset.runs.retain(Run::has_gyro);
        refuse_no_run(&dataset, &both, options)?;
    }
    if let Some(truth) = own_estimate {
        warnings.extend(truth::scale_covariances(&mut dataset, &truth.name));
    }
    let mut scans = None;
    if let Some(scan) = scan {
        let of = (bag, scan, clocks[0]);
        scans =
            Some((&scan.name[..], scan_walls::add_walls(&mut dataset, &spans, of, &survey.mounted, &mut warnings)?));
        dataset.runs.retain(|run| !run.truth.is_empty() || !run.walls.is_empty());
        let notes = dataset.provenance.notes.take().unwrap_or_default();
        dataset.provenance.notes = Some(format!("{notes}, walls of {} ({})", scan.name, scan.type_name));
    }
    let whats = (wheels_what, truth_reader.as_ref().map(TruthReader::describe));
    let took = Took::of(&both, whats, clocks, has_gyro, scans);
    warnings.extend(wrap_warnings(&dataset).iter().map(ToString::to_string));
    Ok(FromBag { dataset, took, warnings })
}

/// The topics of the wheels.
enum WheelTopics<'a> {
    One(&'a Topic),
    Two(WheelPair),
}

impl WheelTopics<'_> {
    fn has(&self, topic: &str) -> bool {
        match self {
            Self::One(wheels) => wheels.name == topic,
            Self::Two(pair) => [&pair.left, &pair.right].iter().any(|side| side.topic == topic),
        }
    }
}

/// Of a dataset that has a gyroscope alone beside the wheels.
fn refuse_no_run(dataset: &Dataset, both: &BothRows, options: &Options) -> Result<(), RosBagError> {
    match (&both.gyro, options.cut_s) {
        _ if !dataset.runs.is_empty() => Ok(()),
        (_, Some(cut_s)) => Err(RosBagError::NothingLeft { cut_s }),
        (Some(GyroRows { rows, .. }), None) => {
            let why = "its rates span no interval between two rows of the wheels; record both at once".to_owned();
            Err(RosBagError::Unusable { topic: rows.topic.clone(), type_name: rows.type_name.clone(), why })
        }
        (None, None) => Ok(()),
    }
}

/// The rates of the gyroscope. One that is not needed and that cannot be used is left out with a warning.
fn gyro_column(
    both: &BothRows,
    clock: Clock,
    (options, is_needed): (&Options, bool),
    warnings: &mut Vec<String>,
) -> Result<Option<GyroColumn>, RosBagError> {
    let Some(rows) = &both.gyro else { return Ok(None) };
    let span_ns = ends(&both.wheels.times, clock);
    match GyroColumn::new(rows, clock, span_ns, options.cut_s.is_some(), warnings) {
        Ok(column) => Ok(Some(column)),
        Err(why) if !is_needed => {
            warnings.push(format!("{why}; the gyroscope was left out"));
            Ok(None)
        }
        Err(why) => Err(why),
    }
}

/// The first and the last time of a topic.
fn ends(times: &[Times], clock: Clock) -> (i64, i64) {
    let times = times.iter().filter_map(|times| match clock {
        Clock::Stamps => times.stamp_ns,
        Clock::Receipt => Some(times.received_ns),
    });
    times.clone().min().zip(times.max()).unwrap_or_default()
}

/// The clocks of wheels and poses; both by receipt where stamps and receipts do not meet.
fn clocks(both: &BothRows, warnings: &mut Vec<String>) -> Result<[Clock; 2], RosBagError> {
    // Scans go by the wheels' clock.
    let truth = both.truth.as_ref().map(|truth| (&truth.times[..], &truth.topic));
    let (truth_times, truth_topic) = truth.unwrap_or((&both.wheels.times, &both.wheels.topic));
    let all = [&both.wheels.times[..], truth_times];
    let topics = [&both.wheels.topic, truth_topic];
    let clocks = all.map(clock::clock);
    for (clock, topic) in clocks.iter().zip(topics).take(if truth.is_some() { 2 } else { 1 }) {
        if *clock == Clock::Receipt {
            warnings.push(format!(
                "topic {topic}: no header stamps; the times of receipt are used, which are late and irregular"
            ));
        }
    }
    let ends = |index: usize, clock: Clock| ends(all[index], clock);
    let meet = |clocks: [Clock; 2]| {
        let ((first, last), (from, to)) = (ends(0, clocks[0]), ends(1, clocks[1]));
        first <= to && from <= last
    };
    if meet(clocks) {
        return Ok(clocks);
    }
    let receipts = [Clock::Receipt; 2];
    if clocks[0] != clocks[1] && meet(receipts) {
        warnings.push(
            "stamps and times of receipt are of two clocks; the times of receipt are used for both topics".to_owned(),
        );
        return Ok(receipts);
    }
    let span = |index: usize| {
        let (first, last) = ends(index, clocks[index]);
        format!("{:.3} to {:.3} s", first as f64 / 1e9, last as f64 / 1e9)
    };
    Err(RosBagError::TwoClocks {
        wheels: topics[0].clone(),
        wheels_span: span(0),
        truth: topics[1].clone(),
        truth_span: span(1),
    })
}

fn assemble(
    both: &BothRows,
    clocks: [Clock; 2],
    mut gyro: Option<GyroColumn>,
    (robot, geometry): (NominalRobot, DriveGeometry),
    bag: &Bag,
    options: &Options,
    warnings: &mut Vec<String>,
) -> Result<(Dataset, Vec<RunSpan>), RosBagError> {
    let may_restart = options.cut_s.is_some();
    let wheel_rows = both.wheels.in_order(clocks[0], may_restart, warnings)?;
    let (no_poses, has_poses) = (Rows::new("", ""), both.truth.is_some());
    let poses = both.truth.as_ref().unwrap_or(&no_poses);
    let truth_rows = poses.in_order(clocks[1], may_restart, warnings)?;
    let mut wheels: Vec<[f64; 2]> = wheel_rows.iter().map(|(row, _)| both.wheels.values[*row]).collect();
    if both.quantity == WheelQuantity::Ticks {
        refuse_fractions(&both.wheels, &wheels)?;
    }
    if both.quantity == WheelQuantity::Angles && unwrap_angles(&mut wheels) {
        warnings.push(format!("topic {}: the angles are wrapped to a turn; whole turns were added", both.wheels.topic));
    }
    let has_heading = !is_heading_constant(&poses.values);
    if !has_heading {
        warnings.push(format!(
            "topic {}: all headings are the same while the positions are not; they were left out",
            poses.topic
        ));
    }
    let tilt_rad = poses.values.iter().map(|reading| reading.tilt_rad).fold(0.0, f64::max);
    if tilt_rad > MAX_TILT_RAD {
        warnings.push(format!(
            "topic {}: poses are tilted by up to {:.0}°; is z up, and are they the robot's?",
            poses.topic,
            tilt_rad.to_degrees()
        ));
    }

    let doubt = truth::doubt_of_covariances(&poses.values);
    warnings.extend(doubt.map(|doubt| format!("topic {}: {doubt}", poses.topic)));

    let step_s = |from: usize, to: usize| seconds(wheel_rows[from].1, wheel_rows[to].1);
    let stands = |from: usize, to: usize| {
        if both.quantity.is_rate() { wheels[to] == [0.0, 0.0] } else { wheels[from] == wheels[to] }
    };
    let pieces = match options.cut_s {
        Some(cut_s) => moving_pieces(wheel_rows.len(), step_s, stands, cut_s),
        None => std::iter::once(0..wheel_rows.len()).collect(),
    };
    let session = wheel_rows.first().map_or(0, |(_, time_ns)| *time_ns);
    let is_cut = options.cut_s.is_some();
    let (mut runs, mut spans): (Vec<Run>, Vec<RunSpan>) = (Vec::new(), Vec::new());
    let mut seen = BTreeSet::new();
    for piece in pieces {
        let rows = &wheel_rows[piece.clone()];
        let (Some(&(first, from_ns)), Some(&(last, to_ns))) = (rows.first(), rows.last()) else { continue };
        let t_s: Vec<f64> = rows.iter().map(|(_, time_ns)| seconds(from_ns, *time_ns)).collect();
        let log = wheel_log(&wheels[piece], both.quantity, geometry, options.rates.unwrap_or(Rates::IntervalEnd));
        let receipt = |row: usize| both.wheels.times[row].received_ns;
        let belongs = |(row, time_ns): &&(usize, i64)| {
            let received_ns = poses.times[*row].received_ns;
            (from_ns..=to_ns).contains(time_ns)
                && seconds(receipt(first), received_ns) >= -RECEIPT_MARGIN_S
                && seconds(receipt(last), received_ns) <= RECEIPT_MARGIN_S
        };
        // Of recordings with the same times each run has the poses of one.
        let mut of_run: Vec<&(usize, i64)> = Vec::new();
        for row in truth_rows.iter().filter(belongs) {
            let is_later = of_run.last().is_none_or(|last| last.1 < row.1);
            if is_later && seen.insert(row.0) {
                of_run.push(row);
            }
        }
        if is_cut && has_poses && options.scan.is_none() && of_run.len() < 2 {
            continue;
        }
        let readings = || of_run.iter().map(|(row, _)| &poses.values[*row]);
        let sample = |(row, time_ns): &&(usize, i64)| {
            let reading = &poses.values[*row];
            let theta_rad = reading.theta_rad.filter(|_| has_heading);
            TruthSample::new(seconds(from_ns, *time_ns), reading.x_m, reading.y_m, theta_rad)
        };
        let truth: Vec<TruthSample> = of_run.iter().map(sample).collect();
        let truth_sigma = truth::precisions(readings(), has_heading);
        let id = format!("run-{:02}", runs.len() + 1);
        let start_s = is_cut.then(|| seconds(session, from_ns)).filter(|start_s| *start_s >= 0.0);
        let info = RunInfo { id, start_s, ..RunInfo::default() };
        let rows_ns: Vec<i64> = rows.iter().map(|(_, time_ns)| *time_ns).collect();
        let rates = gyro.as_mut().and_then(|gyro| gyro.of_run(&rows_ns, (receipt(first), receipt(last))));
        let extra = rates.map(|rates| (ExtraChannel::GyroYawRate, rates)).into_iter().collect();
        let odometry = Odometry { t_s: t_s.into(), wheels: log, extra };
        spans.push(RunSpan { clock_ns: (from_ns, to_ns), received_ns: (receipt(first), receipt(last)) });
        runs.push(Run { info, odometry, truth, truth_sigma, ..Run::default() });
    }
    if let Some(cut_s) = options.cut_s.filter(|_| runs.is_empty()) {
        return Err(RosBagError::NothingLeft { cut_s });
    }
    let is_seen = |run: &Run| !run.truth.is_empty() || run.has_gyro();
    if has_poses && options.scan.is_none() && !runs.iter().any(is_seen) {
        let why = format!(
            "none of its {} poses lies between the first and the last message of {}, by their times and their times of receipt; record both at once",
            truth_rows.len(),
            both.wheels.topic
        );
        return Err(RosBagError::Unusable { topic: poses.topic.clone(), type_name: poses.type_name.clone(), why });
    }
    warnings.extend(gyro.and_then(|gyro| gyro.gaps()));
    let outside = truth_rows.len() - seen.len();
    if outside > 0 {
        let what =
            if is_cut { "outside of the runs" } else { "before the first or after the last message of the wheels" };
        warnings.push(format!("topic {}: {outside} of {} poses are {what}", poses.topic, truth_rows.len()));
    }
    if both.quantity.is_rate() && !is_cut {
        let longest_s = (1..wheel_rows.len()).map(|row| step_s(row - 1, row)).fold(0.0, f64::max);
        if longest_s > MAX_GAP_OF_RATES_S {
            warnings.push(format!(
                "topic {}: a gap of {longest_s:.1} s, in which the speeds say nothing; --cut {MAX_GAP_OF_RATES_S} cuts runs there",
                both.wheels.topic
            ));
        }
    }
    let has_rates = runs.iter().any(|run| !run.odometry.extra.is_empty());
    let rates =
        both.gyro.as_ref().filter(|_| has_rates).map(|gyro| format!(", yaw rates of {} ({IMU})", gyro.rows.topic));
    let of_poses = both.truth.as_ref().map(|poses| format!(", poses of {} ({})", poses.topic, poses.type_name));
    let notes = format!(
        "{} bag: wheels of {} ({}){}{}",
        if bag.is_ros1() { "ROS 1" } else { "ROS 2" },
        both.wheels.topic,
        both.wheels.type_name,
        of_poses.unwrap_or_default(),
        rates.unwrap_or_default()
    );
    let name = bag.path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let recorded = recorded(both.wheels.times.iter().map(|times| times.received_ns));
    let provenance = Provenance { name, notes: Some(notes), recorded, ..Provenance::default() };
    let truth_noise = TruthNoise::default();
    let mut dataset = Dataset { provenance, robot, truth_noise, points: Vec::new(), runs };
    recognise_protocols(&mut dataset);
    dataset.carry_wheel_angles();
    Ok((dataset, spans))
}

fn refuse_fractions(rows: &WheelRows, wheels: &[[f64; 2]]) -> Result<(), RosBagError> {
    let wrong = wheels.as_flattened().iter().find(|value| value.fract() != 0.0 || value.abs() > LARGEST_COUNT);
    let Some(wrong) = wrong else { return Ok(()) };
    let (topic, type_name) = (rows.topic.clone(), rows.type_name.clone());
    Err(RosBagError::Unusable { topic, type_name, why: format!("{wrong} is no count; say --as rad, radps or mps") })
}

/// Adds whole turns to angles that are wrapped; says whether they are.
fn unwrap_angles(wheels: &mut [[f64; 2]]) -> bool {
    let within = |least: f64, most: f64| wheels.as_flattened().iter().all(|angle| (least..=most).contains(angle));
    let margin = WRAPPED_MARGIN_RAD;
    let leaps = wheels.windows(2).any(|pair| (0..2).any(|wheel| (pair[1][wheel] - pair[0][wheel]).abs() > PI));
    if !leaps || !(within(-PI - margin, PI + margin) || within(-margin, TAU + margin)) {
        return false;
    }
    for wheel in 0..2 {
        let mut turns = 0.0;
        for row in 1..wheels.len() {
            let step = wheels[row][wheel] + TAU * turns - wheels[row - 1][wheel];
            turns -= (step / TAU).round();
            wheels[row][wheel] += TAU * turns;
        }
    }
    true
}

/// Is every heading the same, while the robot moves over a plane?
fn is_heading_constant(readings: &[TruthReading]) -> bool {
    let Some(first) = readings.first().and_then(|reading| reading.theta_rad) else { return false };
    let extent_m = |of: fn(&TruthReading) -> f64| {
        let (least, most) = readings.iter().map(of).fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        most - least
    };
    let is_same = readings.iter().all(|reading| reading.theta_rad == Some(first));
    is_same && extent_m(|reading| reading.x_m) > MIN_EXTENT_M && extent_m(|reading| reading.y_m) > MIN_EXTENT_M
}

fn wheel_log(wheels: &[[f64; 2]], quantity: WheelQuantity, geometry: DriveGeometry, rates: Rates) -> WheelLog {
    let column = |wheel: usize, scale: f64| -> Vec<f64> {
        let mean = |row: usize| match (rates, row.checked_sub(1)) {
            (Rates::Instantaneous, Some(before)) if quantity.is_rate() => {
                0.5 * (wheels[before][wheel] + wheels[row][wheel])
            }
            _ => wheels[row][wheel],
        };
        (0..wheels.len()).map(|row| scale * mean(row)).collect()
    };
    let both = |scale: Wheels<f64>| Wheels { left: column(0, scale.left), right: column(1, scale.right) };
    match quantity {
        WheelQuantity::Ticks => {
            let count = |wheel: usize| wheels.iter().map(|row| row[wheel] as i64).collect();
            WheelLog::Ticks(Wheels { left: count(0), right: count(1) })
        }
        WheelQuantity::Angles => WheelLog::Angles(both(Wheels::both(1.0))),
        WheelQuantity::AngularSpeeds => WheelLog::Speeds(both(geometry.m_per_rad())),
        WheelQuantity::Speeds => WheelLog::Speeds(both(Wheels::both(1.0))),
        WheelQuantity::Twist => WheelLog::Twist { v_mps: column(0, 1.0), omega_radps: column(1, 1.0) },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrapped_angles_get_their_turns_back_and_others_stay() {
        let whole: Vec<[f64; 2]> = (0..100).map(|row| [0.4 * f64::from(row), -0.7 * f64::from(row)]).collect();
        let wrap = |angle: f64| (angle + PI).rem_euclid(TAU) - PI;
        let mut wrapped: Vec<[f64; 2]> = whole.iter().map(|row| row.map(wrap)).collect();
        assert!(unwrap_angles(&mut wrapped));
        // Rounding of 70 radians, a few times.
        let close = wrapped.iter().zip(&whole).all(|(a, b)| (0..2).all(|wheel| (a[wheel] - b[wheel]).abs() < 1e-12));
        assert!(close, "{wrapped:?}");
        let mut same = whole.clone();
        assert!(!unwrap_angles(&mut same));
        assert_eq!(same, whole);
        // A leap to a place that no wrapped angle has.
        assert!(!unwrap_angles(&mut [[0.0, 0.0], [9.0, 0.0]]));
    }
}
