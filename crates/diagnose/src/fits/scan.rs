//! Score tests: what a term would add to a fit, from one pass at the fit's values.
//!
//! With the normal equation (I, g) over all columns, n what the fit holds free and c a candidate's
//! parameters: I_c|n = I_cc − I_cn I_nn⁻¹ I_nc, g_c|n = g_c − I_cn I_nn⁻¹ g_n, and gᵀI⁻¹g is χ² without the
//! effect and noncentral with λ = sizeᵀ I_c|n size. In units of what would be a large size, directions that
//! even such a size would not show are left out: they cost power and show nothing.
//! Reference: Rao 1948 (score test); Laplace's approximation of the evidence under a prior of the sizes.

use estimation::{Column, ModelFit, NormalEquations, Projected, RIDGE, inverse, total};
use model_term::TermParameter;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::candidates::candidate::{Candidate, batched_terms, terms};
use crate::fits::statistics::p_of_score;
use crate::settings::SEARCH;

/// A candidate's test.
#[derive(Debug, Clone)]
pub(crate) struct Scored {
    pub(crate) candidate: Candidate,
    pub(crate) parameters: Vec<TermParameter>,
    /// Its projected information.
    pub(crate) information: DMatrix<f64>,
    /// How many directions are tested.
    pub(crate) dimensions: usize,
    pub(crate) statistic: f64,
    pub(crate) p_value: f64,
    /// Its sizes by one step of the fit, and their standard deviations; none where they are not determined.
    pub(crate) estimates: Vec<(f64, f64)>,
    /// Log Bayes factor of the effect over none, with a normal prior of the sizes about zero.
    pub(crate) log_odds: f64,
    /// Do the encoders resolve what it goes by? What they do not has no dimension.
    pub(crate) resolved: bool,
}

impl Scored {
    /// The test of a term that the encoders do not resolve: none.
    pub(crate) fn unresolved(self) -> Self {
        Self {
            dimensions: 0,
            statistic: 0.0,
            p_value: 1.0,
            estimates: Vec::new(),
            log_odds: 0.0,
            resolved: false,
            ..self
        }
    }
}

/// A candidate's information in units of what is plausible.
pub(crate) fn prior_scaled(information: &DMatrix<f64>, parameters: &[TermParameter]) -> DMatrix<f64> {
    let of = |i: usize, j: usize| information[(i, j)] * parameters[i].prior_sigma * parameters[j].prior_sigma;
    DMatrix::from_fn(parameters.len(), parameters.len(), of)
}

/// A candidate's information and gradient in units of what is plausible, along its principal directions:
/// eigenvalue and gradient of each.
fn principal(information: &DMatrix<f64>, gradient: &DVector<f64>, parameters: &[TermParameter]) -> Vec<(f64, f64)> {
    let prior_sigma = DVector::from_fn(parameters.len(), |k, _| parameters[k].prior_sigma);
    let scaled_gradient = gradient.component_mul(&prior_sigma);
    let eigen = prior_scaled(information, parameters).symmetric_eigen();
    (0..parameters.len()).map(|k| (eigen.eigenvalues[k], eigen.eigenvectors.column(k).dot(&scaled_gradient))).collect()
}

/// The directions in which a size shows in the data at all. What is beyond numbers of double precision
/// shows nothing.
pub(crate) fn detectable_directions(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    parameters: &[TermParameter],
) -> Vec<(f64, f64)> {
    let mut directions = principal(information, gradient, parameters);
    directions.retain(|(value, gradient)| {
        let is_number = value.is_finite() && (gradient * gradient).is_finite();
        is_number && *value >= SEARCH.min_detectable_sigmas * SEARCH.min_detectable_sigmas
    });
    directions
}

/// Log Occam factor: log evidence with some sizes free over that at the best sizes. It is what their
/// freedom costs, and how well they agree with their prior.
///
/// Sizes are normal about zero. The scale is anything from what is plausible down to a thousandth of it,
/// with equal probabilities in its logarithm (a mixture of g-priors; Liang et al. 2008): a small effect is
/// not less likely because a large one would have been plausible. `directions` are principal ones: the
/// information of a plausible size, and the χ² that the direction explains.
pub(crate) fn log_occam_factor(directions: &[(f64, f64)]) -> f64 {
    let at = |scale: i32| -> f64 {
        let square = 0.25_f64.powi(scale);
        let of = |(value, explained): &(f64, f64)| {
            -0.5 * explained / (1.0 + square * value) - 0.5 * (square * value).ln_1p()
        };
        directions.iter().map(of).sum()
    };
    let all: Vec<f64> = (0..SEARCH.prior_scales).map(at).collect();
    let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = all.iter().map(|log_factor| (log_factor - most).exp()).sum();
    most + (sum / f64::from(SEARCH.prior_scales)).ln()
}

/// The statistic of candidates that are tested as a whole, over the directions that are detectable, and how
/// many these are.
pub(crate) fn detectable_statistic(own: &[Candidate], projected: &Projected) -> (f64, usize) {
    let Projected { information, gradient, .. } = projected;
    let parameters: Vec<_> = own.iter().flat_map(Candidate::parameters).collect();
    detectable_directions(information, gradient, &parameters)
        .into_iter()
        .fold((0.0, 0), |(sum, n), (value, gradient)| (sum + gradient * gradient / value, n + 1))
}

/// How many values the noise was estimated from, after the free columns.
pub(crate) fn freedom(fit: &ModelFit<'_>, equations: &NormalEquations) -> f64 {
    let columns = fit.columns.len() as f64;
    (equations.count - columns).max(1.0)
}

/// Evaluates parts of a scan. The candidates of a part are tested as a whole beside those that the fit has.
/// `answer` gets them, what the fit leaves of their columns, and the normal equations. Nothing where the
/// fit's own columns are not determined.
///
/// Rows of a fast log are taken together where the fit stays the same on them.
pub(crate) fn scan_parts_of<T: Send>(
    fit: &ModelFit<'_>,
    chosen: &[Candidate],
    parts: &[&[Candidate]],
    answer: impl Fn(&[Candidate], &Projected, &NormalEquations) -> T + Sync,
) -> Vec<T> {
    if parts.is_empty() {
        return Vec::new();
    }
    let coarse = fit.decimated(&mut terms(chosen), SEARCH.decimation_step_s);
    let fit = coarse.as_ref().unwrap_or(fit);
    let of_pass = |parts: &&[&[Candidate]]| {
        let mut all = terms(chosen);
        let mut at = Column::BASE.len() + all.iter().map(|term| term.parameters().len()).sum::<usize>();
        all.extend(batched_terms(parts.iter().copied().flatten()));
        let columns_of: Vec<usize> = parts.iter().map(|part| columns_of(part)).collect();
        let Some(equations) = total(&fit.scan_parts(&mut all, &columns_of)) else { return Vec::new() };
        let Some(projection) = fit.eliminated(&equations, &[]) else { return Vec::new() };
        let of_part = |(part, own): (&&[Candidate], &usize)| {
            let columns: Vec<usize> = (at..at + own).collect();
            at += own;
            answer(part, &projection.of_columns(&equations, &columns), &equations)
        };
        parts.iter().zip(&columns_of).map(of_part).collect::<Vec<T>>()
    };
    passes(parts).par_iter().flat_map_iter(of_pass).collect()
}

fn columns_of(part: &[Candidate]) -> usize {
    part.iter().map(|candidate| candidate.parameters().len()).sum()
}

/// The parts in the groups of one pass each: as many columns as a pass carries well.
fn passes<'p, 'c>(parts: &'p [&'c [Candidate]]) -> Vec<&'p [&'c [Candidate]]> {
    let (mut passes, mut first, mut columns) = (Vec::new(), 0, 0);
    for (number, part) in parts.iter().enumerate() {
        let own = columns_of(part);
        columns += own;
        if columns > SEARCH.max_columns_per_pass && number > first {
            passes.push(&parts[first..number]);
            (first, columns) = (number, own);
        }
    }
    passes.push(&parts[first..]);
    passes
}

/// Tests every candidate beside the candidates that the fit already has.
pub(crate) fn scan(fit: &ModelFit<'_>, chosen: &[Candidate], candidates: &[Candidate]) -> Vec<Scored> {
    let each: Vec<&[Candidate]> = candidates.chunks(1).collect();
    scan_parts_of(fit, chosen, &each, |own, projected, equations| {
        score_test(&own[0], own[0].parameters(), projected, equations.count, freedom(fit, equations))
    })
}

/// The score test of a candidate by what the fit leaves of its columns; `count` observations, of which the
/// free columns leave `freedom`.
fn score_test(
    candidate: &Candidate,
    parameters: Vec<TermParameter>,
    Projected { information, gradient, share }: &Projected,
    count: f64,
    freedom: f64,
) -> Scored {
    // Noise is estimated by likelihood, without its degrees of freedom.
    let shrink = freedom / count.max(1.0);
    let mut directions = Vec::new();
    if share.iter().any(|share| *share > SEARCH.min_column_share) {
        directions = detectable_directions(information, gradient, &parameters);
    }
    let dimensions = directions.len();
    let explained: Vec<(f64, f64)> =
        directions.iter().map(|(value, gradient)| (*value, shrink * gradient * gradient / value)).collect();
    let statistic: f64 = explained.iter().map(|(_, explained)| explained).sum();
    let log_odds = 0.5 * statistic + log_occam_factor(&explained);
    let p_value = p_of_score(statistic / shrink, dimensions, count, freedom);
    let estimates = inverse(information, RIDGE).map_or(Vec::new(), |covariance| {
        let step = -(&covariance * gradient);
        step.iter().zip(covariance.diagonal().iter()).map(|(size, var)| (*size, var.sqrt())).collect()
    });
    Scored {
        candidate: candidate.clone(),
        parameters,
        information: information.clone(),
        dimensions,
        statistic,
        p_value,
        estimates,
        log_odds,
        resolved: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: TermParameter = TermParameter { name: "a", unit: "1", prior_sigma: 1.0 };

    /// I = [[4, 2], [2, 3]] and g = (−2, −4): I⁻¹ = [[3, −2], [−2, 4]]/8, −I⁻¹g = (−1/4, 3/2), gᵀI⁻¹g =
    /// 11/2. Eigenvalues (7 ± √17)/2 = 5.56 and 1.44.
    fn projected() -> Projected {
        Projected {
            information: DMatrix::from_row_slice(2, 2, &[4.0, 2.0, 2.0, 3.0]),
            gradient: DVector::from_column_slice(&[-2.0, -4.0]),
            share: vec![1.0, 1.0],
        }
    }

    fn tested(prior_sigma: [f64; 2], count: f64, freedom: f64) -> Scored {
        let candidate = Candidate::Effect { id: "slip_speed", variant: 0, at: None };
        let parameters = prior_sigma.map(|prior_sigma| TermParameter { prior_sigma, ..UNIT }).to_vec();
        score_test(&candidate, parameters, &projected(), count, freedom)
    }

    #[test]
    fn the_score_test_of_two_parameters_is_that_on_paper() {
        let scored = tested([1.0, 1.0], 1e9, 1e9);
        assert_eq!(scored.dimensions, 2);
        // Rejects (Σg)²/ΣI = 36/11, and a sum of gᵢ²/Iᵢᵢ = 1 + 16/3. Rounding and the ridge change it by
        // 1e-11 at most.
        assert!((scored.statistic - 5.5).abs() < 1e-11, "{}", scored.statistic);
        // χ² with two degrees of freedom: e^(−11/4). The tail of F with 1e9 degrees of freedom rounds by
        // some 1e-6 of it.
        assert!((scored.p_value / f64::exp(-2.75) - 1.0).abs() < 1e-5, "{}", scored.p_value);
        let expected = [(-0.25, 0.375_f64.sqrt()), (1.5, 0.5_f64.sqrt())];
        for ((size, sigma), (of, sd)) in scored.estimates.iter().zip(expected) {
            // Rejects a step along the gradient, +I⁻¹g.
            assert!((size - of).abs() < 1e-11 && (sigma - sd).abs() < 1e-11, "{:?}", scored.estimates);
        }
    }

    #[test]
    fn directions_that_a_plausible_effect_does_not_show_are_not_tested() {
        // A prior sigma of 0.1 on the second: [[4, 0.2], [0.2, 0.03]], eigenvalues 4.0100 and 0.0199.
        // Rejects a threshold in the parameters' own units, which keeps both.
        let scored = tested([1.0, 0.1], 1e9, 1e9);
        assert_eq!(scored.dimensions, 1);
        // The estimates are those of both parameters still.
        assert!((scored.estimates[1].0 - 1.5).abs() < 1e-11);
        assert_eq!(tested([0.1, 0.1], 1e9, 1e9).dimensions, 0);
    }

    #[test]
    fn few_degrees_of_freedom_shrink_the_statistic() {
        // 20 observations, 5 free columns: 15/20 of 5.5. Rejects a variance over the count, which leaves 5.5.
        let scored = tested([1.0, 1.0], 20.0, 15.0);
        assert!((scored.statistic - 4.125).abs() < 1e-11, "{}", scored.statistic);
    }

    #[test]
    fn the_occam_factor_is_a_mean_over_scales() {
        // Nothing known of the size: the data are as likely with the effect as without.
        assert!((0.5 * 9.0 + log_occam_factor(&[(0.0, 9.0)])).abs() < 1e-15);
        // Information V = 1e12: each scale 2⁻ˢ costs ½ ln(4⁻ˢ V), and the mean over eleven is Σ2ˢ/11 =
        // 2047/11 over √V. The smallest 4⁻ˢV is 1e6, hence 1e-5. Rejects a mean of the logs, which gives 5
        // ln 2 in place of ln 186.
        let found = log_occam_factor(&[(1e12, 9.0)]);
        assert!((found - (f64::ln(2047.0 / 11.0) - 0.5 * f64::ln(1e12))).abs() < 1e-5, "{found}");
        // Freedom costs: two such directions cost about twice the root of V, and share their scale: Σ4ˢ/11
        // over V.
        let found = log_occam_factor(&[(1e12, 0.0), (1e12, 0.0)]);
        let scales: f64 = (0..11).map(|scale| 4_f64.powi(scale)).sum();
        assert!((found - ((scales / 11.0).ln() - f64::ln(1e12))).abs() < 1e-5, "{found}");
    }
}
