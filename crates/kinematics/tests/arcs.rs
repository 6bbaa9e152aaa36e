//! An arc's end that noise moves, against the chord's frame as the product of poses gives it.

use kinematics::{Increment, Point, Pose};

#[test]
fn a_perturbed_end_lies_in_the_frame_of_the_chord() {
    for (distance_m, turn_rad) in [(1.2, 0.8), (-0.7, 2.9), (0.4, 0.0)] {
        let increment = Increment { distance_m, turn_rad };
        let perturbed = increment.perturbed_arc(0.3, -0.2);
        // The chord of an arc stands at half of its turn.
        let start_from_chord = Pose::new(0.0, 0.0, 0.5 * turn_rad);
        let chord_m = (start_from_chord.inverse() * increment.arc().position()).x_m;
        let expected = start_from_chord * Point { x_m: chord_m + 0.3, y_m: -0.2 };
        let place = perturbed.pose().position();
        // A few roundings of numbers near 1; so below.
        assert!(place.distance_m(expected) < 1e-15, "{perturbed:?}");
        assert_eq!(perturbed.pose().theta_rad, turn_rad);
        // The heading that products use, by sine and cosine of the half turn.
        let ahead = perturbed * Point { x_m: 1.0, y_m: 0.0 };
        let turned = Point { x_m: place.x_m + turn_rad.cos(), y_m: place.y_m + turn_rad.sin() };
        assert!(ahead.distance_m(turned) < 1e-15, "{ahead:?} {turned:?}");
    }
}
