//! Continuous variant parameters, such as a hinge speed or a time constant. They are fitted by their
//! profile likelihood, and their uncertainty widens the sizes.
//!
//! Near its minimum the cost is a parabola in the parameter's logarithm. Its curvature, and the range that
//! is tried, say how well the parameter is known. A size that depends on the parameter has σ² = σ²(θ | x) +
//! w². w is the change of the size over the parameter's 95 % interval, to either side, over 1.96.
//! Reference: Cox & Hinkley 1974 (profile likelihood).

use estimation::ModelFit;

use crate::fits::augmented_model::{AugmentedModel, cost, count, refit};
use crate::settings::{LEVELS, SEARCH};

/// One value of the parameter's logarithm, with the fit there.
struct Point<'a> {
    x: f64,
    model: AugmentedModel<'a>,
}

/// Fits the variant of a candidate of a model, where it has one that may be anything, and says how much
/// wider its sizes are for it: their standard deviations.
pub(crate) fn fit_variant<'a>(base: &ModelFit<'a>, model: &mut AugmentedModel<'a>, index: usize) -> Vec<f64> {
    let candidate = model.candidates[index].clone();
    let parameters = candidate.parameters().len();
    let first = model.range(index).start;
    let none = vec![0.0; parameters];
    let grid: Vec<f64> = candidate.grid().iter().map(|value| value.ln()).collect();
    let (Some(&low), Some(&high), Some(&(_, fixed))) = (grid.first(), grid.last(), candidate.fixed().first()) else {
        return none;
    };
    let mut step = (high - low) / (grid.len().max(2) - 1) as f64;
    // Beyond the values that are tried by half of a step of theirs: farther out nobody has looked for other
    // variants.
    let (low_end, high_end) = (low - 0.5 * step, high + 0.5 * step);
    let at = |x: f64| -> Option<Point<'a>> {
        let x = x.clamp(low_end, high_end);
        let mut candidates = model.candidates.clone();
        candidates[index] = candidate.moved_to(x.exp());
        Some(Point { x, model: refit(base, model, candidates)? })
    };
    let mut best = Point { x: fixed.ln(), model: model.clone() };
    let mut sigma = 0.0;
    for _ in 0..SEARCH.profile_iterations {
        let middle = best.x.clamp(low_end + 0.5 * step, high_end - 0.5 * step);
        if middle != best.x {
            let Some(point) = at(middle) else { return none };
            best = point;
        }
        step = step.min(high_end - best.x).min(best.x - low_end);
        let (Some(below), Some(above)) = (at(best.x - step), at(best.x + step)) else { return none };
        let most = [&below, &best, &above].map(|point| count(&point.model.fit)).into_iter().fold(0.0, f64::max);
        let costs = [&below, &best, &above].map(|point| cost(&point.model.fit, most));
        let (slope, curvature) =
            ((costs[2] - costs[0]) / (2.0 * step), (costs[2] - 2.0 * costs[1] + costs[0]) / (step * step));
        // Where nothing is known of it, it lies anywhere in the range that is tried.
        sigma = curvature.max(0.0).sqrt().recip().min(high_end - low_end);
        let vertex = if curvature > 0.0 { best.x + (-slope / curvature).clamp(-step, step) } else { best.x };
        let points = [Some(below), at(vertex), Some(above)].into_iter().flatten();
        best = points.fold(best, |best, point| {
            let most = count(&best.model.fit).max(count(&point.model.fit));
            if cost(&point.model.fit, most) < cost(&best.model.fit, most) { point } else { best }
        });
        step = (SEARCH.profile_step_sigmas * sigma).clamp(SEARCH.min_profile_step_ratio * step, step);
    }
    let ends = [best.x - LEVELS.normal_quantile_95 * sigma, best.x + LEVELS.normal_quantile_95 * sigma].map(at);
    let size = |point: &Point<'_>, k: usize| point.model.fit.solution.model.term_values[first + k];
    let extra_sigma = |k: usize| {
        let moved = ends.iter().flatten().map(|end| (size(end, k) - size(&best, k)).abs());
        moved.fold(0.0, f64::max) / LEVELS.normal_quantile_95
    };
    let extra_sigma = (0..parameters).map(extra_sigma).collect();
    *model = best.model;
    extra_sigma
}
