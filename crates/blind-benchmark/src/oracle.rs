//! The oracle: what a case's runs show of a hidden effect to who knows everything but its size.
//!
//! The robot drives once more with the same draws, but without any noise, and is looked at without error. The
//! likelihood of the true noise, at the drive that fits best without the effect, then sees what of the
//! signature the geometry parameters leave. Its χ² less what the drive's geometry parameters take up is the
//! noncentrality λ of the test that knows the effect; how much less of it another name's hypothesis takes up
//! is that of the test between the two names. Of another form, and where the is random in part signature, it
//! is what the effect's own hypothesis takes up that counts: nobody can know more. No measurement is rejected
//! as an outlier. Scatter has no mean: with excess variance e of the innovations, run by run, ½ Σ e² is what
//! a score test of the variance has (one-sided, so 8.56). Approximate: errors that last are taken as white
//! ones with the same weight over long times, heavy tails as normal with the same variance.

use dataset::Dataset;
use effects::{CATALOGUE, Hypothesis, hypothesis};
use estimation::{Column, Information, Model, NormalEquations, inverse};
use kinematics::{DriveGeometry, Pose, Wheels};
use model_term::{ModelTerm, TermParameter};
use nalgebra::{DMatrix, DVector};

use super::noise_free::NoiseFree;
use super::true_noise::TrueNoise;

/// What is known of the geometry parameters before any data, as a share: the tool holds to nominal what it
/// sees worse.
const GEOMETRY_PRIOR_SD: f64 = 0.05;
/// A rival's sizes are free up to so many times what is plausible.
const RIVAL_SD: f64 = 10.0;
/// A size within so many standard deviations of nothing may be nothing.
const ZERO_WITHIN_SIGMAS: f64 = 3.0;

/// One shape of one name, and where its columns are.
struct Candidate {
    id: &'static str,
    fixed: Vec<(&'static str, f64)>,
    parameters: Vec<TermParameter>,
    columns: std::ops::Range<usize>,
}

/// Which effects' hypotheses noise-free runs are fitted by.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Hypotheses<'n> {
    /// All of the catalogue: to see which of them are told from each other.
    All,
    /// One: to see how large its effect is.
    One(&'n str),
}

/// What noise-free runs show at the true drive.
pub(crate) struct Detectability {
    /// At the geometry parameters that a calibration without the effect would find: a turn lost all along a
    /// path is of second order in it before that.
    total: NormalEquations,
    /// χ² of the signature at the true geometry.
    at_truth: f64,
    /// The drive with that geometry.
    best: Model,
    candidates: Vec<Candidate>,
    free: Vec<usize>,
    /// ½ Σ e², e being the mean squared innovation of a run.
    pub(crate) scatter: f64,
}

/// Half of the χ² of noise-free runs under a model with terms: what the model costs of the log score, on
/// average over the measurements' errors.
pub(crate) fn misfit(datasets: &[Dataset], model: &Model, noise: TrueNoise, terms: &mut [Box<dyn ModelTerm>]) -> f64 {
    let runs = NoiseFree::of(datasets).with_best_headings(model, noise, terms);
    runs.measurement(model, noise, terms).map_or(0.0, |measured| 0.5 * measured.total.chi_square)
}

/// What a model with terms gains in log score over another without them on noise-free runs, on average over
/// the measurements' errors, and the standard deviation that these give the gain; `None` where both predict
/// the same.
///
/// With whitened residuals a and b of noise-free runs, less what the runs' starts take of them, and normal
/// errors e, the gain is ½|a + e|² − ½|b + e|² = ½|a|² − ½|b|² + (a − b)·e. The model halfway has residuals
/// ½(a + b), and ½|a|² + ½|b|² − 2 · ½|½(a + b)|² = ¼|a − b|².
pub(crate) fn gain_of_terms(
    datasets: &[Dataset],
    noise: TrueNoise,
    plain: &Model,
    extended: &Model,
    terms: &mut [Box<dyn ModelTerm>],
) -> Option<(f64, f64)> {
    let a = misfit(datasets, plain, noise, &mut []);
    let b = misfit(datasets, extended, noise, terms);
    let halfway = misfit(datasets, &halfway(plain, extended), noise, terms);
    let squared = 4.0 * (a + b - 2.0 * halfway);
    (squared > 0.0).then(|| (a - b, squared.sqrt()))
}

/// The model halfway between one without terms and one with them.
fn halfway(plain: &Model, extended: &Model) -> Model {
    let mean = |a: f64, b: f64| 0.5 * (a + b);
    let (a, b) = (plain.body_from_sensor, extended.body_from_sensor);
    Model {
        m_per_rad: Wheels {
            left: mean(plain.m_per_rad.left, extended.m_per_rad.left),
            right: mean(plain.m_per_rad.right, extended.m_per_rad.right),
        },
        separation_m: mean(plain.separation_m, extended.separation_m),
        body_from_sensor: Pose {
            x_m: mean(a.x_m, b.x_m),
            y_m: mean(a.y_m, b.y_m),
            theta_rad: mean(a.theta_rad, b.theta_rad),
        },
        latency_s: mean(plain.latency_s, extended.latency_s),
        gyro_scale: mean(plain.gyro_scale, extended.gyro_scale),
        own: extended.own.clone(),
        term_values: extended.term_values.iter().map(|value| 0.5 * value).collect(),
    }
}

/// [`misfit`] with the geometry parameters and the terms' sizes at their best for these runs, from those of
/// the model on: what a form cannot say.
pub(crate) fn misfit_of_form(
    datasets: &[Dataset],
    model: &Model,
    noise: TrueNoise,
    terms: &mut [Box<dyn ModelTerm>],
) -> f64 {
    misfit_from(NoiseFree::of(datasets), model, noise, terms)
}

/// [`misfit_of_form`] without terms of a robot that drives forward or backward, whichever costs less: where
/// no heading is measured, one may be the other.
pub(crate) fn misfit_either_way(datasets: &[Dataset], model: &Model, noise: TrueNoise) -> f64 {
    let of = |heading_rad: f64| misfit_from(NoiseFree::of(datasets).starting_at(heading_rad), model, noise, &mut []);
    of(0.0).min(of(std::f64::consts::PI))
}

/// [`misfit_of_form`] of runs with the start headings that they have.
fn misfit_from(mut runs: NoiseFree<'_>, model: &Model, noise: TrueNoise, terms: &mut [Box<dyn ModelTerm>]) -> f64 {
    let columns: Vec<Column> =
        Column::GEOMETRY.into_iter().chain((0..model.term_values.len()).map(Column::Term)).collect();
    let (mut model, mut least) = (model.clone(), f64::INFINITY);
    for _ in 0..=GAUSS_NEWTON_STEPS {
        runs = runs.with_best_headings(&model, noise, terms);
        let Some(measured) = runs.measurement(&model, noise, terms) else { return least };
        least = least.min(0.5 * measured.total.chi_square);
        let Some((step, _)) = measured.total.of(&columns).solve() else { return least };
        columns.iter().zip(step.iter()).for_each(|(column, by)| model.advance(*column, *by));
    }
    least
}

/// Steps of Gauss and Newton to the best geometry.
const GAUSS_NEWTON_STEPS: usize = 3;

/// The step of the geometry parameters to their best, without any effect.
fn to_best_geometry(total: &NormalEquations, at: &[usize]) -> Option<DVector<f64>> {
    let geometry_parameters = Information { matrix: total.block(at, at), gradient: total.gradient_of(at) };
    let (step, _) = geometry_parameters.with_precision(at.iter().map(|_| GEOMETRY_PRIOR_SD.powi(-2))).solve()?;
    Some(step)
}

/// Sum of the squares of innovations.
fn squares(z: &[((usize, usize), f64)]) -> f64 {
    z.iter().map(|(_, z)| z * z).sum()
}

/// ½ Σ e² over innovations, e being the mean square of a run's.
fn scatter(z: &[((usize, usize), f64)]) -> f64 {
    z.chunk_by(|a, b| a.0 == b.0)
        .map(|run| {
            let sum: f64 = run.iter().map(|(_, z)| z * z).sum();
            let count = run.len() as f64;
            0.5 * sum * sum / count
        })
        .sum()
}

impl Detectability {
    /// Noise-free runs under the estimation models of the effects that are asked for. `without` are the same
    /// runs without the effect: what they show, rounded counts and measurements between two rows, is not the
    /// effect's.
    pub(crate) fn of(
        datasets: &[Dataset],
        without: &[Dataset],
        truth: &DriveGeometry,
        noise: TrueNoise,
        hypotheses: Hypotheses<'_>,
    ) -> Option<Self> {
        let mut terms: Vec<Box<dyn ModelTerm>> = Vec::new();
        let mut candidates = Vec::new();
        let mut at = Column::BASE.len();
        let is_among = |id: &str| match hypotheses {
            Hypotheses::All => true,
            Hypotheses::One(one) => one == id,
        };
        for id in CATALOGUE.iter().filter(|id| is_among(id)) {
            let Some(variants) = hypothesis(id).and_then(Hypothesis::into_variants) else { continue };
            for variant in variants {
                let parameters = variant.term.parameters().to_vec();
                let columns = at..at + parameters.len();
                at = columns.end;
                candidates.push(Candidate { id, fixed: variant.fixed, parameters, columns });
                terms.push(variant.term);
            }
        }
        // A gyro's scale is unknown as the geometry is.
        let has_gyro = datasets.iter().any(|dataset| dataset.truth_noise.gyro.noise_rad_per_sqrt_s.is_some());
        let columns: Vec<Column> = Column::GEOMETRY.into_iter().chain(has_gyro.then_some(Column::GyroScale)).collect();
        let free: Vec<usize> = columns.iter().map(|column| column.index()).collect();
        let mut best = Model::of(truth, 0);
        let without = NoiseFree::of(without).with_best_headings(&best, noise, &mut []);
        let with = without.beside(datasets)?;
        if has_gyro {
            // Its scale and how wrong it is are no signature of the effect's.
            for _ in 0..GAUSS_NEWTON_STEPS {
                let plain = without.measurement(&best, noise, &mut [])?;
                let step = to_best_geometry(&plain.total, &[Column::GyroScale.index()])?;
                best.advance(Column::GyroScale, step[0]);
            }
        }
        let with_terms = |model: &Model| Model { term_values: vec![0.0; at - Column::BASE.len()], ..model.clone() };
        let plain = without.measurement(&with_terms(&best), noise, &mut terms)?;
        let mut at_truth = None;
        for _ in 0..GAUSS_NEWTON_STEPS {
            let measured = with.measurement(&best, noise, &mut [])?;
            at_truth.get_or_insert(measured.total.chi_square);
            let step = to_best_geometry(&measured.total, &free)?;
            columns.iter().zip(step.iter()).for_each(|(column, by)| best.advance(*column, *by));
        }
        let mut measured = with.measurement(&with_terms(&best), noise, &mut terms)?;
        if measured.z.len() == plain.z.len() {
            measured.total.gradient -= &plain.total.gradient;
            measured.z.iter_mut().zip(&plain.z).for_each(|(measured, plain)| measured.1 -= plain.1);
            // Partial measurements have no innovations of their own here: χ² is that of their filter. What
            // start headings that were not measured take up is no signature.
            if !measured.z.is_empty() {
                measured.total.chi_square = squares(&measured.z) - measured.by_headings;
            }
        }
        let at_truth = at_truth.unwrap_or(0.0);
        Some(Self { scatter: scatter(&measured.z), total: measured.total, at_truth, best, candidates, free })
    }

    /// How much of χ² the geometry parameters and some candidates take up at their best, and the candidates'
    /// sizes there with standard deviations.
    fn explained(&self, candidates: &[&Candidate]) -> (f64, Vec<(f64, f64)>) {
        let mut at = self.free.clone();
        let mut prior: Vec<f64> = at.iter().map(|_| GEOMETRY_PRIOR_SD.powi(-2)).collect();
        for candidate in candidates {
            at.extend(candidate.columns.clone());
            prior.extend(candidate.parameters.iter().map(|parameter| (RIVAL_SD * parameter.prior_sigma).powi(-2)));
        }
        let free = Information { matrix: self.total.block(&at, &at), gradient: self.total.gradient_of(&at) };
        let Some((step, covariance)) = free.clone().with_precision(prior).solve() else { return (0.0, Vec::new()) };
        let values = (self.free.len()..at.len()).map(|k| (step[k], covariance[(k, k)].sqrt())).collect();
        (-free.gradient.dot(&step), values)
    }

    /// The signature's χ² with the geometry parameters at their best: noncentrality of the test by the true
    /// form.
    pub(crate) fn noncentrality(&self) -> f64 {
        (self.total.chi_square - self.explained(&[]).0).max(0.0)
    }

    /// Whether the drive's geometry parameters take up all but a hundredth of the signature: what is left
    /// then is of second order, and no test of the effect's.
    pub(crate) fn is_explained_by_geometry(&self) -> bool {
        self.noncentrality() < 0.01 * self.at_truth
    }

    /// The shape of a name that takes up most, beside the geometry parameters, and how much: noncentrality of
    /// the test by the hypothesis's own form.
    fn best_shape(&self, id: &str) -> Option<(&Candidate, f64)> {
        let alone = self.explained(&[]).0;
        self.candidates
            .iter()
            .filter(|candidate| candidate.id == id)
            .map(|candidate| (candidate, (self.explained(&[candidate]).0 - alone).max(0.0)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Noncentrality of the test of a name by its hypothesis's own form.
    pub(crate) fn noncentrality_in_form(&self, id: &str) -> f64 {
        self.best_shape(id).map_or(0.0, |(_, noncentrality)| noncentrality)
    }

    /// The same with another name's hypothesis in the model already.
    pub(crate) fn noncentrality_beside(&self, id: &str, other: &str) -> f64 {
        let (Some((own, _)), Some((other, _))) = (self.best_shape(id), self.best_shape(other)) else { return 0.0 };
        (self.explained(&[own, other]).0 - self.explained(&[other]).0).max(0.0)
    }

    /// The oracle's test of an effect with one shape on what was measured with noise: χ² without the effect.
    #[cfg(test)]
    pub(crate) fn statistic(&self, id: &str) -> f64 {
        self.noncentrality_in_form(id)
    }

    /// How many directions of an effect's own hypothesis a plausible size would show by a standard deviation;
    /// at least one.
    pub(crate) fn freedom(&self, id: &str) -> usize {
        self.candidates
            .iter()
            .filter(|candidate| candidate.id == id)
            .map(|candidate| {
                let own: Vec<usize> = candidate.columns.clone().collect();
                let free = Information {
                    matrix: self.total.block(&self.free, &self.free),
                    gradient: self.total.gradient_of(&self.free),
                };
                let free = free.with_precision(self.free.iter().map(|_| GEOMETRY_PRIOR_SD.powi(-2)));
                let between = self.total.block(&own, &self.free);
                let Some(inverse) = inverse(&free.matrix, 0.0) else { return 0 };
                let left = self.total.block(&own, &own) - &between * inverse * between.transpose();
                let prior_sigma = |k: usize| candidate.parameters[k].prior_sigma;
                let scaled =
                    DMatrix::from_fn(own.len(), own.len(), |i, j| left[(i, j)] * prior_sigma(i) * prior_sigma(j));
                scaled.symmetric_eigenvalues().iter().filter(|value| **value >= 1.0).count()
            })
            .max()
            .unwrap_or(1)
            .max(1)
    }

    /// Every other name with the noncentrality of the test between it and the true one, the least first: how
    /// much less than `own` of the true signature its hypothesis takes up. Names whose best sizes no effect
    /// can have are none.
    pub(crate) fn rivals(&self, id: &str, own: f64) -> Vec<(&'static str, f64)> {
        let alone = self.explained(&[]).0;
        let mut rivals: Vec<(&'static str, f64)> = Vec::new();
        for candidate in self.candidates.iter().filter(|candidate| candidate.id != id) {
            let (taken, values) = self.explained(&[candidate]);
            let term_values: Vec<(&str, f64)> = candidate
                .parameters
                .iter()
                .zip(&values)
                .map(|(parameter, (size, sigma))| {
                    (parameter.name, if size.abs() < ZERO_WITHIN_SIGMAS * sigma { 0.0 } else { *size })
                })
                .chain(candidate.fixed.iter().copied())
                .collect();
            if effects::effect_from_estimates(candidate.id, &term_values).is_none()
                && term_values.iter().any(|(_, size)| *size != 0.0)
            {
                continue;
            }
            let left = own - (taken - alone);
            match rivals.iter_mut().find(|(of, _)| *of == candidate.id) {
                Some(known) => known.1 = known.1.min(left),
                None => rivals.push((candidate.id, left)),
            }
        }
        rivals.sort_by(|a, b| a.1.total_cmp(&b.1));
        rivals
    }

    /// The geometry at its best, as the drive that a calibration without the effect would find.
    pub(crate) fn best_drive(&self) -> Model {
        self.best.clone()
    }
}
