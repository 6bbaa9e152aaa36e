//! Counts that were lost and restored, in the likelihood.

use dataset::RestoredMotion;

use super::rounding::counted;
use super::*;

/// Twelve counts² of each wheel from one row to the next.
fn restored(from_s: f64) -> RestoredMotion {
    RestoredMotion { from_s, to_s: from_s + 1.0, variance_counts2: Wheels::both(12.0) }
}

/// Turns add up whatever the path is between: that of the heading is as on paper, in one part or in those
/// that measurements within the row cut it into.
#[test]
fn what_is_restored_varies_the_heading_by_both_wheels() {
    let mut dataset = counted();
    // Between two measurements, and where the robot stands and is measured three times.
    dataset.runs[0].restored_motion = vec![restored(1.0), restored(3.0)];
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &MODEL);
    let of_run = |number: usize| -> Vec<f64> {
        let of = selections[0].propagations[number].iter().filter_map(|propagation| propagation.restored.as_deref());
        of.map(|restored| restored.matrix(0)[(2, 2)]).collect()
    };
    let of_wheel = |m_per_rad: f64| 12.0 * 0.01 * 0.01 * (m_per_rad / MODEL.separation_m).powi(2);
    let once = of_wheel(MODEL.m_per_rad.left) + of_wheel(MODEL.m_per_rad.right);
    let [first, second] = [of_run(0), of_run(1)];
    assert!(first.len() == 5 && second.is_empty(), "{first:?} {second:?}");
    assert!((first[0] / once - 1.0).abs() < 1e-9, "{first:?}");
    assert!(first[1..].iter().all(|quarter| (quarter / once - 0.25).abs() < 1e-9), "{first:?}");
}

/// A count that is off by much costs little where it is known to vary, and what comes after is as before.
#[test]
fn counts_that_vary_cost_less_where_they_are_off() {
    let off = |spans: Vec<RestoredMotion>| {
        let mut dataset = counted();
        let first = &mut dataset.runs[0];
        let WheelLog::Ticks(ticks) = &mut first.odometry.wheels else { unreachable!("counts") };
        // Ten counts too many in the second row, on both wheels.
        ticks.left[2..].iter_mut().chain(&mut ticks.right[2..]).for_each(|count| *count += 10);
        first.restored_motion = spans;
        let pass_options = PassOptions { gate: OutlierGate::Off, ..PassOptions::default() };
        run(&dataset, &model(), &NOISE, &[0.0, 0.0], pass_options).runs
    };
    let (taken, restored) =
        (off(Vec::new()), off(vec![RestoredMotion { variance_counts2: Wheels::both(100.0), ..restored(1.0) }]));
    assert!(restored[0].chi_square < taken[0].chi_square - 1.0, "{} {}", restored[0].chi_square, taken[0].chi_square);
    assert!(restored[0].log_det > taken[0].log_det);
    assert_eq!((restored[1].chi_square, restored[1].log_det), (taken[1].chi_square, taken[1].log_det));
}
