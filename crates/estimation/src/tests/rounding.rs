//! The rounding of counts in the likelihood.

use dataset::{TruthSample, WheelLog};

use super::*;

/// The runs of [`dataset`] as counts of 0.01 rad, measured at every row, and three times more while the robot
/// stands between the rows of seconds 3 and 4.
pub(super) fn counted() -> Dataset {
    let mut dataset = dataset(true);
    dataset.robot.ticks_per_rev = Some(std::f64::consts::TAU / 0.01);
    for run in &mut dataset.runs {
        let WheelLog::Angles(angles) = &run.odometry.wheels else { unreachable!("the helper logs angles") };
        let ticks = |column: &Vec<f64>| column.iter().map(|rad| (rad / 0.01 + 0.3).floor() as i64).collect();
        run.odometry.wheels = WheelLog::Ticks(angles.as_ref().map(ticks));
        let still = run.truth.iter().find(|sample| sample.t_s == 4.0).copied().expect("a measurement at rest");
        let at = |t_s: f64| {
            let off = |k: f64| 3e-3 * (31.7 * t_s + 78.233 * k).sin();
            let theta = still.theta_rad().map(|theta_rad| theta_rad + off(3.0));
            TruthSample::new(t_s, still.x_m + off(1.0), still.y_m + off(2.0), theta)
        };
        run.truth.extend([3.25, 3.5, 3.75].map(at));
        run.truth.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    }
    dataset
}

/// As [`the_noise_score_is_the_derivative_of_the_cost`], through standstills: the recursions there are
/// differentiated too.
#[test]
fn the_noise_score_of_rounded_counts_is_the_derivative_of_the_cost() {
    let dataset = counted();
    let pass_options = PassOptions { gate: OutlierGate::Off, noise_score: true, ..PassOptions::default() };
    let score = run(&dataset, &model(), &NOISE, &[0.0, 0.0], pass_options).noise.gradient;
    for k in 0..4 {
        let h = 1e-4_f64;
        let at = |by: f64| {
            let mut noise = NOISE;
            noise.variance[k] *= by.exp();
            cost(&run(&dataset, &model(), &noise, &[0.0, 0.0], pass_options))
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        // As there.
        let tolerance = 2e-3 * (1.0 + difference.abs());
        assert!((score[k] - difference).abs() < tolerance, "{k}: {} {difference}", score[k]);
    }
}

/// Derivatives of the mean go through standstills as they go through motion.
#[test]
fn the_gradient_of_rounded_counts_is_that_of_the_cost() {
    let dataset = counted();
    let options = PassOptions { gate: OutlierGate::Off, ..PassOptions::default() };
    let found = run(&dataset, &model(), &NOISE, &[0.0, 0.0], options);
    let equations = total(&found.runs).expect("two runs");
    for column in columns() {
        let k = column.index();
        let scale = equations.information[(k, k)].sqrt();
        let h = 1e-3 / scale;
        let at = |by: f64| {
            let mut model = model();
            model.advance(column, by);
            cost(&run(&dataset, &model, &NOISE, &[0.0, 0.0], options))
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        // That the rounding of counts grows with the wheels is left out as well: 0.5 % of a standard
        // deviation.
        assert!(
            (equations.gradient[k] - difference).abs() / scale < 0.03,
            "{column:?}: {} {difference} {scale}",
            equations.gradient[k]
        );
    }
}

/// Where a robot is by its counts, the variance of that, and its derivative by a parameter that moves it by
/// as much, once it was measured twice within a row with an error of 1: each time after going on so far.
/// Everything is along the robot: P = R = 1, Q = 1 of rounding, or of motion within the row at these
/// instants.
fn measured_twice(moved_and_measured: [(f64, f64); 2], within_row: Option<[f64; 2]>) -> [f64; 3] {
    use crate::covariances::{Covariance, Covariances};
    use crate::derivatives::Derivatives;
    use crate::filter_state::{FilterState, Step};
    use crate::rounding::Rounding;
    use nalgebra::{Matrix3, Vector3};

    // A base so wide that its heading knows no rounding.
    let model = Model { m_per_rad: Wheels::both(1.0), separation_m: 1e9, ..MODEL };
    let columns = Column::BASE.len();
    // Of the centre, a quarter of both wheels' q²/12.
    let quantum_rad = if within_row.is_some() { 0.0 } else { 24_f64.sqrt() };
    let mut rounding = Rounding::new(Wheels::both(quantum_rad), columns);
    let (mut pose, mut by) = (Pose::IDENTITY, Derivatives::zeros(columns));
    by.set(0, Vector3::new(1.0, 0.0, 0.0));
    let mut covariance = Covariance::of([&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1e-9))]);
    let mut covariance_by = Covariances::ZERO;
    let mut pose_by_noise = [[0.0; 4]; 3];
    let none = Derivatives::zeros(0);
    let mut on_state = |of: &mut dyn FnMut(&mut Rounding, &mut FilterState<'_>)| {
        let mut state = FilterState {
            pose: &mut pose,
            covariance: &mut covariance,
            by: &mut by,
            covariance_by: &mut covariance_by,
            pose_by_noise: &mut pose_by_noise,
        };
        of(&mut rounding, &mut state);
    };
    for (number, (moved_m, measured)) in moved_and_measured.into_iter().enumerate() {
        let interpolated_rad2 = Wheels::both(within_row.map_or(0.0, |of| 2.0 * of[number]));
        let step = Step {
            motion: Pose::new(moved_m, 0.0, 0.0),
            by_geometry: [Vector3::zeros(); 3],
            by_terms: &none,
            first_term: Column::BASE.len(),
            noise: &Covariances::ZERO,
            variance: [0.0; 2],
            restored: None,
            noise_score: false,
        };
        on_state(&mut |rounding, state| {
            rounding.advance(&step);
            state.advance(&step);
            rounding.pass(state, false);
            let heading = kinematics::Rotation::by(state.pose.theta_rad);
            rounding.enter(state, [1.0, 1.0], interpolated_rad2, &model, heading);
            let (h, v) = (Vector3::x(), measured - state.pose.x_m);
            let ph = Vector3::from(state.covariance.along(&h).map(|[along]| along));
            let gain = ph / (h.dot(&ph) + 1.0);
            state.covariance.lower(&gain, &ph);
            let by: Vec<f64> = state.by.x.iter().map(|by| -by).collect();
            state.by.add(gain, &by);
            state.pose.x_m += gain.x * v;
        });
    }
    on_state(&mut |rounding, state| rounding.leave(state, false));
    [pose.x_m, covariance.matrix(0)[(0, 0)], by.x[0]]
}

/// Counts stand while a robot is measured n times: what that says of the pose that its counts stand for is no
/// better than a count. By hand for n = 2: P − P²/(P + Q + R/n) = 0.6, and z⁺ = ȳ·P/(P + Q + R/n).
#[test]
fn a_standstill_does_not_average_rounding_out() {
    let [x_m, variance, by] = measured_twice([(0.0, 2.0), (0.0, 4.0)], None);
    // Rejects rounding that is new at each measurement, 1 − 1/(1 + 2/2) = 0.5, and none at all, 1/3.
    assert!((variance - 0.6).abs() < 1e-12, "{variance}");
    assert!((x_m - 3.0 / 2.5).abs() < 1e-12 && (by - 0.6).abs() < 1e-12, "{x_m} {by}");
}

/// A robot that goes on within a row takes the error of that row along, and what the counts say of it goes on
/// as far.
#[test]
fn a_rows_error_goes_along_with_the_robot() {
    // Measured at 2, then at 7 after five metres: as two measurements of 2 at the first place.
    let [x_m, variance, _] = measured_twice([(0.0, 2.0), (5.0, 7.0)], None);
    // Rejects counts that stay where they were: 0.4 of five metres. The heading's variance of 1e-9 adds its
    // 25-fold across.
    assert!((x_m - (5.0 + 2.0 / 2.5)).abs() < 1e-6 && (variance - 0.6).abs() < 1e-6, "{x_m} {variance}");
}

/// What nobody recorded of the motion within a row is nothing at its end. By hand: the first measurement,
/// of Q + R = 2, leaves P = 2/3 and the counts at 2/3; the second, at the row's end, is of R = 1 alone.
#[test]
fn the_motion_within_a_row_is_no_error_at_its_end() {
    let [x_m, variance, _] = measured_twice([(0.0, 2.0), (0.0, 4.0)], Some([1.0, 0.0]));
    // Rejects an error that the robot takes along to the row's end, as it does with the rounding of counts:
    // 0.6.
    assert!((variance - 0.4).abs() < 1e-12, "{variance}");
    assert!((x_m - (2.0 / 3.0 + 0.4 * (4.0 - 2.0 / 3.0))).abs() < 1e-12, "{x_m}");
}
