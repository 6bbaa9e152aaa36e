//! The dataset of the rows that were read of a bag: cut into runs, each with the poses and rates of its time.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use dataset::import::csv::Rates;
use dataset::{
    Dataset, ExtraChannel, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
    moving_pieces, recognise_protocols,
};
use kinematics::{DriveGeometry, Wheels};

use crate::bag::Bag;
use crate::clock::{Clock, seconds};
use crate::error::RosBagError;
use crate::gyro::IMU;
use crate::gyro_column::GyroColumn;
use crate::recorded::recorded;
use crate::rows::{BothRows, Rows, WheelRows};
use crate::scan_walls::RunSpan;
use crate::truth::{self, TruthReading};
use crate::wheels::WheelQuantity;

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

/// What a dataset is made of.
pub(crate) struct Assembly<'a> {
    pub(crate) bag: &'a Bag,
    pub(crate) both: &'a BothRows,
    /// Of wheels and poses.
    pub(crate) clocks: [Clock; 2],
    pub(crate) robot: NominalRobot,
    pub(crate) geometry: DriveGeometry,
    pub(crate) rates: Rates,
    /// Runs are cut at standstills and gaps that are longer, seconds.
    pub(crate) cut_s: Option<f64>,
    /// Walls are taken of scans, so that a run needs no poses.
    pub(crate) has_scans: bool,
}

/// The poses in the order of time, of which each belongs to one run.
struct PoseRows<'a> {
    readings: &'a Rows<TruthReading>,
    /// Index of each, with its time in nanoseconds.
    ordered: Vec<(usize, i64)>,
    has_heading: bool,
    /// Those that a run has.
    taken: BTreeSet<usize>,
}

impl PoseRows<'_> {
    /// The poses of a run that no run before it has. Of recordings with the same times each run has the poses
    /// of one.
    fn take(&mut self, span: &RunSpan) -> Vec<(usize, i64)> {
        let mut of_run: Vec<(usize, i64)> = Vec::new();
        for &(row, time_ns) in &self.ordered {
            let is_later = || of_run.last().is_none_or(|last| last.1 < time_ns);
            if span.contains(time_ns, self.readings.times[row].received_ns) && is_later() && self.taken.insert(row) {
                of_run.push((row, time_ns));
            }
        }
        of_run
    }

    /// The samples of some rows, from an instant on.
    fn samples(&self, rows: &[(usize, i64)], from_ns: i64) -> Vec<TruthSample> {
        let sample = |(row, time_ns): &(usize, i64)| {
            let reading = &self.readings.values[*row];
            let theta_rad = reading.theta_rad.filter(|_| self.has_heading);
            TruthSample::new(seconds(from_ns, *time_ns), reading.x_m, reading.y_m, theta_rad)
        };
        rows.iter().map(sample).collect()
    }
}

impl Assembly<'_> {
    /// The dataset, and when its runs were.
    pub(crate) fn dataset(
        self,
        mut gyro: Option<GyroColumn>,
        warnings: &mut Vec<String>,
    ) -> Result<(Dataset, Vec<RunSpan>), RosBagError> {
        let both = self.both;
        let is_cut = self.cut_s.is_some();
        let wheel_rows = both.wheels.in_order(self.clocks[0], is_cut, warnings)?;
        let (no_poses, needs_poses) = (Rows::new("", ""), both.truth.is_some() && !self.has_scans);
        let readings = both.truth.as_ref().unwrap_or(&no_poses);
        let ordered = readings.in_order(self.clocks[1], is_cut, warnings)?;
        let wheels = wheel_values(both, &wheel_rows, warnings)?;
        let has_heading = check_poses(readings, warnings);
        let mut poses = PoseRows { readings, ordered, has_heading, taken: BTreeSet::new() };

        let step_s = |from: usize, to: usize| seconds(wheel_rows[from].1, wheel_rows[to].1);
        let stands = |from: usize, to: usize| {
            if both.quantity.is_rate() { wheels[to] == [0.0, 0.0] } else { wheels[from] == wheels[to] }
        };
        let pieces = match self.cut_s {
            Some(cut_s) => moving_pieces(wheel_rows.len(), step_s, stands, cut_s),
            None => std::iter::once(0..wheel_rows.len()).collect(),
        };
        let session = wheel_rows.first().map_or(0, |(_, time_ns)| *time_ns);
        let (mut runs, mut spans): (Vec<Run>, Vec<RunSpan>) = (Vec::new(), Vec::new());
        for piece in pieces {
            let rows = &wheel_rows[piece.clone()];
            let (Some(&(first, from_ns)), Some(&(last, to_ns))) = (rows.first(), rows.last()) else { continue };
            let receipt = |row: usize| both.wheels.times[row].received_ns;
            let span = RunSpan { clock_ns: (from_ns, to_ns), received_ns: (receipt(first), receipt(last)) };
            let of_run = poses.take(&span);
            if is_cut && needs_poses && of_run.len() < 2 {
                continue;
            }
            let rows_ns: Vec<i64> = rows.iter().map(|(_, time_ns)| *time_ns).collect();
            let t_s: Vec<f64> = rows_ns.iter().map(|time_ns| seconds(from_ns, *time_ns)).collect();
            let wheels = wheel_log(&wheels[piece], both.quantity, self.geometry, self.rates);
            let rates = gyro.as_mut().and_then(|gyro| gyro.of_run(&rows_ns, span.received_ns));
            let extra = rates.map(|rates| (ExtraChannel::GyroYawRate, rates)).into_iter().collect();
            let odometry = Odometry { t_s: t_s.into(), wheels, extra };
            let truth = poses.samples(&of_run, from_ns);
            let truth_sigma = truth::precisions(of_run.iter().map(|(row, _)| &readings.values[*row]), has_heading);
            let id = format!("run-{:02}", runs.len() + 1);
            let start_s = is_cut.then(|| seconds(session, from_ns)).filter(|start_s| *start_s >= 0.0);
            let info = RunInfo { id, start_s, ..RunInfo::default() };
            spans.push(span);
            runs.push(Run { info, odometry, truth, truth_sigma, ..Run::default() });
        }
        if let Some(cut_s) = self.cut_s.filter(|_| runs.is_empty()) {
            return Err(RosBagError::NothingLeft { cut_s });
        }
        let (total, taken) = (poses.ordered.len(), poses.taken.len());
        let is_seen = |run: &Run| !run.truth.is_empty() || run.has_gyro();
        if needs_poses && !runs.iter().any(is_seen) {
            return Err(readings.unusable(format!(
                "none of its {total} poses lies between the first and the last message of {}, by their times and their times of receipt; record both at once",
                both.wheels.topic
            )));
        }
        warnings.extend(gyro.and_then(|gyro| gyro.gaps()));
        if taken < total {
            let what =
                if is_cut { "outside of the runs" } else { "before the first or after the last message of the wheels" };
            warnings.push(format!("topic {}: {} of {total} poses are {what}", readings.topic, total - taken));
        }
        if both.quantity.is_rate() && !is_cut {
            let longest_s = (1..wheel_rows.len()).map(|row| step_s(row - 1, row)).fold(0.0, f64::max);
            warnings.extend(warning_of_gap(&both.wheels.topic, longest_s));
        }
        let provenance = self.provenance(runs.iter().any(|run| !run.odometry.extra.is_empty()));
        let truth_noise = TruthNoise::default();
        let mut dataset = Dataset { provenance, robot: self.robot, truth_noise, points: Vec::new(), runs };
        recognise_protocols(&mut dataset);
        dataset.carry_wheel_angles();
        Ok((dataset, spans))
    }

    /// What the bag is, and what was taken of it.
    fn provenance(&self, has_rates: bool) -> Provenance {
        let Self { bag, both, .. } = self;
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
        Provenance { name, notes: Some(notes), recorded, ..Provenance::default() }
    }
}

/// The wheels' numbers in the order of time; angles with their whole turns.
fn wheel_values(
    both: &BothRows,
    rows: &[(usize, i64)],
    warnings: &mut Vec<String>,
) -> Result<Vec<[f64; 2]>, RosBagError> {
    let mut wheels: Vec<[f64; 2]> = rows.iter().map(|(row, _)| both.wheels.values[*row]).collect();
    if both.quantity == WheelQuantity::Ticks {
        refuse_fractions(&both.wheels, &wheels)?;
    }
    if both.quantity == WheelQuantity::Angles && unwrap_angles(&mut wheels) {
        warnings.push(format!("topic {}: the angles are wrapped to a turn; whole turns were added", both.wheels.topic));
    }
    Ok(wheels)
}

/// Warns of what is doubtful of poses; gives whether their headings say something.
fn check_poses(poses: &Rows<TruthReading>, warnings: &mut Vec<String>) -> bool {
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
    has_heading
}

/// What is said of the longest gap in rates of wheels.
fn warning_of_gap(topic: &str, longest_s: f64) -> Option<String> {
    (longest_s > MAX_GAP_OF_RATES_S).then(|| {
        format!(
            "topic {topic}: a gap of {longest_s:.1} s, in which the speeds say nothing; --cut {MAX_GAP_OF_RATES_S} cuts runs there"
        )
    })
}

fn refuse_fractions(rows: &WheelRows, wheels: &[[f64; 2]]) -> Result<(), RosBagError> {
    let wrong = wheels.as_flattened().iter().find(|value| value.fract() != 0.0 || value.abs() > LARGEST_COUNT);
    let Some(wrong) = wrong else { return Ok(()) };
    Err(rows.unusable(format!("{wrong} is no count; say --as rad, radps or mps")))
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
