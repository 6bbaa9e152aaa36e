//! Many tests at once: which of them are discoveries.
//!
//! Of m tests the procedure of Benjamini & Hochberg calls the k smallest p-values discoveries, where k is the
//! largest number with p₍k₎ ≤ k·q/m; the expected share of false ones among them is then at most q. It holds
//! for independent tests and for tests with positive regression dependence (Benjamini & Yekutieli 2001). The
//! tests of a fleet are independent between robots. Those of one robot are not: its parameters are
//! correlated, and two changes share the session between them. The test of this file that simulates this
//! dependence keeps the rate.
//!
//! Reference: Benjamini & Hochberg 1995, eq. 1.

/// The smallest false-discovery rate at which each test is a discovery (the adjusted p-value, or q-value), in
/// the order of `p_values`, which lie in [0, 1].
#[must_use]
pub fn q_values(p_values: &[f64]) -> Vec<f64> {
    let count = p_values.len();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| p_values[*a].total_cmp(&p_values[*b]));
    let mut q_values = vec![1.0; count];
    let mut smallest: f64 = 1.0;
    // From the largest p-value down: a test is a discovery wherever one with a larger p-value is.
    for (place, &test) in order.iter().enumerate().rev() {
        smallest = smallest.min(p_values[test] * count as f64 / (place + 1) as f64);
        q_values[test] = smallest;
    }
    q_values
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use statrs::function::erf::erfc;

    #[test]
    fn published_example_of_benjamini_and_hochberg() {
        // Their section 3.2: 15 p-values, of which the procedure rejects four at q = 0.05; Bonferroni rejects
        // three.
        let p_values = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528,
            0.7590, 1.0000,
        ];
        let q_values = q_values(&p_values);
        assert_eq!(q_values.iter().filter(|q| **q <= 0.05).count(), 4);
        // By hand: 0.0095 · 15/4.
        assert!((q_values[3] - 0.035_625).abs() < 1e-15);
        assert_eq!(q_values[14], 1.0);
    }

    #[test]
    fn the_order_does_not_matter_and_nothing_is_no_discovery() {
        let forward = q_values(&[0.01, 0.02, 0.9]);
        let mut backward = q_values(&[0.9, 0.02, 0.01]);
        backward.reverse();
        assert_eq!(forward, backward);
        // 0.01 · 3 and 0.02 · 3/2 are the same.
        assert!((forward[0] - 0.03).abs() < 1e-15 && (forward[1] - 0.03).abs() < 1e-15);
        assert!(q_values(&[]).is_empty());
    }

    /// Two-sided p-values of the changes of a robot with four sessions, whose three parameters share half of
    /// their variance; `shift` is what each true change adds, standard deviations of a change.
    fn robot(random: &mut Xoshiro256PlusPlus, changes: bool, shift: f64) -> Vec<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let session = |of: &mut dyn FnMut() -> f64| {
            let common = of();
            [0; 3].map(|_| (common + of()) / 2.0_f64.sqrt())
        };
        let sessions: Vec<[f64; 3]> = (0..4).map(|_| session(&mut normal)).collect();
        let added = if changes { shift } else { 0.0 };
        let pairs =
            sessions.windows(2).flat_map(|pair| (0..3).map(move |of| (pair[1][of] - pair[0][of]) / 2.0_f64.sqrt()));
        pairs.map(|z: f64| erfc((z + added).abs() / 2.0_f64.sqrt())).collect()
    }

    /// Mean share of false ones among the discoveries over 2000 fleets of twelve robots; three change.
    fn false_share(of: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1995);
        let fleets = 2000;
        let mut total = 0.0;
        for _ in 0..fleets {
            let p_values: Vec<f64> = (0..12).flat_map(|number| robot(&mut random, number < 3, 4.0)).collect();
            let found: Vec<usize> =
                of(&p_values).iter().enumerate().filter(|(_, q)| **q <= 0.1).map(|(at, _)| at).collect();
            // Robot by robot nine changes: the first 27 are true.
            let wrong = found.iter().filter(|at| **at >= 27).count();
            total += wrong as f64 / found.len().max(1) as f64;
        }
        total / f64::from(fleets)
    }

    /// The procedure promises 0.1 · 9/12 = 0.075 for independent tests. The share of one fleet has a standard
    /// deviation below 0.1, so that the mean of 2000 has one below 0.0023; four of them are allowed.
    /// Without a correction the share is 0.2.
    #[test]
    fn the_rate_holds_over_correlated_parameters_and_shared_sessions() {
        let kept = false_share(q_values);
        assert!(kept < 0.075 + 4.0 * 0.0023 && kept > 0.03, "{kept}");
        let uncorrected = false_share(<[f64]>::to_vec);
        assert!(uncorrected > 0.15, "{uncorrected}");
    }
}
