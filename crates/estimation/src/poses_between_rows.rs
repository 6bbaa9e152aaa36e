//! Which poses the likelihood takes where the log comes more rarely than they.
//!
//! Between two rows the wheels' turns are interpolated. At a share f of the row they are off by
//! (1 − f) e₀ + f e₁ of the roundings at both rows, and by s f (1 − f) of what nobody recorded of the motion
//! in between. Several poses of one row, and of two rows that meet, therefore have errors in common, which
//! the filter takes to be independent ([`crate::rounding`]). Where these matter beside the instrument's own,
//! one pose is taken for each row, the nearest to it: least is interpolated there. Where the wheels stand,
//! nothing is, and all count.
//!
//! What nobody recorded goes on from row to row while the robot speeds up, so that poses of successive rows
//! are off alike as well. Of a run that has enough poses near its rows, those that are off by more of it than
//! the instrument is are left out.

use kinematics::{Increment, Wheels};

use crate::model::Model;
use crate::quantum::variance_of_rounding;
use crate::rounding::PoseVariance;
use crate::segment::{MeasuredPose, Segment};
use crate::settings::POSES_BETWEEN_ROWS;
use crate::wheel_angles::WheelInterval;

/// Leaves out poses that share their errors with one that is nearer to the same row. `rows_s` are the
/// instants of the log's rows, `reference` the instrument's standard deviations of position, metres, and
/// heading, radians.
pub(crate) fn take_one_for_each_row(segment: &mut Segment<'_>, rows_s: &[f64], nominal: &Model, reference: [f64; 2]) {
    let late_s2 = mean_square_late_s2(&segment.intervals);
    let shares = |measured: &MeasuredPose| {
        let Some(last) = measured.after.checked_sub(1) else { return false };
        let interval = &segment.intervals[last];
        let shared = variance(interval, segment.quantum_rad, nominal);
        let per_second = nominal.increment(interval.rate_rad_s);
        let is_more = |shared: f64, [sigma, factor, speed]: [f64; 3]| {
            shared > POSES_BETWEEN_ROWS.max_shared_variance_ratio * (sigma * sigma * factor + speed * speed * late_s2)
        };
        let [position, heading] = reference;
        let [of_position, of_heading] = measured.variance_factor;
        let Increment { distance_m: v_m_s, turn_rad: omega_rad_s } = per_second;
        is_more(shared.along_m2, [position, of_position, v_m_s])
            || (measured.theta_rad.is_some() && is_more(shared.heading_rad2, [heading, of_heading, omega_rad_s]))
    };
    let mut taken: Vec<(usize, MeasuredPose)> = Vec::with_capacity(segment.measurements.len());
    for measured in &segment.measurements {
        let row = nearest_row(rows_s, measured.t_s);
        let off_s = |of: &MeasuredPose| (of.t_s - rows_s[row]).abs();
        let is_start = taken.len() < 2;
        match taken.last_mut().filter(|(of, before)| *of == row && !is_start && (shares(before) || shares(measured))) {
            Some((_, before)) if off_s(measured) < off_s(before) => *before = *measured,
            Some(_) => {}
            None => taken.push((row, *measured)),
        }
    }
    segment.measurements = taken.into_iter().map(|(_, measured)| measured).collect();
}

/// Leaves out poses whose wheels' turns between rows are known less well than the instrument measures, but
/// for the first two and the last, where enough others stay. Where a row's own rounding is more than that, no
/// pose is known better, and all are taken.
pub(crate) fn take_those_near_rows(segment: &mut Segment<'_>, nominal: &Model, reference: [f64; 2]) {
    let Segment { measurements, intervals, quantum_rad, .. } = segment;
    let at_row = PoseVariance::of_rounding(*quantum_rad, nominal);
    let is_near = |measured: &MeasuredPose| {
        let Some(last) = measured.after.checked_sub(1) else { return true };
        let interpolated = PoseVariance::of(intervals[last].interpolated_rad2[1], nominal);
        let is_within = |interpolated: f64, at_row: f64, [sigma, factor]: [f64; 2]| {
            let measured = sigma * sigma * factor;
            interpolated <= POSES_BETWEEN_ROWS.max_interpolated_variance_ratio * measured || at_row > measured
        };
        let ([position, heading], [of_position, of_heading]) = (reference, measured.variance_factor);
        is_within(interpolated.along_m2, at_row.along_m2, [position, of_position])
            && (measured.theta_rad.is_none()
                || is_within(interpolated.heading_rad2, at_row.heading_rad2, [heading, of_heading]))
    };
    let last = measurements.len().saturating_sub(1);
    let numbered = measurements.iter().enumerate();
    let near: Vec<MeasuredPose> =
        numbered.filter(|(k, measured)| *k < 2 || *k == last || is_near(measured)).map(|(_, of)| *of).collect();
    if near.len() >= POSES_BETWEEN_ROWS.min_poses_near_rows {
        *measurements = near;
    }
}

/// What a pose at the end of an interval shares with others of its row.
fn variance(interval: &WheelInterval, quantum_rad: Wheels<f64>, nominal: &Model) -> PoseVariance {
    let rounded_rad2 = if interval.stands || interval.rate_rad_s == Wheels::both(0.0) {
        Wheels::both(0.0)
    } else {
        quantum_rad.map(variance_of_rounding)
    };
    PoseVariance::of(rounded_rad2.zip_with(interval.interpolated_rad2[1], |a, b| a + b), nominal)
}

/// Mean square of what the rows' stamps are late by: where they jitter, that is more than rows share.
fn mean_square_late_s2(intervals: &[WheelInterval]) -> f64 {
    let sum: f64 = intervals.iter().map(|interval| interval.late_s[1].powi(2)).sum();
    sum / intervals.len().max(1) as f64
}

fn nearest_row(rows_s: &[f64], t_s: f64) -> usize {
    let next = rows_s.partition_point(|row_s| *row_s <= t_s).clamp(1, rows_s.len() - 1);
    if t_s - rows_s[next - 1] <= rows_s[next] - t_s { next - 1 } else { next }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::records::Records;
    use dataset::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};

    /// Three seconds in rows of 0.1 s, by ticks of a wheel of 0.1 m, with poses at two shares of each row:
    /// 0.2 m/s until an instant, and rest.
    fn dataset(until_s: f64, of: [f64; 3]) -> Dataset {
        dataset_along(|t_s| 0.2 * f64::min(t_s, until_s), of, [0.375, 0.875])
    }

    fn dataset_along(
        driven_m: impl Fn(f64) -> f64,
        [ticks_per_rev, sigma_m, jitter_s]: [f64; 3],
        shares: [f64; 2],
    ) -> Dataset {
        let counted = |row: i32| {
            let turns = driven_m(0.1 * f64::from(row)) / (0.1 * std::f64::consts::PI);
            (turns * ticks_per_rev).floor() as i64
        };
        let ticks: Vec<i64> = (0..=30).map(counted).collect();
        let t_s = (0..=30).map(|row| 0.1 * f64::from(row) + jitter_s * f64::from(row * row % 7 - 3)).collect();
        let pose = |half: i32| {
            let t_s = 0.1 * (f64::from(half / 2) + shares[usize::from(half % 2 == 1)]);
            TruthSample::new(t_s, driven_m(t_s), 0.0, Some(0.0))
        };
        let wheels = WheelLog::Ticks(Wheels { left: ticks.clone(), right: ticks });
        let run = Run {
            info: RunInfo { continuous: true, ..RunInfo::default() },
            odometry: Odometry { t_s, wheels, ..Odometry::default() },
            truth: (0..60).map(pose).collect(),
            ..Run::default()
        };
        Dataset {
            provenance: Provenance::default(),
            robot: NominalRobot {
                left_wheel_diameter_m: 0.1,
                right_wheel_diameter_m: 0.1,
                wheel_separation_m: 0.3,
                ticks_per_rev: Some(ticks_per_rev),
                counter_bits: None,
            },
            truth_noise: TruthNoise { sigma_xy_m: Some(sigma_m), sigma_theta_rad: Some(1.0), ..TruthNoise::default() },
            points: Vec::new(),
            runs: vec![run],
        }
    }

    fn taken_s(dataset: &Dataset) -> Vec<f64> {
        let records = Records::of(&[dataset.session()]);
        records.segments[0].measurements.iter().map(|measured| measured.t_s).collect()
    }

    #[test]
    fn of_poses_that_share_the_rounding_of_a_row_one_is_taken() {
        // Ticks of 1 mm beside 0.3 mm: the pose at 7/8 of a row is of the row after it, and nearer to it than
        // the one at 3/8. Both are taken while the robot stands, from 2 s on.
        let taken = taken_s(&dataset(2.0, [314.16, 3e-4, 0.0]));
        // Five rows before it stops, what an acceleration may do within a row is more than 0.3 mm.
        let driving: Vec<f64> = taken.iter().copied().filter(|t_s| *t_s < 1.9).collect();
        assert!(driving[2..].iter().all(|t_s| (t_s / 0.1).fract() > 0.8), "{driving:?}");
        assert_eq!((driving.len(), driving.last().copied()), (16, Some(1.4875)), "{driving:?}");
        assert_eq!(taken.iter().filter(|t_s| **t_s > 2.2).count(), 16);
    }

    #[test]
    fn a_pose_shares_the_rounding_of_the_row_that_is_nearest() {
        let mut dataset = dataset(2.0, [314.16, 3e-4, 0.0]);
        // Poses at 1/8 and 5/8 of each row: that at 5/8 is of the next row, and farther from it.
        dataset.runs[0].odometry.t_s.iter_mut().for_each(|t_s| *t_s += 0.025);
        let taken = taken_s(&dataset);
        let driving: Vec<f64> = taken.iter().copied().filter(|t_s| *t_s < 1.9).collect();
        assert!(driving[2..].iter().all(|t_s| ((t_s - 0.025) / 0.1).fract() < 0.2), "{driving:?}");
    }

    #[test]
    fn poses_that_share_little_are_all_taken() {
        // Beside an instrument of 3 mm; of ticks of 0.03 mm; and beside stamps that are off by 20 ms, which
        // at 0.2 m/s are 4 mm.
        for of in [[314.16, 3e-3, 0.0], [1e4, 3e-4, 0.0], [314.16, 3e-4, 0.01]] {
            assert_eq!(taken_s(&dataset(3.0, of)).len(), 60, "{of:?}");
        }
    }

    #[test]
    fn poses_that_the_wheels_tell_less_well_than_the_instrument_are_left_out_where_others_stay() {
        // A speed that swings by 0.3 m/s every 0.6 s: its acceleration, of 3 m/s², changes by about 3 m/s²
        // from row to row, and half of that over a half row is 3.75 mm. A pose half a millisecond after a row
        // is off by 0.07 mm.
        let driven_m = |t_s: f64| 0.4 * t_s + 0.3 * 0.6 / TAU * (TAU * t_s / 0.6).sin();
        let taken = |sigma_m: f64, shares: [f64; 2]| {
            taken_s(&dataset_along(driven_m, [1e5, sigma_m, 0.0], shares)).into_iter().skip(2).collect::<Vec<f64>>()
        };
        // Beside 1 mm those in the middle are left out, but for the last.
        let near = taken(1e-3, [0.005, 0.5]);
        let (last, others) = near.split_last().expect("a run of 60 poses");
        let in_the_middle = others.iter().filter(|t_s| (**t_s / 0.1).fract() > 0.1).count();
        assert!(in_the_middle == 0 && others.len() == 28 && *last > 2.9, "{near:?}");
        // Beside 20 mm all stay, and where none is near a row as well.
        assert_eq!(taken(2e-2, [0.005, 0.5]).len(), 58);
        assert_eq!(taken(1e-3, [0.4, 0.5]).len(), 29);
    }
}
