//! The condition of normal equations: what they determine by roundings alone is refused with the number.

use nalgebra::DMatrix;

use crate::estimate::{CalibError, Parameter};
use crate::settings::MAX_NORMAL_CONDITION;

/// Ratio of the extreme eigenvalues of a normal matrix with its diagonal scaled to one: units do not matter.
/// Infinite where it is singular.
fn condition(normal: &DMatrix<f64>) -> f64 {
    let n = normal.nrows();
    let size = normal.diagonal().map(f64::sqrt);
    let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] / (size[i] * size[j]));
    // The search of eigenvalues does not end on what is no number.
    if !scaled.iter().all(|element| element.is_finite()) {
        return f64::INFINITY;
    }
    let eigenvalues = scaled.symmetric_eigenvalues();
    let ratio = eigenvalues.max() / eigenvalues.min();
    // A singular matrix has an eigenvalue of zero, or of a rounding to either side of it.
    if ratio >= 1.0 { ratio } else { f64::INFINITY }
}

/// Refuses normal equations whose solution would be of roundings.
///
/// # Errors
/// [`CalibError::Unobservable`] with what is missing and the condition.
pub(crate) fn well_conditioned(
    method: &'static str,
    parameter: Parameter,
    normal: &DMatrix<f64>,
    missing: &str,
) -> Result<(), CalibError> {
    let condition = condition(normal);
    if condition <= MAX_NORMAL_CONDITION {
        return Ok(());
    }
    let found = if condition.is_finite() { format!("of condition {condition:.0e}") } else { "singular".to_owned() };
    let why = format!("{missing} (its normal equations are {found}; at most {MAX_NORMAL_CONDITION:.0e})");
    Err(CalibError::Unobservable { method, parameter, why })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_is_that_of_the_directions_and_not_of_the_units() {
        // Unit diagonal and a cosine c have eigenvalues 1 ± c.
        let of = |cosine: f64, unit: f64| {
            condition(&DMatrix::from_row_slice(2, 2, &[1.0, cosine * unit, cosine * unit, unit * unit]))
        };
        assert!((of(0.6, 1.0) - 4.0).abs() < 1e-12 && (of(0.6, 1e8) - 4.0).abs() < 1e-12);
        assert_eq!(of(1.0, 1.0), f64::INFINITY);
        // Nothing moves: no number at all.
        assert_eq!(condition(&DMatrix::zeros(2, 2)), f64::INFINITY);
    }

    #[test]
    fn a_condition_of_1e13_is_refused_with_its_number_and_one_of_1e11_is_not() {
        let of = |condition: f64| {
            let cosine = 1.0 - 2.0 / condition;
            let normal = DMatrix::from_row_slice(2, 2, &[1.0, cosine, cosine, 1.0]);
            well_conditioned("ivanjko", Parameter::LeftWheelDiameter, &normal, "drive it")
        };
        of(1e11).expect("determined");
        let refused = of(1e13).expect_err("not determined").to_string();
        assert!(refused.contains("of condition 1e13; at most 1e12"), "{refused}");
        let refused = of(f64::INFINITY).expect_err("not determined").to_string();
        assert!(refused.contains("singular") && !refused.contains("inf"), "{refused}");
    }
}
