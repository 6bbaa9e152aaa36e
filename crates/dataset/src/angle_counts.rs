//! Angles that a driver makes of counts.

use crate::settings::ANGLE_COUNTS;

/// What a count of recorded angles stands for, where nearly all steps are multiples of one angle: a driver
/// that turns counts into angles leaves them rounded. 0 where they are not. The greatest common divisor by
/// Euclid, up to the rounding of the file's numbers.
#[must_use]
pub fn quantum_of_angles(angle_rad: &[f64]) -> f64 {
    let steps = || {
        angle_rad.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > ANGLE_COUNTS.quantum_tolerance)
    };
    let divisor = |mut a: f64, mut b: f64| {
        while b > ANGLE_COUNTS.quantum_tolerance {
            (a, b) = (b, (a - (a / b).round() * b).abs());
        }
        a
    };
    let quantum = steps()
        .take(ANGLE_COUNTS.min_grid_steps)
        .fold(0.0, |quantum: f64, step| divisor(quantum.max(step), quantum.min(step)));
    if quantum < ANGLE_COUNTS.min_quantum_rad || steps().count() < ANGLE_COUNTS.min_grid_steps {
        return 0.0;
    }
    let (on_grid, all) = steps().fold((0.0, 0.0_f64), |(on_grid, all), step| {
        let off_rad = step - (step / quantum).round() * quantum;
        (on_grid + f64::from(u8::from(off_rad.abs() < 0.1 * quantum)), all + 1.0)
    });
    if on_grid >= ANGLE_COUNTS.min_grid_fraction * all { quantum } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_that_are_counts_are_known_as_such() {
        let angle = |row: i32| 0.03 * f64::from(row) - 1.5 * (0.011 * f64::from(row)).cos();
        let smooth: Vec<f64> = (0..800).map(angle).collect();
        let quantum_rad = std::f64::consts::TAU / 4096.0;
        let counted: Vec<f64> = smooth.iter().map(|rad| (rad / quantum_rad).floor() * quantum_rad).collect();
        let found = quantum_of_angles(&counted);
        assert!((found * 4096.0 / std::f64::consts::TAU - 1.0).abs() < 1e-3, "{found}");
        assert_eq!(quantum_of_angles(&smooth), 0.0);
        assert_eq!(quantum_of_angles(&counted[..50]), 0.0, "too few to say");
        assert_eq!(quantum_of_angles(&[1.0; 500]), 0.0, "at rest");
    }

    /// Angles from 0 on, by steps of so many counts.
    fn by_counts(quantum_rad: f64, steps: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut counts = 0.0;
        std::iter::once(0.0)
            .chain(steps.map(|step| {
                counts += step;
                quantum_rad * counts
            }))
            .collect()
    }

    #[test]
    fn a_count_is_the_common_divisor_of_steps_in_both_directions() {
        // Two counts ahead, three back, ten ahead: no step is one count.
        let steps = || [2.0, -3.0, 10.0].into_iter().cycle().take(150);
        let found = quantum_of_angles(&by_counts(0.01, steps()));
        // Rounding of angles of some radians, a few times. Rejects the smallest step, 0.02.
        assert!((found - 0.01).abs() < 1e-12, "{found}");
    }

    #[test]
    fn a_hundred_steps_say_what_a_count_is_and_those_too_small_are_exact() {
        let of = |quantum_rad: f64, steps: usize| {
            quantum_of_angles(&by_counts(quantum_rad, [1.0, 2.0].into_iter().cycle().take(steps)))
        };
        assert!((of(0.01, ANGLE_COUNTS.min_grid_steps) - 0.01).abs() < 1e-12);
        assert_eq!(of(0.01, ANGLE_COUNTS.min_grid_steps - 1), 0.0);
        // Rows at rest are no steps, nor is a file's rounding of a microradian.
        let with_rests: Vec<f64> = (0..ANGLE_COUNTS.min_grid_steps - 1)
            .flat_map(|step| [0.0, 0.0, 1e-6].map(|by| 0.01 * step as f64 + by))
            .collect();
        assert_eq!(quantum_of_angles(&with_rests), 0.0);
        // 3e-5 rad and less are as good as exact. Rejects a limit on one of both alone.
        assert_eq!(of(2.5e-5, 3 * ANGLE_COUNTS.min_grid_steps), 0.0);
        assert!((of(3.5e-5, 3 * ANGLE_COUNTS.min_grid_steps) - 3.5e-5).abs() < 1e-12);
    }

    #[test]
    fn of_a_hundred_steps_two_may_be_beside_the_grid() {
        // The first hundred of 200 steps are counts; of the others some are off by so much of one.
        let of = |off: f64, some: usize| {
            let steps = (0..200).map(|step| if step >= 200 - some { 3.0 + off } else { 2.0 + (step % 2) as f64 });
            quantum_of_angles(&by_counts(0.01, steps))
        };
        assert!((of(0.3, 4) - 0.01).abs() < 1e-12);
        assert_eq!((of(0.3, 5), of(-0.3, 5)), (0.0, 0.0));
        // A tenth of a count is the limit.
        assert!(of(0.08, 20) > 0.0 && of(-0.08, 20) > 0.0);
        assert_eq!((of(0.12, 20), of(-0.12, 20)), (0.0, 0.0));
    }
}
