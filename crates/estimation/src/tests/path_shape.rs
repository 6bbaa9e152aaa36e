//! What a path was like, by the counts.

use super::*;
use crate::PathShape;

/// The shape of twelve rows in which the wheels turn by so much each.
fn shape(turns_rad: impl Fn(u32) -> Wheels<f64>) -> PathShape {
    let mut dataset = dataset_of(1, true);
    let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
    for row in 0..12_u32 {
        let turned = turns_rad(row);
        angles.left.push(angles.left[row as usize] + turned.left);
        angles.right.push(angles.right[row as usize] + turned.right);
    }
    dataset.runs[0].odometry.wheels = WheelLog::Angles(angles);
    let records = Records::of(&[dataset.session()]);
    PathShape::of(&records.segments, &Model::of(&dataset.robot.geometry().expect("a geometry"), 0))
}

#[test]
fn a_path_is_measured_along_and_in_its_turns() {
    // Wheels of 0.08 m: 0.2 m a row along, 0.08 m of one wheel beyond the other. Not exact to the last
    // place, as twelve rows are summed.
    let circle = shape(|_| Wheels { left: 2.0, right: 3.0 });
    assert!((circle.distance_m - 2.4).abs() < 1e-9 && (circle.turn_travel_m - 0.48).abs() < 1e-9, "{circle:?}");
    assert!((circle.net_turn_share - 1.0).abs() < 1e-9 && circle.curvature_spread < 1e-6, "{circle:?}");
    // Turns that alternate: the same length and as much turning, to no end. Rejects a net turn for all turns.
    let winding =
        shape(|row| if row % 2 == 0 { Wheels { left: 2.0, right: 3.0 } } else { Wheels { left: 3.0, right: 2.0 } });
    assert!((winding.turn_travel_m - 0.48).abs() < 1e-9 && winding.net_turn_share < 1e-9, "{winding:?}");
    let spin = shape(|_| Wheels { left: -2.0, right: 2.0 });
    assert!(spin.distance_m < 1e-9 && (spin.turn_travel_m - 1.92).abs() < 1e-9, "{spin:?}");
}
