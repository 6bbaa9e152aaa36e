//! Where partial measurements leave lengths open, the wheels stay as they are stated, and the separation is
//! the one that goes with them: a robot that turns as it was seen to.

use nalgebra::DVector;

use crate::settings::PARTIAL;

/// Directions in relative left wheel, right wheel and separation that are not determined, turned into the
/// plane of the wheels. They stay as they are where the separation itself is among them, and where
/// measurements are not partial alone.
pub(crate) fn with_stated_wheels(directions: Vec<DVector<f64>>, is_partial: bool) -> Vec<DVector<f64>> {
    let of_separation: f64 = directions.iter().map(|direction| direction[2] * direction[2]).sum();
    if !is_partial || of_separation > PARTIAL.max_separation_share {
        return directions;
    }
    match &directions[..] {
        [only] => vec![DVector::from_vec(vec![only[0], only[1], 0.0]).normalize()],
        [_, _] => vec![DVector::from_vec(vec![1.0, 0.0, 0.0]), DVector::from_vec(vec![0.0, 1.0, 0.0])],
        _ => directions,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wheels_are_held_unless_the_separation_is_open_itself() {
        let of = |values: [f64; 3]| DVector::from_column_slice(&values);
        let third = 3.0_f64.sqrt().recip();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (scale, ratio, separation) = (of([third; 3]), of([half, -half, 0.0]), of([0.0, 0.0, 1.0]));
        let spins = vec![scale.clone(), ratio.clone()];
        assert_eq!(with_stated_wheels(spins.clone(), true), [of([1.0, 0.0, 0.0]), of([0.0, 1.0, 0.0])]);
        assert_eq!(with_stated_wheels(spins.clone(), false), spins);
        let held = with_stated_wheels(vec![scale], true);
        // Rounding of a root.
        assert!(held.len() == 1 && (&held[0] - of([half, half, 0.0])).amax() < 1e-15, "{held:?}");
        let open = vec![ratio, separation];
        assert_eq!(with_stated_wheels(open.clone(), true), open);
        assert!(with_stated_wheels(Vec::new(), true).is_empty());
    }
}
