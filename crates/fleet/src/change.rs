//! What changed between two sessions of one robot.
//!
//! Sessions are calibrated apart, so that their errors are independent: the difference of a parameter has the
//! sum of both variances, and under no change z = (θ₂ − θ₁)/√(σ₁² + σ₂²) is standard normal (Wald 1943). The
//! variances are those that the calibration gives, cluster-robust over runs where runs suffice.

use serde::Serialize;
use statrs::function::erf::erfc;

use crate::geometry::{GEOMETRY, GeometryEstimate};

/// A parameter in two consecutive sessions of one robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// The parameter's key.
    pub parameter: &'static str,
    /// The earlier dataset.
    pub from: String,
    /// The later dataset.
    pub to: String,
    /// The value in the earlier session, metres.
    pub before: f64,
    /// The value in the later session, metres.
    pub after: f64,
    /// Later minus earlier, metres.
    pub difference: f64,
    /// One standard deviation of the difference, metres.
    pub sigma: f64,
    /// The difference over its standard deviation.
    pub z: f64,
    /// Probability of as large a |z| without a change.
    pub p_value: f64,
    /// Smallest false-discovery rate over the fleet at which this is a discovery.
    pub q_value: f64,
    /// Whether it is one at the fleet's rate.
    pub significant: bool,
}

/// The probability of as large a |z| or a larger one, of a standard normal variable.
pub(crate) fn two_sided(z: f64) -> f64 {
    erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// The parameters that both sessions determine; [`Change::q_value`] is that of a single test.
pub(crate) fn changes(from: (&str, &GeometryEstimate), to: (&str, &GeometryEstimate)) -> Vec<Change> {
    let of = |row: usize| {
        let (before, after) = (from.1.value_m[row]?, to.1.value_m[row]?);
        let sigma = from.1.sigma_m(row)?.hypot(to.1.sigma_m(row)?);
        let z = (after - before) / sigma;
        let p_value = two_sided(z);
        let (from, to) = (from.0.to_owned(), to.0.to_owned());
        let parameter = GEOMETRY[row].key();
        let difference = after - before;
        let significant = false;
        Some(Change {
            parameter,
            from,
            to,
            before,
            after,
            difference,
            sigma,
            z,
            p_value,
            q_value: p_value,
            significant,
        })
    };
    (0..GEOMETRY.len()).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value_m: [Option<f64>; 3], sigma_m: f64) -> GeometryEstimate {
        let covariance =
            [0, 1, 2].map(|row| [0, 1, 2].map(|column| if row == column { sigma_m * sigma_m } else { 0.0 }));
        GeometryEstimate { value_m, covariance_m2: Some(covariance), not_observable: Vec::new() }
    }

    #[test]
    fn variances_of_both_sessions_add_and_what_one_does_not_determine_is_no_change() {
        let before = estimate([Some(0.100), None, Some(0.300)], 3e-4);
        let after = estimate([Some(0.101), Some(0.1), Some(0.300)], 4e-4);
        let found = changes(("a", &before), ("b", &after));
        let [left, separation] = &found[..] else { panic!("{found:?}") };
        // 1 mm over √(0.3² + 0.4²) mm.
        assert!((left.z - 2.0).abs() < 1e-9 && (left.sigma - 5e-4).abs() < 1e-15, "{left:?}");
        // The normal distribution beyond two standard deviations.
        assert!((left.p_value - 0.045_500_263_896).abs() < 1e-9, "{left:?}");
        assert_eq!((separation.parameter, separation.p_value), ("wheel_separation_m", 1.0));
        let unknown = GeometryEstimate { covariance_m2: None, ..after };
        assert!(changes(("a", &before), ("b", &unknown)).is_empty());
    }
}
