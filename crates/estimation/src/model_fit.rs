//! The maximum-likelihood fit of whole runs: records, the measurements taken of them, free columns, and the operations on a fit that is there.

use std::sync::Arc;

use dataset::Session;
use model_term::ModelTerm;
use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen};

use crate::error::EstimationError;
use crate::filter::{OutlierGate, PassOptions};
use crate::model::{Column, Model};
use crate::noise::NoisePrior;
use crate::normal_equations::{ClusterRobust, NormalEquations, SchurComplement, free_basis};
use crate::optimizer::{ConvergenceCriterion, Fit, FitOptions, From, fit_from};
use crate::pass::{Pass, pass};
use crate::records::{Records, Segment};
use crate::thinning::{Selection, Thinning};

/// Innovations are taken for white while no component's correlation with the measurement before reaches this many standard errors: three components at 1 % together.
pub const WHITE_BELOW: f64 = 2.935;
/// How many before an innovation it may resemble.
const LAGS: i32 = 5;
/// In how many phases thinned measurements are taken.
const PHASES: usize = 4;
/// Thinned further, a run would be little more than its ends.
const MIN_MEASUREMENTS_PER_RUN: f64 = 1.0;
/// A direction of the geometry parameters is seen when its relative standard deviation is below this: nominal values are better known than worse.
const LARGEST_SIGMA: f64 = 0.03;
/// An instrument whose heading on the robot seems to be more than this is mounted so on purpose; less may be the lie of a short log.
const ROTATED_SENSOR_RAD: f64 = 0.2;
/// With fewer runs, they are cut into blocks to be held out.
pub(crate) const MIN_RUNS: usize = 6;
pub(crate) const FOLDS: usize = 6;
/// The scatter of so many runs says more of a covariance than the model does, though innovations be white.
const MIN_RUNS_FOR_ROBUST: usize = 20;

/// A maximum-likelihood fit with the records and measurements that it rests on.
#[derive(Debug, Clone)]
pub struct ModelFit<'a> {
    /// The runs.
    pub records: Arc<Records<'a>>,
    /// How their measurements are thinned.
    pub thinning: Thinning,
    /// The measurements taken.
    pub selections: Arc<Vec<Selection>>,
    /// The nominal drive.
    pub nominal: Model,
    /// Where fits start: the nominal drive with its instrument turned as it seems to be.
    pub(crate) start: Model,
    /// The fit.
    pub fit: Fit,
    /// The free columns.
    pub columns: Vec<Column>,
    /// Directions of the three geometry parameters that the data do not determine, and that stay nominal: rows left, right, separation.
    pub unobservable: Vec<DVector<f64>>,
    pub(crate) prior: NoisePrior,
    /// Where steps of its fits end.
    pub(crate) ends: ConvergenceCriterion,
    /// The normal equation of parts, where there are no records to make it of.
    pub(crate) parts: Vec<NormalEquations>,
    /// Displacements count as neighbours when it is asked whether measurements are white.
    pub(crate) displacements_follow: bool,
    /// Measurements that lie far off are taken like the others.
    pub(crate) ungated: bool,
}

impl<'a> ModelFit<'a> {
    /// Records of sessions and a nominal model; nothing is fitted.
    pub(crate) fn before_any_step(
        sessions: &[Session<'a>],
        nominal: Model,
        ends: ConvergenceCriterion,
        displacements_follow: bool,
    ) -> Self {
        let records = Records::of(sessions);
        let prior = NoisePrior::of(sessions.first().map(|session| session.truth_noise).unwrap_or_default());
        Self {
            selections: Arc::new(Selection::of(&records, Thinning::NONE, &nominal)),
            thinning: Thinning::NONE,
            fit: Fit::nothing(&nominal, &prior),
            columns: Column::GEOMETRY.to_vec(),
            unobservable: Vec::new(),
            records: Arc::new(records),
            start: nominal.clone(),
            nominal,
            prior,
            ends,
            parts: Vec::new(),
            displacements_follow,
            ungated: false,
        }
    }
}

impl ModelFit<'_> {
    /// The values found, with records that hold no measurements.
    pub(crate) fn with_records<'b>(self, records: Records<'b>) -> ModelFit<'b> {
        let Self { thinning, nominal, start, fit, columns, unobservable, prior, ends, parts, .. } = self;
        let fit = Fit { pass: Pass { innovations: Vec::new(), outliers: Vec::new(), ..fit.pass }, ..fit };
        let (displacements_follow, ungated) = (self.displacements_follow, self.ungated);
        ModelFit {
            records: Arc::new(records),
            selections: Arc::default(),
            thinning,
            nominal,
            start,
            fit,
            columns,
            unobservable,
            prior,
            ends,
            parts,
            displacements_follow,
            ungated,
        }
    }

    /// An instrument that looks to the side cannot be left out of the first fit.
    pub(crate) fn free_extrinsics_if_rotated(&mut self) {
        let heading_rad = self.records.sensor_heading_rad(&self.nominal);
        if heading_rad.abs() > ROTATED_SENSOR_RAD {
            self.start.body_from_sensor.theta_rad = heading_rad;
            self.columns.extend(Column::EXTRINSICS);
        }
    }

    pub(crate) fn refit(&mut self, from: Option<From>) -> Result<(), EstimationError> {
        self.refit_with(from, &mut [])
    }

    pub(crate) fn refit_with(
        &mut self,
        from: Option<From>,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Result<(), EstimationError> {
        let from = from.unwrap_or_else(|| From { model: self.start.clone(), noise: None, free_headings: None });
        let Self { ends, ungated, .. } = *self;
        let options = FitOptions { fixed: self.fixed(), ends, ungated, ..FitOptions::of(&self.columns) };
        self.fit = fit_from(&self.records, &self.selections, from, &self.prior, terms, &options)?;
        Ok(())
    }

    /// The directions of the free columns that stay nominal.
    pub(crate) fn fixed(&self) -> Vec<DVector<f64>> {
        self.fixed_along(&self.columns)
    }

    /// The same over some of the columns.
    fn fixed_along(&self, columns: &[Column]) -> Vec<DVector<f64>> {
        let along = |direction: &DVector<f64>, column: &Column| direction.get(column.index()).copied().unwrap_or(0.0);
        let of =
            |direction| DVector::from_iterator(columns.len(), columns.iter().map(|column| along(direction, column)));
        self.unobservable.iter().map(of).collect()
    }

    pub(crate) fn here(&self) -> From {
        let Fit { model, noise, free_headings, .. } = &self.fit;
        From { model: model.clone(), noise: Some(*noise), free_headings: Some(free_headings.clone()) }
    }

    /// Takes measurements farther apart until their innovations are white, or a run has too few left.
    pub(crate) fn thin(&mut self) -> Result<(), EstimationError> {
        let Some(between_s) = median_between(&self.records) else { return Ok(()) };
        let mut every_s = between_s;
        while !self.is_white() {
            every_s *= 2.0;
            let Some((thinning, selections)) = self.thinned(every_s, between_s) else { break };
            (self.selections, self.thinning) = (Arc::new(selections), thinning);
            self.refit(Some(self.here()))?;
        }
        Ok(())
    }

    /// Measurements so far apart; `None` when a run has too few left.
    fn thinned(&self, every_s: f64, between_s: f64) -> Option<(Thinning, Vec<Selection>)> {
        let thinning = Thinning { every_s: every_s - 0.5 * between_s, phases: PHASES };
        let selections = Selection::of(&self.records, thinning, &self.nominal);
        (selections[0].mean_measurements(&self.records) >= MIN_MEASUREMENTS_PER_RUN).then_some((thinning, selections))
    }

    /// Does [`Self::thin`] take measurements farther apart than all of them?
    pub(crate) fn is_to_be_thinned(&self) -> bool {
        let between_s = median_between(&self.records).filter(|_| !self.is_white());
        between_s.is_some_and(|between_s| self.thinned(2.0 * between_s, between_s).is_some())
    }

    pub(crate) fn is_white(&self) -> bool {
        self.correlation() <= WHITE_BELOW
    }

    /// The largest correlation of an innovation with the one before, of displacements (where they are to be thinned) with several before, over the components, in standard errors.
    #[must_use]
    pub fn correlation(&self) -> f64 {
        let times_taken = self.times_taken();
        (0..3)
            .map(|component| {
                let (mut products, mut squares, mut pairs, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
                for phase in &self.fit.pass.innovations {
                    let series: Vec<_> = phase.iter().filter(|innovation| innovation.component == component).collect();
                    for (number, innovation) in series.iter().enumerate() {
                        squares += innovation.z * innovation.z;
                        count += 1.0;
                        for (lag, before) in (1..=LAGS).zip(series[..number].iter().rev()) {
                            let weight = self.records.weight_of_pair(before.segment, innovation.segment, lag);
                            let counts = self.displacements_follow || before.segment == innovation.segment;
                            if counts && weight > 0.0 {
                                products += weight * before.z * innovation.z;
                                pairs += weight * weight;
                            }
                        }
                    }
                }
                if pairs == 0.0 { 0.0 } else { products / (squares / count) / (pairs * times_taken).sqrt() }
            })
            .fold(0.0, |largest: f64, z| largest.max(z.abs()))
    }

    /// In how many phases the errors of a measurement are, on average: those of poses in all, as the propagation intervals between them overlap; those of a displacement where it is taken.
    fn times_taken(&self) -> f64 {
        let taken =
            |segment: usize| self.selections.iter().filter(|phase| !phase.propagations[segment].is_empty()).count();
        if self.records.segments.iter().all(Segment::is_displacement) {
            let times = (0..self.records.segments.len()).map(taken).filter(|times| *times > 0);
            let (sum, count) = times.fold((0, 0), |(sum, count), times| (sum + times, count + 1));
            sum as f64 / f64::max(f64::from(count), 1.0)
        } else {
            self.fit.pass.innovations.len() as f64
        }
    }

    /// The normal equation in units that can be held out: runs, or blocks where runs are few.
    pub(crate) fn units(&self, terms: &mut [Box<dyn ModelTerm>]) -> Vec<NormalEquations> {
        if self.fit.pass.runs.len() >= MIN_RUNS {
            return self.fit.pass.runs.clone();
        }
        if !self.parts.is_empty() {
            return self.parts.clone();
        }
        self.in_blocks(terms, MIN_RUNS.div_ceil(self.fit.pass.runs.len().max(1)))
    }

    /// Names the directions of the geometry parameters that the measurements do not determine, and keeps them nominal.
    pub(crate) fn fix_unobservable(&mut self) -> Result<(), EstimationError> {
        let Some(information) = self.fit.information(&self.columns) else { return Ok(()) };
        let held_before = !self.unobservable.is_empty();
        self.unobservable = unobservable(&information.matrix);
        if self.unobservable.is_empty() {
            // What has come to be seen since is free again.
            return if held_before { self.refit(Some(self.here())) } else { Ok(()) };
        }
        // Back along what is not seen; what is seen stays as it was found.
        let nominal = [self.nominal.m_per_rad.left, self.nominal.m_per_rad.right, self.nominal.separation_m];
        let mut model = self.fit.model.clone();
        let found = [model.m_per_rad.left, model.m_per_rad.right, model.separation_m];
        let moved = DVector::from_fn(3, |row, _| f64::ln(found[row] / nominal[row]));
        for direction in &self.unobservable {
            let along = direction.dot(&moved);
            for (column, share) in Column::GEOMETRY.into_iter().zip(direction.iter()) {
                model.advance(column, -along * share);
            }
        }
        let from = From { model, noise: None, free_headings: None };
        self.refit(Some(from))
    }

    /// One pass at the values found with the sensitivities of further terms carried along, at zero size: what score tests are made of. The terms of the fit come
    /// first.
    #[must_use]
    pub fn scan(&self, terms: &mut [Box<dyn ModelTerm>]) -> Pass {
        self.scan_with(terms, PassOptions { innovations: true, ..PassOptions::default() })
    }

    /// The same with samples of how the robot moved before each measurement.
    #[must_use]
    pub fn scan_with_samples(&self, terms: &mut [Box<dyn ModelTerm>]) -> Pass {
        self.scan_with(terms, PassOptions { innovations: true, samples: true, ..PassOptions::default() })
    }

    fn scan_with(&self, terms: &mut [Box<dyn ModelTerm>], options: PassOptions<'_>) -> Pass {
        let parameters = terms.iter().map(|term| term.parameters().len()).sum();
        // Terms that are in the fit come first and keep their sizes.
        let mut model = self.fit.model.clone();
        model.term_values.resize(parameters, 0.0);
        let Fit { noise, free_headings, .. } = &self.fit;
        let pass_options = PassOptions { gate: self.gate(), ..options };
        pass(&self.records, &self.selections, &model, noise, free_headings, terms, pass_options)
    }

    pub(crate) fn gate(&self) -> OutlierGate {
        OutlierGate::of(self.ungated)
    }

    /// The fit to every measurement, those that lie far off too: a large effect that shows in few measurements makes them lie far off, and without them it is not seen. Where some
    /// err by themselves, it is a worse fit.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn refit_ungated(&self) -> Result<Self, EstimationError> {
        let mut open = Self { ungated: true, ..self.clone() };
        open.refit(None)?;
        Ok(open)
    }

    /// The values found, on every measurement of the first phase, those that lie far off too; nothing is fitted again.
    #[must_use]
    pub fn evaluated_ungated(&self) -> Self {
        let first = self.selections.iter().take(1).cloned().collect();
        Self { ungated: true, selections: Arc::new(first), ..self.clone() }
    }

    /// The same fit, measurements that lie far off by it left out. `terms` are those of the fit.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn refit_gated(&self, terms: &mut [Box<dyn ModelTerm>]) -> Result<Self, EstimationError> {
        let mut shut = Self { ungated: false, ..self.clone() };
        shut.refit_with(Some(self.here()), terms)?;
        Ok(shut)
    }

    /// The normal equation of the same pass where the last parameters come in parts of so many, each tested for itself: there is none of two parts together.
    #[must_use]
    pub fn scan_parts(&self, terms: &mut [Box<dyn ModelTerm>], parts: &[usize]) -> Vec<NormalEquations> {
        self.scan_with(terms, PassOptions { parts, ..PassOptions::default() }).runs
    }

    /// The fit with further terms, their sizes free beside what is free already, on the same measurements.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn extended(&self, terms: &mut [Box<dyn ModelTerm>]) -> Result<Self, EstimationError> {
        let parameters = terms.iter().map(|term| term.parameters().len()).sum::<usize>();
        self.extended_from(vec![0.0; parameters], terms)
    }

    /// The same, begun with given sizes: those of the terms that are in this fit already, say. The terms are those of `terms` only.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn extended_from(
        &self,
        term_values: Vec<f64>,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Result<Self, EstimationError> {
        let mut columns = self.columns.clone();
        columns.retain(|column| !matches!(column, Column::Term(_)));
        columns.extend((0..term_values.len()).map(Column::Term));
        let mut from = self.here();
        from.model.term_values = term_values;
        // Models with terms are compared by their likelihoods.
        let mut extended = Self { columns, ends: ConvergenceCriterion::Likelihood, ..self.clone() };
        extended.refit_with(Some(from), terms)?;
        Ok(extended)
    }

    /// Covariance of the free columns: from the observed information where runs are few and innovations white, else corrected for what the model gets wrong by the
    /// scatter of the runs (the sandwich over runs, each run's leverage taken into account). `terms` are those of the fit.
    #[must_use]
    pub fn covariance(&self, terms: &mut [Box<dyn ModelTerm>]) -> Option<DMatrix<f64>> {
        let free = self.free_basis();
        let (_, inverse) = self.fit.information(&self.columns)?.along(&free).solve()?;
        let units = self.units(terms);
        let enough = if self.thinning == Thinning::NONE { MIN_RUNS_FOR_ROBUST } else { free.ncols() + 2 };
        if units.len() < enough {
            return Some(&free * inverse * free.transpose());
        }
        let clusters = units.iter().map(|unit| unit.of(&self.columns).along(&free));
        Some(&free * ClusterRobust::of(&inverse, clusters).covariance * free.transpose())
    }

    /// An orthonormal basis of the directions of the free columns that are observable.
    #[must_use]
    pub fn free_basis(&self) -> DMatrix<f64> {
        free_basis(self.columns.len(), &self.fixed())
    }

    /// The Schur complement of the free columns, but for some that are asked for.
    #[must_use]
    pub fn eliminated(&self, equations: &NormalEquations, asked: &[usize]) -> Option<SchurComplement> {
        let columns: Vec<Column> =
            self.columns.iter().copied().filter(|column| !asked.contains(&column.index())).collect();
        let basis = free_basis(columns.len(), &self.fixed_along(&columns));
        SchurComplement::of(equations, &columns, basis)
    }
}
/// The directions of the three geometry parameters that a normal equation, which begins with them, does not determine.
pub(crate) fn unobservable(matrix: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let SymmetricEigen { eigenvalues, eigenvectors } = geometry_information(matrix).symmetric_eigen();
    (0..3)
        .filter(|&k| eigenvalues[k] < LARGEST_SIGMA.powi(-2))
        .map(|k| DVector::from_column_slice(eigenvectors.column(k).as_slice()))
        .collect()
}

/// Information on the three geometry parameters with the other columns at their best.
fn geometry_information(matrix: &DMatrix<f64>) -> Matrix3<f64> {
    let n = matrix.nrows();
    let own = matrix.view((0, 0), (3, 3)).into_owned();
    let rest = if n > 3 {
        let (cross, others) = (matrix.view((0, 3), (3, n - 3)), matrix.view((3, 3), (n - 3, n - 3)).into_owned());
        others.try_inverse().map_or_else(|| DMatrix::zeros(3, 3), |inverse| cross * inverse * cross.transpose())
    } else {
        DMatrix::zeros(3, 3)
    };
    Matrix3::from_iterator((own - rest).iter().copied())
}

/// Median time between measurements.
fn median_between(records: &Records<'_>) -> Option<f64> {
    let mut between: Vec<f64> = records.times_between().collect();
    if between.is_empty() {
        return None;
    }
    let middle = between.len() / 2;
    Some(*between.select_nth_unstable_by(middle, f64::total_cmp).1)
}
