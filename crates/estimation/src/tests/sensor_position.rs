//! The position of an instrument of positions alone, by hand-made runs.

use dataset::{Dataset, TruthSample, WheelLog};
use kinematics::{Increment, Pose, Wheels};

use super::{CENTRED_MODEL, dataset_of};
use crate::{Model, Records};

/// Straights, corners and whole turns of a robot that is 1 % off its nominal sizes, measured at every row
/// where its instrument is, with errors of so many metres.
fn measured(body_from_sensor: Pose, error_m: f64) -> Dataset {
    let (m_per_rad, separation_m) = (Wheels { left: 0.0808, right: 0.0796 }, 0.367);
    let legs: [&[(f64, f64, usize)]; 4] = [
        &[(0.5, 0.5, 20)],
        &[(-0.3, 0.3, 30)],
        &[(0.3, -0.3, 30)],
        &[(0.4, 0.4, 10), (-0.2, 0.2, 8), (0.4, 0.4, 10), (0.2, -0.2, 8), (0.5, 0.4, 20)],
    ];
    let mut dataset = dataset_of(4, false);
    for (number, (run, legs)) in dataset.runs.iter_mut().zip(legs).enumerate() {
        let mut pose = Pose::new(0.3, -0.2, 1.7 * number as f64 - 2.0);
        let mut angles = Wheels::both(vec![0.0]);
        run.truth.clear();
        let steps = legs.iter().flat_map(|(left, right, rows)| std::iter::repeat_n((*left, *right), *rows));
        for (row, (left, right)) in steps.chain([(0.0, 0.0)]).enumerate() {
            let seen = pose * body_from_sensor;
            let off = |k: f64| error_m * (12.9898 * (100 * number + row) as f64 + 78.233 * k).sin();
            run.truth.push(TruthSample::new(row as f64, seen.x_m + off(1.0), seen.y_m + off(2.0), None));
            let travel_m = Wheels { left: m_per_rad.left * left, right: m_per_rad.right * right };
            pose = pose * Increment::from_travel(travel_m, separation_m).arc();
            angles.left.push(angles.left[row] + left);
            angles.right.push(angles.right[row] + right);
        }
        run.odometry.t_s = (0..angles.left.len()).map(|row| row as f64).collect();
        run.odometry.wheels = WheelLog::Angles(angles);
    }
    dataset
}

fn found(dataset: &Dataset) -> Option<[f64; 2]> {
    let nominal = Model { m_per_rad: Wheels::both(0.08), separation_m: 0.363, ..CENTRED_MODEL };
    Records::of(&[dataset.session()]).sensor_position_m(&nominal)
}

/// A fit starts there: what two corrections leave of the drive's 1 % times the distance is less than a
/// thousandth of it.
#[test]
fn the_position_is_found_on_every_side_though_the_drive_is_a_per_cent_off() {
    for (x_m, y_m) in [(0.15, 0.0), (-0.15, 0.1), (0.0, -0.3), (0.02, 0.03), (-1.0, 0.5)] {
        let at = found(&measured(Pose::new(x_m, y_m, 0.4), 0.0)).expect("it is elsewhere");
        assert!((at[0] - x_m).hypot(at[1] - y_m) < 1e-3 * x_m.hypot(y_m), "{at:?} for {x_m} {y_m}");
    }
}

/// Sixty positions of 5 mm in two turns tell the position to some millimetres beside a drive that is not
/// known; what is near the centre is at the centre.
#[test]
fn what_is_near_the_centre_is_at_the_centre() {
    let at = found(&measured(Pose::new(0.1, -0.1, 0.0), 5e-3)).expect("it is elsewhere");
    assert!((at[0] - 0.1).hypot(at[1] + 0.1) < 1e-2, "{at:?}");
    assert_eq!(found(&measured(Pose::IDENTITY, 5e-3)), None);
    assert_eq!(found(&measured(Pose::new(1e-3, 0.0, 0.0), 5e-3)), None);
}

/// Straights alone do not tell the position, and measured headings tell it otherwise.
#[test]
fn nothing_is_found_where_nothing_turns_or_headings_are_measured() {
    let mut straight = measured(Pose::new(0.3, 0.1, 0.0), 1e-3);
    straight.runs.truncate(1);
    assert_eq!(found(&straight), None);
    let mut with_headings = measured(Pose::new(0.3, 0.1, 0.0), 0.0);
    for sample in with_headings.runs.iter_mut().flat_map(|run| &mut run.truth) {
        *sample = TruthSample::new(sample.t_s, sample.x_m, sample.y_m, Some(0.0));
    }
    assert_eq!(found(&with_headings), None);
}

/// A fit from the centre ends in another minimum: spins start at any heading there.
#[test]
fn regress_a_marker_off_the_centre_is_found_with_the_drive_by_positions_alone() {
    let dataset = measured(Pose::new(-0.15, 0.1, 0.0), 1e-3);
    let fit = crate::FitSettings::CALIBRATION.fit(&[dataset.session()]).expect("a fit");
    let Model { m_per_rad, separation_m, body_from_sensor, .. } = fit.solution.model;
    assert!(fit.solution.converged && fit.solution.pass.outliers.is_empty());
    // Errors of a millimetre over metres and turns.
    let off = [m_per_rad.left / 0.0808, m_per_rad.right / 0.0796, separation_m / 0.367];
    assert!(off.iter().all(|ratio| (ratio - 1.0).abs() < 1e-3), "{off:?}");
    assert!((body_from_sensor.x_m + 0.15).hypot(body_from_sensor.y_m - 0.1) < 1e-3, "{body_from_sensor:?}");
}
