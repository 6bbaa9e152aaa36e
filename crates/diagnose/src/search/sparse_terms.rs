//! Sparse terms: products of covariates that are in no catalogue, each if it predicts held-out runs better.

use effects::{Channel, Covariate, Sparse};
use estimation::ModelFit;
use kinematics::Side;

use crate::candidates::candidate::Candidate;
use crate::candidates::covariates::{of_cycles, of_runs};
use crate::findings::geometry_deviations::keeps_wheels;
use crate::fits::augmented_model::{AugmentedModel, refit, refit_each};
use crate::fits::cancellation::effects_cancel;
use crate::fits::model_comparison::{form_error_statistic, log_bayes_factor};
use crate::fits::null_distribution::NullDistribution;
use crate::fits::reliability::unresolved;
use crate::fits::scan::{Scored, scan};
use crate::fits::statistics::{p_of_chi_square, sidak};
use crate::fits::wald::wald_test;
use crate::gain::gain;
use crate::settings::{LEVELS, SEARCH};

/// A sparse term with its model.
pub(crate) struct FoundTerm<'a> {
    pub(crate) model: AugmentedModel<'a>,
    pub(crate) p_value: f64,
    /// How many products were tried.
    pub(crate) trials: usize,
    /// Its gain on held-out runs is more than two half-widths of the 95 % interval above zero;
    /// autocorrelated measurements, which differ from run to run, do not reach that.
    pub(crate) certain: bool,
    /// Measurements are likelier with it, but odometry drifts more: it stands for something else.
    pub(crate) drifts_more: bool,
}

/// Log of the trials of a sparse term.
fn log_trials(trials: usize) -> f64 {
    (trials as f64).ln()
}

/// Uncatalogued terms: a model whose last candidates are sparse terms.
pub(crate) struct UncataloguedTerms<'a> {
    pub(crate) model: AugmentedModel<'a>,
    /// Of each sparse term, its p-value and how many were tried.
    pub(crate) tried: Vec<(f64, usize)>,
}

impl<'a> UncataloguedTerms<'a> {
    /// A term that was found, and further ones beside it.
    pub(crate) fn from(base: &ModelFit<'a>, first: FoundTerm<'a>) -> Self {
        let mut all = Self { model: first.model, tried: vec![(first.p_value, first.trials)] };
        while all.tried.len() < SEARCH.max_sparse_terms
            && let Some(next) = sparse(base, &all.model, LEVELS.sparse_term_level)
        {
            all.model = next.model;
            all.tried.push((next.p_value, next.trials));
        }
        all
    }

    /// Log Bayes factor over a fit without terms, corrected for the trials.
    pub(crate) fn log_bayes_factor(&self, alone: &ModelFit<'a>) -> f64 {
        log_bayes_factor(alone, &self.model) - self.log_trials()
    }

    /// Log of the trials of its sparse terms.
    fn log_trials(&self) -> f64 {
        self.tried.iter().map(|(_, trials)| log_trials(*trials)).sum()
    }

    /// The indices of its sparse terms among the model's candidates, each with its p-value and how many
    /// were tried.
    pub(crate) fn terms(&self) -> impl Iterator<Item = (usize, f64, usize)> {
        let first = self.model.candidates.len() - self.tried.len();
        self.tried.iter().enumerate().map(move |(k, &(p_value, trials))| (first + k, p_value, trials))
    }
}

/// Products of at most three covariates that vanish at standstill.
pub(crate) fn library(fit: &ModelFit<'_>) -> Vec<Candidate> {
    use Covariate::{
        AbsSpeed, AbsYawRate, Acceleration, CosHeading, CosPhase, Curvature, LastTurn, RunTime, SessionTime,
        SinHeading, SinPhase, SinceReversal, Speed, Way, X, Y, YawAcceleration, YawRate,
    };
    let rates = [vec![Speed], vec![AbsSpeed], vec![YawRate], vec![AbsYawRate]];
    let modulators = [
        vec![AbsSpeed],
        vec![AbsYawRate],
        vec![Speed],
        vec![YawRate],
        vec![CosHeading],
        vec![SinHeading],
        vec![RunTime],
        vec![SessionTime],
        vec![Way],
        vec![SinceReversal],
        vec![X],
        vec![Y],
        vec![AbsSpeed, AbsSpeed],
        vec![AbsYawRate, AbsYawRate],
        vec![AbsSpeed, AbsYawRate],
        vec![AbsSpeed, CosHeading],
        vec![AbsSpeed, SinHeading],
    ];
    let mut products: Vec<Vec<Covariate>> = rates.to_vec();
    for rate in &rates {
        for modulator in modulators.iter().cloned().chain(of_runs(fit).into_iter().map(|covariate| vec![covariate])) {
            products.push(rate.iter().cloned().chain(modulator).collect());
        }
    }
    // A turn has the sense of the last one itself.
    for rate in [Speed, AbsSpeed] {
        products.push(vec![rate.clone(), LastTurn]);
        products.push(vec![rate, SinceReversal, LastTurn]);
    }
    for alone in [Acceleration, YawAcceleration] {
        products.push(vec![alone.clone()]);
        products.push(vec![alone.clone(), AbsSpeed]);
        products.push(vec![alone, AbsYawRate]);
    }
    for side in Side::BOTH {
        products.push(vec![CosPhase(side, 1)]);
        products.push(vec![SinPhase(side, 1)]);
    }
    let wheels = of_wheels(fit).into_iter().flat_map(|covariates| {
        Channel::WHEELS.map(|channel| Candidate::Sparse(Sparse { channel, covariates: covariates.clone() }))
    });
    let moved = products.into_iter().flat_map(|covariates| {
        Channel::MOTION.map(|channel| Candidate::Sparse(Sparse { channel, covariates: covariates.clone() }))
    });
    // On a spin a bend is the sense of the turn: of the yaw alone it says what speeds do not.
    let bends = [AbsSpeed, AbsYawRate]
        .map(|rate| Candidate::Sparse(Sparse { channel: Channel::Yaw, covariates: vec![rate, Curvature] }));
    let of_instrument = [vec![], vec![Speed], vec![YawRate], vec![CosHeading], vec![SinHeading], vec![RunTime]];
    let of_instrument = of_instrument.into_iter().flat_map(|covariates| {
        Channel::INSTRUMENT.map(|channel| Candidate::Sparse(Sparse { channel, covariates: covariates.clone() }))
    });
    let cycles = Side::BOTH.into_iter().flat_map(of_cycles).map(Candidate::Sparse);
    moved
        .chain(bends)
        .chain(wheels)
        .chain(cycles)
        .chain(of_instrument)
        .chain([Candidate::Sparse(Sparse::of_rows())])
        .collect()
}

/// What wheels may do by themselves. Their way alone is their size, which every fit has.
fn of_wheels(fit: &ModelFit<'_>) -> Vec<Vec<Covariate>> {
    use Covariate::{
        AbsWheelSpeed, AbsYawRate, CosPhase, RunTime, SessionTime, SinPhase, SinceReversal, SlowWheel, Way,
        WheelAcceleration, WheelSense, WheelSinceReversal, WheelSpeed,
    };
    let modulators = [AbsWheelSpeed, AbsYawRate, RunTime, SessionTime, Way, SinceReversal, WheelSinceReversal];
    let modulators: Vec<Covariate> = modulators.into_iter().chain(of_runs(fit)).collect();
    let mut products = vec![vec![AbsWheelSpeed], vec![WheelSense], vec![WheelAcceleration]];
    products.push(vec![WheelAcceleration, AbsWheelSpeed]);
    products.push(vec![WheelAcceleration, SlowWheel]);
    products.push(vec![WheelSpeed, SlowWheel]);
    products.extend(Side::BOTH.into_iter().flat_map(|side| [vec![CosPhase(side, 1)], vec![SinPhase(side, 1)]]));
    products.push(vec![WheelSpeed, AbsWheelSpeed, AbsWheelSpeed]);
    for rate in [WheelSpeed, AbsWheelSpeed, WheelSense] {
        let own = modulators.iter().filter(|modulator| !(rate == WheelSense && **modulator == AbsWheelSpeed));
        products.extend(own.map(|modulator| vec![rate.clone(), modulator.clone()]));
    }
    products
}

/// Sparse terms beside a model by their scores, and the best of them refitted.
pub(crate) struct SparseSearch<'m, 'a> {
    model: &'m AugmentedModel<'a>,
    p_value: f64,
    trials: usize,
    refitted: Vec<AugmentedModel<'a>>,
}

impl<'m, 'a> SparseSearch<'m, 'a> {
    /// The search beside a model; `None` where no term is detectable, or the best is not significant by its
    /// score at a level.
    pub(crate) fn beside(level: f64, base: &ModelFit<'a>, model: &'m AugmentedModel<'a>) -> Option<Self> {
        // No finding is asked for at a higher level.
        let scored = scan(&model.fit, &model.candidates, &library(base));
        let (scored, p_value) = best_first(model, scored, level, LEVELS.sparse_term_level)?;
        let trials = scored.len();
        if p_value > level {
            return None;
        }
        let with = |scored: &Scored| {
            refit(base, model, [&model.candidates[..], std::slice::from_ref(&scored.candidate)].concat())
                .filter(|extended| keeps_wheels(&model.fit, &extended.fit) && !effects_cancel(extended))
        };
        let best = SEARCH.max_sparse_refits.min(trials);
        Some(Self { model, p_value, trials, refitted: refit_each(&scored[..best], with) })
    }

    /// The best of them that predicts held-out runs better, if the best is significant by its score, and
    /// unless odometry drifts more with it.
    pub(crate) fn finding(&self, level: f64) -> Option<FoundTerm<'a>> {
        self.best_prediction(level).filter(|term| !term.drifts_more)
    }

    /// The same, whether odometry drifts more with it or not.
    pub(crate) fn best_prediction(&self, level: f64) -> Option<FoundTerm<'a>> {
        if self.p_value > level {
            return None;
        }
        let predicting = self.refitted.iter().filter_map(|extended| {
            let earned = gain(self.model, extended).ok()?;
            let score = earned.log_score_per_observation;
            let certain = score.low + score.high > 2.0 * (score.high - score.low);
            (score.low > 0.0).then_some((score.extended, extended, certain, earned.drifts_more()))
        });
        let (_, extended, certain, drifts_more) = predicting.max_by(|a, b| a.0.total_cmp(&b.0))?;
        // What is no more than the error of a larger effect's form is none beside it.
        let (test, _) = wald_test(extended, self.model.candidates.len())?;
        // As many parameters as observations leave no scatter, and a size without one is not determined.
        let is_determined = test.estimates.iter().all(|(_, sigma)| sigma.is_finite());
        let is_found = is_determined && test.statistic >= form_error_statistic(self.model);
        is_found.then(|| FoundTerm {
            model: extended.clone(),
            p_value: self.p_value,
            trials: self.trials,
            certain,
            drifts_more,
        })
    }

    /// All that were refitted, and of how many they are the best by their scores.
    pub(crate) fn refitted(&self) -> (&[AugmentedModel<'a>], usize) {
        (&self.refitted, self.trials)
    }

    /// The likeliest of them.
    pub(crate) fn likeliest(&self) -> Option<&AugmentedModel<'a>> {
        self.refitted.iter().max_by(|a, b| self.log_bayes_factor_of(a).total_cmp(&self.log_bayes_factor_of(b)))
    }

    /// Log Bayes factor of one of them, corrected for the trials.
    pub(crate) fn log_bayes_factor_of(&self, model: &AugmentedModel<'a>) -> f64 {
        log_bayes_factor(&self.model.fit, model) - log_trials(self.trials)
    }
}

/// Terms by their scores beside a model, the best first, and its p-value, of those that the encoders resolve;
/// `None` where none is detectable. Which they are is found out if the best may be significant at the level
/// that is asked for, and coarse encoders are asked where it is significant at the second level without them.
pub(crate) fn best_first(
    model: &AugmentedModel<'_>,
    mut scored: Vec<Scored>,
    asked: f64,
    deflated: f64,
) -> Option<(Vec<Scored>, f64)> {
    scored.retain(|scored| scored.dimensions > 0);
    scored.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
    let best = (2 * SEARCH.max_sparse_refits).min(scored.len());
    // Of fewer trials the best is more significant.
    if sidak(scored.first()?.p_value, (scored.len() - best).max(1)) <= asked {
        let unresolved = unresolved(&model.fit, &model.candidates, &scored[..best]);
        scored.retain(|scored| !unresolved.contains(&scored.candidate));
    }
    let trials = scored.len();
    let p_value = |scored: &[Scored]| Some(sidak(scored.first()?.p_value, trials));
    if p_value(&scored)? <= deflated
        && let Some(null) = NullDistribution::of(model)
    {
        deflate_best(&null, &mut scored);
    }
    let p_value = p_value(&scored)?;
    Some((scored, p_value))
}

/// Takes the statistics of the best over what coarse encoders inflate them by, and puts them in order again.
fn deflate_best(null: &NullDistribution<'_, '_>, scored: &mut [Scored]) {
    let best = SEARCH.max_sparse_refits.min(scored.len());
    let parts: Vec<&[Candidate]> = scored[..best].iter().map(|of| std::slice::from_ref(&of.candidate)).collect();
    let inflation = null.inflation(&parts);
    for (scored, inflation) in scored.iter_mut().zip(inflation) {
        scored.statistic /= inflation;
        scored.p_value = p_of_chi_square(scored.statistic, scored.dimensions as f64).max(scored.p_value);
    }
    scored[..best].sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
}

/// The best sparse term beside a model.
pub(crate) fn sparse<'a>(base: &ModelFit<'a>, model: &AugmentedModel<'a>, level: f64) -> Option<FoundTerm<'a>> {
    SparseSearch::beside(level, base, model)?.finding(level)
}
