//! The fit: Gauss–Newton for the mean parameters and Fisher scoring for the noise, side by side.

use dataset::median;
use model_term::ModelTerm;
use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use crate::acceleration::{Acceleration, StepSize};
use crate::error::EstimationError;
use crate::model::{Column, Model};
use crate::noise::{Noise, NoisePrior};
use crate::normal_equations::{Information, free_basis, total};
use crate::pass::{FreeHeading, Pass, pass};
use crate::pass_options::{OutlierGate, PassOptions};
use crate::products::HeadingResponse;
use crate::propagation::CachedPropagation;
use crate::records::Records;
use crate::segment::Segment;
use crate::settings::{COMMON, START_HEADINGS};
use crate::step_control::{Progress, StepDamping};
use crate::thinning::Selection;

/// When the steps of a fit have converged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ConvergenceCriterion {
    /// Steps are below 1e-4 of a standard deviation of the mean, and below this share of each variance.
    NoiseShare(f64),
    /// Steps change the log-likelihood by less than 0.005: variances that hardly matter need not converge.
    Likelihood,
}

/// What to fit.
#[derive(Debug, Clone)]
pub struct FitOptions {
    /// The free columns.
    pub columns: Vec<Column>,
    /// Directions of the free columns along which nothing moves: rows over the columns.
    pub fixed: Vec<DVector<f64>>,
    /// The noise stays as it is.
    pub noise_fixed: bool,
    /// When the steps have converged.
    pub ends: ConvergenceCriterion,
    /// Most steps.
    pub max_steps: usize,
    /// Take every measurement, outliers too.
    pub ungated: bool,
    /// Keep the innovations, most of the memory of a fit.
    pub innovations: bool,
}

impl FitOptions {
    /// Fits some columns.
    #[must_use]
    pub fn of(columns: &[Column]) -> Self {
        Self {
            columns: columns.to_vec(),
            fixed: Vec::new(),
            noise_fixed: false,
            ends: ConvergenceCriterion::NoiseShare(COMMON.noise_step_tolerance),
            max_steps: COMMON.max_fit_steps,
            ungated: false,
            innovations: true,
        }
    }
}

/// What the optimizer found: the values of mean and noise, and the pass at them.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The mean parameters.
    pub model: Model,
    /// The noise.
    pub noise: Noise,
    /// Start headings of segments without measured headings, radians; 0 for others.
    pub(crate) free_headings: Vec<f64>,
    /// The last pass, at the values above.
    pub pass: Pass,
    /// Did the steps converge, or did the last of them hardly change the likelihood?
    pub converged: bool,
    /// Was a step long, and longer than the first? The minimum may then be one of several.
    pub left_basin: bool,
}

impl Solution {
    /// Before anything is fitted.
    pub(crate) fn nothing(nominal: &Model, prior: &NoisePrior) -> Self {
        let pass = Pass::nothing();
        Self {
            model: nominal.clone(),
            noise: prior.noise(),
            free_headings: Vec::new(),
            pass,
            converged: false,
            left_basin: false,
        }
    }

    /// The normal equation of some columns at the values found, over all runs.
    #[must_use]
    pub fn information(&self, columns: &[Column]) -> Option<Information> {
        total(&self.pass.runs).map(|sum| sum.of(columns))
    }
}

/// Where a fit starts.
#[derive(Debug, Clone)]
pub(crate) struct InitialValues {
    pub(crate) model: Model,
    pub(crate) noise: Option<Noise>,
    pub(crate) free_headings: Option<Vec<f64>>,
}

/// Fits the model to the records, from the nominal drive on.
///
/// # Errors
/// [`EstimationError`] when there is nothing to fit, or it diverges.
pub fn fit(
    records: &Records<'_>,
    selections: &[Selection],
    nominal: &Model,
    stated: dataset::TruthNoise,
    terms: &mut [Box<dyn ModelTerm>],
    options: &FitOptions,
) -> Result<Solution, EstimationError> {
    let from = InitialValues { model: nominal.clone(), noise: None, free_headings: None };
    fit_from(records, selections, from, &NoisePrior::of(stated), terms, options)
}

/// A fit as its steps go on.
struct Fit<'f, 'r> {
    records: &'f Records<'r>,
    selections: &'f [Selection],
    prior: &'f NoisePrior,
    options: &'f FitOptions,
    /// Directions along which the mean moves.
    basis: DMatrix<f64>,
    model: Model,
    noise: Noise,
    headings: Vec<f64>,
}

impl Fit<'_, '_> {
    fn noise_step(&self, found: &Pass) -> NoiseStep {
        if self.options.noise_fixed {
            return NoiseStep::none();
        }
        NoiseStep::of(&self.noise, found, self.prior, self.basis.ncols())
    }

    /// Steps among all measurements. The noise is scaled to the median, which is robust to outliers, before
    /// these are rejected.
    fn take_ungated_steps(&mut self, terms: &mut [Box<dyn ModelTerm>]) -> Result<(), EstimationError> {
        let options = self.options;
        for round in 1..=COMMON.max_ungated_steps {
            // Partial measurements give no innovations; their noise follows its likelihood.
            let noise_score = self.records.is_partial() && !options.noise_fixed;
            let (gate, free) = (OutlierGate::Off, Some(&options.columns[..]));
            let pass_options = PassOptions { innovations: true, noise_score, gate, free, ..PassOptions::default() };
            let Self { records, selections, model, noise, headings, .. } = &*self;
            let found = pass(records, selections, model, noise, headings, terms, pass_options);
            let mean = MeanStep::of(&found, options, &self.basis)?;
            let (_, own) = take_step(&mut self.model, &mut self.headings, &found, options, mean.by)?;
            let moved = mean.squared + own;
            if noise_score {
                let step = self.noise_step(&found);
                take_noise_step(&mut self.noise, step.by);
            } else {
                let squares = found.innovations.iter().flatten().map(|innovation| innovation.z.powi(2));
                let Some(median) = median(squares) else { break };
                self.noise = self.noise.scaled(
                    (median / COMMON.chi_square_1_median)
                        .clamp(COMMON.max_noise_scaling.recip(), COMMON.max_noise_scaling),
                    COMMON.min_noise_sigma * COMMON.min_noise_sigma,
                );
            }
            // Where steps are large, a long path with few measurements makes all of them look like outliers.
            if round >= COMMON.min_ungated_steps && moved < COMMON.gating_step {
                break;
            }
        }
        Ok(())
    }
}

pub(crate) fn fit_from(
    records: &Records<'_>,
    selections: &[Selection],
    from: InitialValues,
    prior: &NoisePrior,
    terms: &mut [Box<dyn ModelTerm>],
    options: &FitOptions,
) -> Result<Solution, EstimationError> {
    if selections.iter().all(Selection::is_empty) {
        return Err(EstimationError::NoMeasurements);
    }
    let model = from.model;
    let headings = from.free_headings.unwrap_or_else(|| records.start_headings_rad(&model));
    let basis = free_basis(options.columns.len(), &options.fixed);
    let noise = from.noise.unwrap_or_else(|| prior.noise());
    let mut fit = Fit { records, selections, prior, options, basis, model, noise, headings };
    if from.noise.is_none() {
        fit.take_ungated_steps(terms)?;
    }
    let pass_options = PassOptions {
        noise_score: !options.noise_fixed,
        gate: OutlierGate::of(options.ungated),
        free: Some(&options.columns),
        ..PassOptions::default()
    };
    let (mut converged, mut left_basin, mut first) = (false, false, None);
    let (mut damping, mut acceleration) = (StepDamping::default(), Acceleration::default());
    let keep = Selection::has_long_propagations(selections, !terms.is_empty());
    let (mut cached, mut confirms): (Option<CachedPropagation>, bool) = (None, false);
    // Squared distance of the model from that of the cached propagations.
    let mut moved_since_cached = 0.0;
    // Whether the last step hardly changed the likelihood: a variance near 0 may wander on for ever.
    let mut is_near = false;
    let mut progress = Progress::default();
    for step in 0..options.max_steps {
        damping.only_shorter = 2 * step >= options.max_steps;
        let by_cached = PassOptions { keep: keep && cached.is_none(), by: cached.as_ref(), ..pass_options };
        let Fit { model, noise, headings, .. } = &fit;
        let mut found = pass(records, selections, model, noise, headings, terms, by_cached);
        let mean = MeanStep::of(&found, options, &fit.basis)?;
        let of_noise = fit.noise_step(&found);
        let columns = options.columns.len();
        let damped = damping.damped(of_noise.by);
        let noise_step = if damping.only_shorter { damped.amax() } else { of_noise.by.amax() };
        let own = if !damping.only_shorter
            && acceleration.engages(StepSize { mean: mean.squared, noise: of_noise.by.amax() })
        {
            let proposed = stacked(&mean.by, &of_noise.by);
            let by = acceleration.mixed(&proposed, &block_diagonal(&mean.information, &of_noise.information));
            let by_noise = Vector4::from_fn(|k, _| by[columns + k]);
            let (moved, own) =
                take_step(&mut fit.model, &mut fit.headings, &found, options, by.rows(0, columns).into_owned())?;
            acceleration.moved(proposed, stacked(&moved, &take_noise_step(&mut fit.noise, by_noise)));
            own
        } else {
            take_noise_step(&mut fit.noise, damped);
            take_step(&mut fit.model, &mut fit.headings, &found, options, mean.by)?.1
        };
        let moved = mean.squared + own;
        left_basin |= moved > COMMON.left_basin_step.max(*first.get_or_insert(moved));
        // Convergence with cached propagations is confirmed by integrated ones, unless the model has hardly
        // moved since.
        moved_since_cached = if cached.is_none() { moved } else { moved_since_cached + moved };
        let mean_settled = if confirms { COMMON.confirming_step_tolerance } else { COMMON.mean_step_tolerance };
        is_near = moved < COMMON.mean_cost_tolerance && of_noise.squared() < COMMON.noise_cost_tolerance;
        let settles = match options.ends {
            ConvergenceCriterion::NoiseShare(share) => moved < mean_settled && noise_step < share,
            ConvergenceCriterion::Likelihood => is_near,
        };
        if settles && (cached.is_none() || moved_since_cached < COMMON.reuse_tolerance) {
            (converged, cached) = (true, cached.or(found.cached.take()));
            break;
        }
        if options.ends == ConvergenceCriterion::Likelihood && progress.has_stalled(moved + of_noise.squared()) {
            break;
        }
        cached = if settles { None } else { cached.or(found.cached.take()).filter(|_| moved < COMMON.cached_step) };
        confirms = settles;
    }
    // After so small a step cached propagations are as good as integrated ones.
    let by = cached.as_ref().filter(|_| converged);
    let pass_options = PassOptions {
        innovations: options.innovations,
        gate: OutlierGate::of(options.ungated),
        by,
        ..PassOptions::default()
    };
    let Fit { model, noise, headings, .. } = &fit;
    let pass = pass(records, selections, model, noise, headings, terms, pass_options);
    let Fit { model, noise, headings, .. } = fit;
    Ok(Solution { model, noise, free_headings: headings, pass, converged: converged || is_near, left_basin })
}

/// A pass at given common values, and its model: start headings that are not measured, and the instruments of
/// single runs, are iterated until they converge; nothing else moves.
pub(crate) fn pass_settled(
    records: &Records<'_>,
    selections: &[Selection],
    model: Model,
    noise: &Noise,
) -> Result<(Model, Pass), EstimationError> {
    let options = FitOptions::of(&[]);
    let headings = records.start_headings_rad(&model);
    let settled = |(mut model, mut headings): (Model, Vec<f64>), gate| {
        let pass_options = PassOptions { gate, ..PassOptions::default() };
        for round in 1.. {
            let found = pass(records, selections, &model, noise, &headings, &mut [], pass_options);
            let turned = found.headings.iter().map(|heading| heading.response.rest.abs()).fold(0.0, f64::max);
            let mut next = model.clone();
            let (_, own) = take_step(&mut next, &mut headings, &found, &options, DVector::zeros(0))?;
            if (turned < START_HEADINGS.heading_step_tolerance_rad && own < COMMON.mean_step_tolerance)
                || round == COMMON.max_ungated_steps
            {
                return Ok(((model, headings), found));
            }
            model = next;
        }
        Err(EstimationError::Diverges)
    };
    let start = (model, headings);
    // Where all headings are measured, no start is rough.
    let has_free = records.segments.iter().any(Segment::has_free_heading);
    let found = if has_free { settled_from(start, OutlierGate::On, settled) } else { settled(start, OutlierGate::On) };
    found.map(|((model, _), found)| (model, found))
}

/// The pass at which start headings settle, and where they do. `settled` gives both from a start.
///
/// To precise positions a start heading by a short path makes most of what comes later an outlier, and then
/// nothing moves it. Where any is rejected, headings settle among all measurements first, and the gate is
/// closed there; of the two the one that rejects fewer.
pub(crate) fn settled_from<T: Clone, E>(
    start: T,
    gate: OutlierGate,
    mut settled: impl FnMut(T, OutlierGate) -> Result<(T, Pass), E>,
) -> Result<(T, Pass), E> {
    let direct = settled(start.clone(), gate)?;
    if gate == OutlierGate::Off || direct.1.outliers.is_empty() {
        return Ok(direct);
    }
    let gated = settled(start, OutlierGate::Off).and_then(|(open, _)| settled(open, gate));
    Ok(gated.ok().filter(|gated| gated.1.outliers.len() < direct.1.outliers.len()).unwrap_or(direct))
}

/// A pass at given values, with its innovations. `free_headings` has one start heading for each segment,
/// radians; it is used where headings are not measured.
#[must_use]
pub fn pass_with_innovations(
    records: &Records<'_>,
    selections: &[Selection],
    model: &Model,
    noise: &Noise,
    free_headings: &[f64],
    terms: &mut [Box<dyn ModelTerm>],
    gate: OutlierGate,
) -> Pass {
    pass(
        records,
        selections,
        model,
        noise,
        free_headings,
        terms,
        PassOptions { innovations: true, gate, ..PassOptions::default() },
    )
}

/// A damped Gauss–Newton step of the mean.
struct MeanStep {
    /// By column of the options.
    by: DVector<f64>,
    /// Information on those columns.
    information: DMatrix<f64>,
    /// Squared length over its variance.
    squared: f64,
}

impl MeanStep {
    fn of(found: &Pass, options: &FitOptions, basis: &DMatrix<f64>) -> Result<Self, EstimationError> {
        let Some(sum) = total(&found.runs) else { return Err(EstimationError::NoMeasurements) };
        let system = sum.of(&options.columns);
        if options.columns.is_empty() || basis.ncols() == 0 {
            return Ok(Self { by: DVector::zeros(options.columns.len()), information: system.matrix, squared: 0.0 });
        }
        let reduced = system.along(basis);
        let damping = reduced
            .matrix
            .diagonal()
            .map(|information| COMMON.relative_damping * information + COMMON.absolute_damping);
        let damped = reduced.clone().with_precision(damping.iter().copied());
        let (step, _) = damped.solve().ok_or(EstimationError::Diverges)?;
        let squared = (step.transpose() * &reduced.matrix * &step)[0];
        Ok(Self { by: basis * step, information: system.matrix, squared })
    }
}

/// Moves the mean by a step, with the start headings and the groups' instruments. Returns the step as it was
/// taken, and the squared step of the groups' instruments over its variance.
fn take_step(
    model: &mut Model,
    headings: &mut [f64],
    found: &Pass,
    options: &FitOptions,
    mut step: DVector<f64>,
) -> Result<(DVector<f64>, f64), EstimationError> {
    let mut moved = vec![0.0; found.runs.first().ok_or(EstimationError::NoMeasurements)?.gradient.len()];
    for (column, by) in options.columns.iter().zip(step.iter_mut()) {
        // The next step goes on where this one is cut.
        *by = if Column::GEOMETRY.contains(column) {
            by.clamp(-COMMON.max_geometry_step, COMMON.max_geometry_step)
        } else {
            *by
        };
        if !by.is_finite() {
            return Err(EstimationError::Diverges);
        }
        model.advance(*column, *by);
        moved[column.index()] = *by;
    }
    let own_steps: Vec<DVector<f64>> =
        found.own.iter().map(|response| response.step(&options.columns, &step)).collect();
    for FreeHeading { segment, run, response: HeadingResponse { rest, by, .. } } in &found.headings {
        let mut shift: f64 = by.iter().zip(&moved).map(|(by, moved)| by * moved).sum();
        if let Some(own) = &model.own
            && let Some(at) = found.own.iter().position(|response| response.group == own.grouping.group(*run))
        {
            shift += own
                .columns
                .iter()
                .zip(own_steps[at].iter())
                .map(|(column, step)| by[column.index()] * step)
                .sum::<f64>();
        }
        headings[*segment] += rest + shift;
    }
    let mut size = 0.0;
    for (response, by) in found.own.iter().zip(&own_steps) {
        size += response.squared(by);
        model.advance_own(response.group, by);
    }
    Ok((step, size))
}

/// A scoring step of the logarithms of the variances.
struct NoiseStep {
    by: Vector4<f64>,
    information: Matrix4<f64>,
}

impl NoiseStep {
    fn none() -> Self {
        Self { by: Vector4::zeros(), information: Matrix4::identity() }
    }

    fn of(noise: &Noise, found: &Pass, prior: &NoisePrior, parameters: usize) -> Self {
        let pull = prior.pull(noise);
        let gradient = found.restricted_noise_score(parameters) + Vector4::from(pull.map(|(gradient, _)| gradient));
        let information =
            found.noise.information + Matrix4::from_diagonal(&Vector4::from(pull.map(|(_, curvature)| curvature)));
        let directions = prior.directions();
        let along = directions.tr_mul(&(information * &directions));
        let Some(along) = along.cholesky().map(|cholesky| -cholesky.solve(&directions.tr_mul(&gradient))) else {
            return Self::none();
        };
        let mut by: Vector4<f64> = &directions * along;
        // A variance at its lower bound does not fall.
        for (by, variance) in by.iter_mut().zip(noise.variance) {
            if variance <= COMMON.min_noise_sigma * COMMON.min_noise_sigma {
                *by = by.max(0.0);
            }
        }
        Self { by, information }
    }

    /// Squared length over its variance.
    fn squared(&self) -> f64 {
        self.by.dot(&(self.information * self.by))
    }
}

/// Moves the noise, by so much at the most; returns by how much.
fn take_noise_step(noise: &mut Noise, by: Vector4<f64>) -> Vector4<f64> {
    let by = by * (COMMON.max_noise_step / by.amax()).min(1.0);
    let before = *noise;
    for (variance, by) in noise.variance.iter_mut().zip(by.iter()) {
        *variance = (*variance * by.exp()).max(COMMON.min_noise_sigma * COMMON.min_noise_sigma);
    }
    Vector4::from_fn(|k, _| (noise.variance[k] / before.variance[k]).ln())
}

/// The steps of mean and noise as one.
fn stacked(mean: &DVector<f64>, noise: &Vector4<f64>) -> DVector<f64> {
    DVector::from_iterator(mean.len() + noise.len(), mean.iter().chain(noise.iter()).copied())
}

fn block_diagonal(mean: &DMatrix<f64>, noise: &Matrix4<f64>) -> DMatrix<f64> {
    let n = mean.nrows();
    let mut all = DMatrix::zeros(n + noise.nrows(), n + noise.nrows());
    all.view_mut((0, 0), (n, n)).copy_from(mean);
    all.view_mut((n, n), noise.shape()).copy_from(noise);
    all
}

#[cfg(test)]
mod tests;
