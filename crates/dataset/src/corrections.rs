//! What is wrong with a dataset's records as they stand in its files, and undone as they are read: the table
//! `[corrections]` of `dataset.toml`, whose keys `yair check` names.

use kinematics::Wheels;
use serde::Deserialize;

use crate::partial::HeadingReading;
use crate::pose_covariance::PoseCovariance;
use crate::read_times::read_times_s;
use crate::record::{Run, TruthSample, WheelLog};

/// Corrections of all runs; none by default.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Corrections {
    /// Factor of all times.
    pub(crate) time_factor: f64,
    /// Factor of the instrument's times.
    pub(crate) truth_time_factor: f64,
    /// Added to the instrument's times, seconds, after the factors.
    pub(crate) truth_shift_s: f64,
    /// What the instrument's clock gains on the log's from the start of the session on, seconds a second.
    pub(crate) truth_clock_rate: f64,
    /// Factor of the instrument's lengths.
    pub(crate) truth_length_factor: f64,
    heading_in_degrees: bool,
    heading_clockwise: bool,
    exchange_axes: bool,
    mirror_x: bool,
    mirror_y: bool,
    /// y and the heading change their signs.
    mirror_truth: bool,
    exchange_wheels: bool,
    reverse_left_wheel: bool,
    reverse_right_wheel: bool,
    /// Rates are of a row's instant, not of the interval that ends there.
    instant_rates: bool,
    /// Rows that are sent some at a time are stamped when they were read.
    restore_read_times: bool,
}

impl Default for Corrections {
    fn default() -> Self {
        Self {
            time_factor: 1.0,
            truth_time_factor: 1.0,
            truth_shift_s: 0.0,
            truth_clock_rate: 0.0,
            truth_length_factor: 1.0,
            heading_in_degrees: false,
            heading_clockwise: false,
            exchange_axes: false,
            mirror_x: false,
            mirror_y: false,
            mirror_truth: false,
            exchange_wheels: false,
            reverse_left_wheel: false,
            reverse_right_wheel: false,
            instant_rates: false,
            restore_read_times: false,
        }
    }
}

impl Corrections {
    /// Whether records stay as they are.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Corrects a run that was read.
    pub(crate) fn apply(&self, run: &mut Run) {
        if self.is_none() {
            return;
        }
        run.odometry.t_s.iter_mut().for_each(|t_s| *t_s *= self.time_factor);
        if self.restore_read_times
            && let Some(read_s) = read_times_s(&run.odometry.t_s)
        {
            run.odometry.t_s = read_s.into();
        }
        self.wheels(&run.odometry.t_s, &mut run.odometry.wheels);
        run.gyro.iter_mut().for_each(|sample| sample.t_s *= self.time_factor);
        let before_s = run.info.start_s.unwrap_or(0.0);
        run.map_measurement_times(|t_s| {
            *t_s = *t_s * self.time_factor * self.truth_time_factor + self.truth_shift_s;
            if self.truth_clock_rate != 0.0 {
                *t_s = (before_s + *t_s) / (1.0 + self.truth_clock_rate) - before_s;
            }
        });
        let length = |length_m: f64| length_m * self.truth_length_factor;
        let turn = |turn: f64| {
            let turn_rad = if self.heading_in_degrees { turn.to_radians() } else { turn };
            if self.heading_clockwise != self.mirror_truth { -turn_rad } else { turn_rad }
        };
        let place = |x: f64, y: f64| {
            let (x, y) = if self.exchange_axes { (y, x) } else { (x, y) };
            let y_is_mirrored = self.mirror_y != self.mirror_truth;
            (length(if self.mirror_x { -x } else { x }), length(if y_is_mirrored { -y } else { y }))
        };
        for sample in &mut run.truth {
            let (x_m, y_m) = place(sample.x_m, sample.y_m);
            *sample = TruthSample::new(sample.t_s, x_m, y_m, sample.theta_rad().map(turn));
        }
        // Errors go the way of what they are errors of.
        let [of_x, of_y] = [place(1.0, 0.0), place(0.0, 1.0)];
        for sigma in run.truth_sigma.iter_mut().flatten() {
            sigma.sigma_xy_m.iter_mut().for_each(|sigma_m| *sigma_m *= self.truth_length_factor.abs());
            sigma.sigma_theta_rad.iter_mut().for_each(|sigma_rad| *sigma_rad = turn(*sigma_rad).abs());
            let mapped = |of: &mut PoseCovariance| *of = of.mapped([[of_x.0, of_y.0], [of_x.1, of_y.1]], turn(1.0));
            sigma.covariance.iter_mut().for_each(mapped);
        }
        for heading in &mut run.headings {
            let [theta_rad, sigma_rad] = [turn(heading.theta_rad), turn(heading.sigma_rad).abs()];
            *heading = HeadingReading { theta_rad, sigma_rad, ..*heading };
        }
        for displacement in &mut run.displacements {
            (displacement.dx_m, displacement.dy_m) = place(displacement.dx_m, displacement.dy_m);
            displacement.dtheta_rad = turn(displacement.dtheta_rad);
        }
        for reading in &mut run.point_readings {
            (reading.room.x_m, reading.room.y_m) = place(reading.room.x_m, reading.room.y_m);
        }
        self.partial(run);
    }

    /// What a tape or a wall says is of the robot and no frame: lengths are corrected alone.
    fn partial(&self, run: &mut Run) {
        let length = |length_m: &mut f64| *length_m *= self.truth_length_factor;
        for of in &mut run.revisits {
            [&mut of.dx_m, &mut of.dy_m].into_iter().flatten().for_each(length);
        }
        for of in &mut run.distances {
            length(&mut of.distance_m);
        }
        for of in &mut run.walls {
            of.distance_m.iter_mut().for_each(length);
        }
    }

    fn wheels(&self, t_s: &[f64], wheels: &mut WheelLog) {
        match wheels {
            WheelLog::Ticks(ticks) => self.columns(ticks, i64::wrapping_neg),
            WheelLog::Angles(angles) => self.columns(angles, |angle| -angle),
            WheelLog::Speeds(speeds) => {
                self.columns(speeds, |speed| -speed);
                self.over_intervals(t_s, [&mut speeds.left, &mut speeds.right]);
            }
            WheelLog::Twist { v_mps, omega_radps } => {
                if self.exchange_wheels {
                    omega_radps.iter_mut().for_each(|omega| *omega = -*omega);
                }
                self.over_intervals(t_s, [v_mps, omega_radps]);
            }
        }
    }

    /// Rates of the instant as those of the interval that ends there: the mean of both ends.
    fn over_intervals(&self, t_s: &[f64], columns: [&mut Vec<f64>; 2]) {
        if !self.instant_rates || t_s.len() < 2 {
            return;
        }
        for rates in columns {
            for row in (1..rates.len()).rev() {
                rates[row] = 0.5 * (rates[row] + rates[row - 1]);
            }
        }
    }

    fn columns<T: Copy>(&self, columns: &mut Wheels<Vec<T>>, reversed: impl Fn(T) -> T) {
        if self.reverse_left_wheel {
            columns.left.iter_mut().for_each(|value| *value = reversed(*value));
        }
        if self.reverse_right_wheel {
            columns.right.iter_mut().for_each(|value| *value = reversed(*value));
        }
        if self.exchange_wheels {
            std::mem::swap(&mut columns.left, &mut columns.right);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Odometry;

    fn run() -> Run {
        Run {
            odometry: Odometry {
                t_s: vec![0.0, 1000.0].into(),
                wheels: WheelLog::Ticks(Wheels { left: vec![0, 7], right: vec![0, -9] }),
                ..Odometry::default()
            },
            truth: vec![TruthSample::new(500.0, 1000.0, 2000.0, Some(90.0))],
            ..Run::default()
        }
    }

    #[test]
    fn records_in_other_units_and_on_other_sides_are_those_of_the_format() {
        let corrections = Corrections {
            time_factor: 1e-3,
            truth_shift_s: -0.25,
            truth_length_factor: 1e-3,
            heading_in_degrees: true,
            mirror_truth: true,
            exchange_wheels: true,
            reverse_right_wheel: true,
            ..Corrections::default()
        };
        let mut run = run();
        corrections.apply(&mut run);
        assert_eq!(*run.odometry.t_s, [0.0, 1.0]);
        // The column called right is reversed, and is the left wheel's.
        assert_eq!(run.odometry.wheels, WheelLog::Ticks(Wheels { left: vec![0, 9], right: vec![0, 7] }));
        let quarter_rad = std::f64::consts::FRAC_PI_2;
        assert_eq!(run.truth, [TruthSample::new(0.25, 1.0, -2.0, Some(-quarter_rad))]);
    }

    #[test]
    fn a_clock_that_gains_counts_from_the_start_of_the_session() {
        let mut run = run();
        run.info.start_s = Some(600.0);
        Corrections { truth_clock_rate: 0.1, ..Corrections::default() }.apply(&mut run);
        // 1100 s of the instrument are 1000 s of the log, of which 600 went before.
        assert!((run.truth[0].t_s - 400.0).abs() < 1e-9, "{}", run.truth[0].t_s);
    }

    #[test]
    fn rates_of_the_instant_become_those_of_the_interval_that_ends_there() {
        let mut run = run();
        run.odometry.wheels = WheelLog::Twist { v_mps: vec![1.0, 3.0], omega_radps: vec![0.0, 0.5] };
        Corrections { instant_rates: true, ..Corrections::default() }.apply(&mut run);
        assert_eq!(run.odometry.wheels, WheelLog::Twist { v_mps: vec![1.0, 2.0], omega_radps: vec![0.0, 0.25] });
    }

    #[test]
    fn rows_that_are_sent_five_at_a_time_are_stamped_when_they_were_read() {
        // Of a long log the beat is found; a short one has the mean gap of its packets.
        for rows in [200, 50] {
            let read_s: Vec<f64> = (0..rows).map(|row| 0.01 * f64::from(row)).collect();
            // With the last of its packet, 0.1 ms after each other.
            let sent = |row: i32| 0.01 * f64::from(row / 5 * 5 + 4) + 1e-4 * f64::from(row % 5 - 4);
            let [mut bunched, mut even] = [run(), run()];
            bunched.odometry.t_s = (0..rows).map(sent).collect::<Vec<f64>>().into();
            even.odometry.t_s = read_s.clone().into();
            let corrections = Corrections { restore_read_times: true, ..Corrections::default() };
            for mut run in [bunched, even] {
                corrections.apply(&mut run);
                let off = run.odometry.t_s.iter().zip(&read_s).map(|(t_s, read_s)| (t_s - read_s).abs());
                assert!(off.fold(0.0, f64::max) < 1e-9, "{:?}", run.odometry.t_s);
            }
        }
    }

    #[test]
    fn no_correction_changes_nothing() {
        let mut same = run();
        Corrections::default().apply(&mut same);
        assert_eq!(same, run());
    }
}
