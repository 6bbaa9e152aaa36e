//! How a robot was driven, by its counts: how fast, and how it speeds up.

use kinematics::Wheels;

use crate::model::Model;
use crate::records::Records;
use crate::segment::Segment;
use crate::settings::DRIVING;
use crate::wheel_angles::WheelInterval;

/// How the faster wheel was driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveStatistics {
    /// Its speed while the robot cruises, m/s.
    pub cruise_speed_m_s: f64,
    /// Its acceleration from rest to cruising, m/s², as fast as the rows show it; `None` where the log has no
    /// such rise.
    pub acceleration_m_s2: Option<f64>,
}

/// Mean speed of the faster wheel in a row.
#[derive(Debug, Clone, Copy)]
struct RowSpeed {
    middle_s: f64,
    dt_s: f64,
    speed_m_s: f64,
}

impl Records<'_> {
    /// How the robot was driven; `None` where it stood.
    #[must_use]
    pub fn drive_statistics(&self, model: &Model) -> Option<DriveStatistics> {
        let partial = self.partial.iter().map(|partial| &partial.segment);
        let runs: Vec<Vec<RowSpeed>> = self.segments.iter().chain(partial).map(|of| row_speeds(of, model)).collect();
        let moving = runs.iter().flatten().filter(|row| row.speed_m_s > 0.0);
        let cruise_speed_m_s = weighted_quantile(moving.map(|row| (row.speed_m_s, row.dt_s)), DRIVING.cruise_quantile)?;
        let rises_s = runs.iter().flat_map(|run| rise_times_s(run, cruise_speed_m_s));
        let rise_s = weighted_quantile(rises_s.map(|rise_s| (rise_s, 1.0)), DRIVING.rise_quantile);
        let [low, high] = DRIVING.rise_speed_ratios;
        let acceleration_m_s2 = rise_s.map(|rise_s| (high - low) * cruise_speed_m_s / rise_s);
        Some(DriveStatistics { cruise_speed_m_s, acceleration_m_s2 })
    }
}

/// The rows of a segment; measurements cut them into several intervals.
fn row_speeds(segment: &Segment<'_>, model: &Model) -> Vec<RowSpeed> {
    let rows = segment.intervals.chunk_by(|_, next| next.starts_within_row);
    let of = |row: &[WheelInterval]| {
        let dt_s: f64 = row.iter().map(|interval| interval.dt_s).sum();
        let turned = row.iter().filter(|interval| !interval.stands).fold(Wheels::both(0.0), |sum, interval| {
            sum.zip_with(interval.rate_rad_s, |sum, rate| sum + rate * interval.dt_s)
        });
        let speed_m_s = model.m_per_rad.zip_with(turned, |m_per_rad, rad| (m_per_rad * rad / dt_s).abs());
        RowSpeed { middle_s: row[0].t_s + 0.5 * dt_s, dt_s, speed_m_s: speed_m_s.left.max(speed_m_s.right) }
    };
    rows.map(of).filter(|row| row.dt_s > 0.0).collect()
}

/// Times from a tenth of a speed to nine tenths of it, without slowing down to a tenth in between, seconds:
/// linear between the middles of rows.
fn rise_times_s(rows: &[RowSpeed], cruise_speed_m_s: f64) -> Vec<f64> {
    let [low_m_s, high_m_s] = DRIVING.rise_speed_ratios.map(|ratio| ratio * cruise_speed_m_s);
    let mut rises_s = Vec::new();
    let mut low_s = None;
    for pair in rows.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        let crossing_s = |speed_m_s: f64| {
            let share = (speed_m_s - before.speed_m_s) / (after.speed_m_s - before.speed_m_s);
            before.middle_s + share * (after.middle_s - before.middle_s)
        };
        if before.speed_m_s <= low_m_s && after.speed_m_s > low_m_s {
            low_s = Some(crossing_s(low_m_s));
        } else if after.speed_m_s <= low_m_s {
            low_s = None;
        }
        if after.speed_m_s >= high_m_s && before.speed_m_s < high_m_s {
            rises_s.extend(low_s.take().map(|low_s| crossing_s(high_m_s) - low_s));
        }
    }
    rises_s
}

/// The least value below which so much of the weight is, with its own; `None` of nothing.
fn weighted_quantile(values: impl Iterator<Item = (f64, f64)>, share: f64) -> Option<f64> {
    let mut values: Vec<(f64, f64)> = values.collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut so_far = 0.0;
    let reached = values.iter().find(|(_, weight)| {
        so_far += weight;
        so_far >= share * all
    });
    reached.or(values.last()).map(|(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::dataset_of;
    use dataset::{Dataset, Odometry, Run, RunInfo, TruthSample, WheelLog};

    /// A robot of wheels of 0.16 m that stands, goes straight at 0.4 m/s for seconds and stands again, five
    /// times, and once at half of that; the first time it is pushed to its speed.
    fn driven(between_rows_s: f64, acceleration_m_s2: f64) -> Dataset {
        let starts = [11.0, 21.0, 31.0, 41.0].map(|from_s| (from_s, 0.4, acceleration_m_s2));
        let starts = [(1.0, 0.4, 40.0), (51.0, 0.2, acceleration_m_s2)].into_iter().chain(starts);
        let speed = |t_s: f64| {
            let of = |(from_s, top, up): (f64, f64, f64)| {
                (up * (t_s - from_s)).min(top).min(acceleration_m_s2 * (from_s + 8.0 - t_s)).max(0.0)
            };
            starts.clone().map(of).fold(0.0, f64::max)
        };
        let rows = (61.0 / between_rows_s) as usize;
        let fine = 100;
        let mut angle_rad = vec![0.0];
        for row in 0..rows {
            let at = |k: usize| (row as f64 + (k as f64 + 0.5) / fine as f64) * between_rows_s;
            let m: f64 = (0..fine).map(|k| speed(at(k))).sum::<f64>() * between_rows_s / fine as f64;
            angle_rad.push(angle_rad[row] + m / 0.08);
        }
        let t_s: Vec<f64> = (0..=rows).map(|row| row as f64 * between_rows_s).collect();
        let truth = t_s.iter().zip(&angle_rad).map(|(t_s, rad)| TruthSample::new(*t_s, 0.08 * rad, 0.0, Some(0.0)));
        let run = Run {
            info: RunInfo { continuous: true, ..RunInfo::default() },
            truth: truth.step_by(7).collect(),
            odometry: Odometry {
                t_s: t_s.clone().into(),
                wheels: WheelLog::Angles(Wheels { left: angle_rad.clone(), right: angle_rad }),
                ..Odometry::default()
            },
            ..Run::default()
        };
        Dataset { runs: vec![run], ..dataset_of(0, true) }
    }

    #[test]
    fn speed_and_acceleration_are_those_that_were_driven() {
        for (between_rows_s, acceleration_m_s2) in [(0.01, 0.5), (0.05, 0.25), (0.02, 2.0)] {
            let dataset = driven(between_rows_s, acceleration_m_s2);
            let session = dataset.session();
            let records = Records::of(std::slice::from_ref(&session));
            let model = Model::of(&session.robot.geometry().expect("plausible"), 0);
            let found = records.drive_statistics(&model).expect("it drives");
            assert!((found.cruise_speed_m_s / 0.4 - 1.0).abs() < 0.01, "{found:?}");
            // Rates are smoothed over a few rows.
            let found_m_s2 = found.acceleration_m_s2.expect("it starts from rest");
            assert!((found_m_s2 / acceleration_m_s2 - 1.0).abs() < 0.1, "{found:?} {acceleration_m_s2}");
        }
    }

    #[test]
    fn a_rise_goes_from_a_tenth_to_nine_tenths_without_a_stop() {
        let rows = |speeds: &[f64]| {
            let row = |(k, speed_m_s): (usize, &f64)| RowSpeed { middle_s: k as f64, dt_s: 1.0, speed_m_s: *speed_m_s };
            rise_times_s(&speeds.iter().enumerate().map(row).collect::<Vec<_>>(), 1.0)
        };
        let close = |found: Vec<f64>, expected: &[f64]| {
            assert!(
                found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
                "{found:?} {expected:?}"
            );
        };
        close(rows(&[0.0, 0.5, 1.0]), &[1.6]);
        close(rows(&[0.0, 1.0, 1.0, 0.0, 0.0, 0.5, 0.5, 0.9]), &[0.8, 2.8]);
        // It stops on the way, or drives already.
        close(rows(&[0.0, 0.5, 0.0, 1.0]), &[0.8]);
        close(rows(&[0.5, 1.0, 0.5, 1.0]), &[]);
    }

    #[test]
    fn a_quantile_counts_weights() {
        let of = |share| weighted_quantile([(3.0, 1.0), (1.0, 6.0), (2.0, 3.0)].into_iter(), share);
        assert_eq!([of(0.6), of(0.7), of(1.0)], [Some(1.0), Some(2.0), Some(3.0)]);
        assert_eq!(weighted_quantile([].into_iter(), 0.5), None);
    }
}
