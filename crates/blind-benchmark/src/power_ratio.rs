//! How large an effect must be to be detected, in units of the oracle's detection limit: where the best
//! monotone curve of detection over size crosses 90 %, with a bootstrap over cases.

use super::draw::Draw;
use super::instrument::NoiseClass;
use super::measure_value::Measure;
use super::result::CaseResult;

/// Draws of the cases again, with replacement, for the limit of the power's ratio.
const BOOTSTRAPS: usize = 400;

/// The size, in detection limits, from which on nine of ten cases are detected: where the best monotone curve
/// of detection over size crosses 0.9.
pub(crate) fn power(seed: u64, cases: &[CaseResult]) -> Measure {
    let hit = |case: &CaseResult| f64::from(u8::from(case.findings().next().is_some()));
    let white = cases.iter().filter(|case| case.noise == NoiseClass::White);
    let mut points: Vec<(f64, f64)> = white.filter_map(|case| Some((case.resolved_mean()?, hit(case)))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let value = crossing(&points, 0.9);
    let mut draw = Draw::of(seed, u64::MAX, "bootstrap", 0);
    let mut again: Vec<f64> = (0..BOOTSTRAPS)
        .map(|_| {
            let mut drawn: Vec<(f64, f64)> = (0..points.len()).map(|_| points[draw.below(points.len())]).collect();
            drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
            crossing(&drawn, 0.9).unwrap_or(f64::INFINITY)
        })
        .collect();
    again.sort_by(f64::total_cmp);
    let limit = again[BOOTSTRAPS * 95 / 100];
    Measure {
        id: "power_ratio",
        what: "effect size with 90 % power over the oracle's",
        value,
        limit: Some(limit).filter(|limit| limit.is_finite()),
        interval: None,
        count: None,
        of: points.len(),
        bar: 1.6,
        at_most: true,
        met: (!points.is_empty()).then_some(limit <= 1.6),
    }
}

/// Where a monotone fit (pool adjacent violators; Ayer et al. 1955) of (size, 0 or 1), sorted by size, first
/// reaches a level.
fn crossing(points: &[(f64, f64)], level: f64) -> Option<f64> {
    // Blocks: first size, sum, number.
    let mut blocks: Vec<(f64, f64, f64)> = Vec::new();
    for (size, hit) in points {
        blocks.push((*size, *hit, 1.0));
        while let [.., a, b] = blocks[..]
            && a.1 / a.2 >= b.1 / b.2
        {
            blocks.pop();
            blocks.pop();
            blocks.push((a.0, a.1 + b.1, a.2 + b.2));
        }
    }
    blocks.iter().find(|(_, sum, n)| sum / n >= level).map(|(size, _, _)| *size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monotone_curve_crosses_where_it_should() {
        let step: Vec<(f64, f64)> = (0..100).map(|k| (f64::from(k), f64::from(u8::from(k >= 40)))).collect();
        assert_eq!(crossing(&step, 0.9), Some(40.0));
        // One miss far up: the block above it still has more than nine of ten, the one it is pooled with as
        // well.
        let mut missed = step.clone();
        missed[80].1 = 0.0;
        assert_eq!(crossing(&missed, 0.9), Some(40.0));
        assert_eq!(crossing(&[(1.0, 0.0)], 0.9), None);
    }
}
