//! The maximum-likelihood fit of whole runs: its records, the measurements taken of them, its free columns,
//! and what can be done with a fit.

use std::sync::Arc;

use dataset::Session;
use kinematics::Pose;
use model_term::ModelTerm;
use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;
use rules::Rule;

use crate::error::EstimationError;
use crate::model::{Column, Model};
use crate::noise::NoisePrior;
use crate::normal_equations::{NormalEquations, SchurComplement, free_basis};
use crate::optimizer::{ConvergenceCriterion, FitOptions, InitialValues, Solution, fit_from};
use crate::pass::{Pass, pass};
use crate::pass_options::{OutlierGate, PassOptions};
use crate::records::Records;
use crate::segment::Segment;
use crate::settings::{COMMON, DRIVE_PRIOR_SIGMA, NUISANCES, START_HEADINGS, WHITENESS_Z};
use crate::stated_wheels::with_stated_wheels;
use crate::thinning::{Selection, Thinning};

/// A maximum-likelihood fit with the records and measurements that it rests on.
///
/// Values are in `solution.model`, SI units. Steps and covariances are by [`Column`]: relative changes of
/// both diameters and the separation, metres and radians of the instrument, seconds of latency, then the
/// parameters of terms in their own units. [`FitSettings::fit`](crate::FitSettings::fit) makes one.
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
    /// Where fits start: the nominal drive, with the approximate heading of its sensor.
    pub(crate) start: Model,
    /// The values found, with the pass at them.
    pub solution: Solution,
    /// The free columns.
    pub columns: Vec<Column>,
    /// Directions of the three geometry parameters that the data do not determine, and that stay nominal:
    /// rows left, right, separation.
    pub unobservable: Vec<DVector<f64>>,
    pub(crate) prior: NoisePrior,
    /// When the steps of its fits have converged.
    pub(crate) ends: ConvergenceCriterion,
    /// Normal equations of parts, for a fit whose records have no measurements.
    pub(crate) parts: Vec<NormalEquations>,
    /// What systematic errors add to the covariance of the free columns, of such a fit.
    pub(crate) by_systematic_errors: Option<DMatrix<f64>>,
    /// Displacements of a run count as a series when autocorrelation is tested.
    pub(crate) displacements_in_series: bool,
    /// Measurements are not gated: outliers are taken too.
    pub(crate) ungated: bool,
}

impl<'a> ModelFit<'a> {
    /// Records of sessions and a nominal model; nothing is fitted.
    pub(crate) fn before_any_step(
        sessions: &[Session<'a>],
        nominal: Model,
        ends: ConvergenceCriterion,
        displacements_in_series: bool,
    ) -> Self {
        Self::of_records(sessions, Records::of(sessions), [nominal.clone(), nominal], ends, displacements_in_series)
    }

    /// The same of the sessions' records, with the model that fits start from.
    pub(crate) fn of_records(
        sessions: &[Session<'_>],
        records: Records<'a>,
        [nominal, start]: [Model; 2],
        ends: ConvergenceCriterion,
        displacements_in_series: bool,
    ) -> Self {
        let mut columns = Column::GEOMETRY.to_vec();
        if records.has_gyro() {
            columns.push(Column::GyroScale);
        }
        let stated = sessions.first().map(|session| session.truth_noise).unwrap_or_default();
        let prior = NoisePrior { common_scale: records.common_scale, ..NoisePrior::of(stated) };
        Self {
            selections: Arc::new(Selection::of(&records, Thinning::NONE, &start)),
            thinning: Thinning::NONE,
            solution: Solution::nothing(&nominal, &prior),
            columns,
            unobservable: Vec::new(),
            records: Arc::new(records),
            start,
            nominal,
            prior,
            ends,
            parts: Vec::new(),
            by_systematic_errors: None,
            displacements_in_series,
            ungated: false,
        }
    }
}

impl ModelFit<'_> {
    /// The values found, with records that hold no measurements.
    pub(crate) fn with_records<'b>(self, records: Records<'b>) -> ModelFit<'b> {
        let Self { thinning, nominal, start, solution, columns, unobservable, prior, ends, parts, .. } = self;
        let pass =
            Pass { innovations: Arc::default(), outliers: Vec::new(), partial_outliers: Vec::new(), ..solution.pass };
        let solution = Solution { pass, ..solution };
        let (displacements_in_series, ungated) = (self.displacements_in_series, self.ungated);
        let by_systematic_errors = self.by_systematic_errors;
        ModelFit {
            records: Arc::new(records),
            selections: Arc::default(),
            thinning,
            nominal,
            start,
            solution,
            columns,
            unobservable,
            prior,
            ends,
            parts,
            by_systematic_errors,
            displacements_in_series,
            ungated,
        }
    }

    /// The first fit. The extrinsics of a sensor of positions are free where it is elsewhere than at the
    /// drive's centre by the dead-reckoned paths, and by the fit: what the paths show may be another effect.
    pub(crate) fn first_fit(&mut self) -> Result<(), EstimationError> {
        let Some([x_m, y_m]) = Rule::SensorPosition.finds(self.records.sensor_position_m(&self.start)) else {
            return self.refit(None, &mut []);
        };
        let centred = self.clone();
        self.start.body_from_sensor = Pose::new(x_m, y_m, self.start.body_from_sensor.theta_rad);
        self.columns.extend(self.records.extrinsics());
        self.refit(None, &mut [])?;
        if self
            .sensor_position_chi_square()
            .is_none_or(|chi_square| chi_square < START_HEADINGS.min_sensor_position_chi_square)
        {
            *self = centred;
            self.refit(None, &mut [])?;
        }
        Ok(())
    }

    /// The square of the sensor's position in its standard deviations, of a drive as it is stated but for
    /// what the measurements show.
    fn sensor_position_chi_square(&self) -> Option<f64> {
        let precision = |column| if Column::GEOMETRY.contains(column) { DRIVE_PRIOR_SIGMA.powi(-2) } else { 0.0 };
        let information = self.solution.information(&self.columns)?.with_precision(self.columns.iter().map(precision));
        let rows = [self.position(Column::SensorX)?, self.position(Column::SensorY)?];
        let covariance = information.solve()?.1.select_rows(&rows).select_columns(&rows);
        let Pose { x_m, y_m, .. } = self.solution.model.body_from_sensor;
        let position = DVector::from_vec(vec![x_m, y_m]);
        Some(position.dot(&covariance.cholesky()?.solve(&position)))
    }

    /// Fits the free columns from given values, or from where the fit began. `terms` are those of the fit.
    pub(crate) fn refit(
        &mut self,
        from: Option<InitialValues>,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Result<(), EstimationError> {
        self.refit_by(&self.fit_options(), from, terms)
    }

    pub(crate) fn refit_by(
        &mut self,
        options: &FitOptions,
        from: Option<InitialValues>,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Result<(), EstimationError> {
        let from =
            from.unwrap_or_else(|| InitialValues { model: self.start.clone(), noise: None, free_headings: None });
        self.solution = fit_from(&self.records, &self.selections, from, &self.prior, terms, options)?;
        Ok(())
    }

    pub(crate) fn fit_options(&self) -> FitOptions {
        let Self { ends, ungated, .. } = *self;
        FitOptions { fixed: self.fixed(), ends, ungated, ..FitOptions::of(&self.columns) }
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

    pub(crate) fn current_values(&self) -> InitialValues {
        let Solution { model, noise, free_headings, .. } = &self.solution;
        InitialValues { model: model.clone(), noise: Some(*noise), free_headings: Some(free_headings.clone()) }
    }

    pub(crate) fn is_white(&self) -> bool {
        self.correlation() <= WHITENESS_Z
    }

    /// The largest autocorrelation of the innovations over the components, in standard errors: at lag 1, and
    /// at several lags for displacements where these are to be thinned.
    #[must_use]
    pub fn correlation(&self) -> f64 {
        let times_taken = self.times_taken();
        let of_each: Vec<f64> = (0..3)
            .into_par_iter()
            .map(|component| {
                let (mut products, mut squares, mut pairs, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
                for phase in self.solution.pass.innovations.iter() {
                    let series: Vec<_> = phase.iter().filter(|innovation| innovation.component == component).collect();
                    for (number, innovation) in series.iter().enumerate() {
                        squares += innovation.z * innovation.z;
                        count += 1.0;
                        for (lag, before) in (1..=COMMON.max_autocorrelation_lag).zip(series[..number].iter().rev()) {
                            let weight = self.records.weight_of_pair(before.segment, innovation.segment, lag);
                            let counts = self.displacements_in_series || before.segment == innovation.segment;
                            if counts && weight > 0.0 {
                                products += weight * before.z * innovation.z;
                                pairs += weight * weight;
                            }
                        }
                    }
                }
                if pairs == 0.0 { 0.0 } else { products / (squares / count) / (pairs * times_taken).sqrt() }
            })
            .collect();
        of_each.into_iter().fold(0.0, |largest: f64, z| largest.max(z.abs()))
    }

    /// Mean number of phases in which the errors of a measurement are: all of them for poses, as their
    /// propagation intervals overlap; those that take it for a displacement.
    fn times_taken(&self) -> f64 {
        let taken =
            |segment: usize| self.selections.iter().filter(|phase| !phase.propagations[segment].is_empty()).count();
        if self.records.segments.iter().all(Segment::is_displacement) {
            let times = (0..self.records.segments.len()).map(taken).filter(|times| *times > 0);
            let (sum, count) = times.fold((0, 0), |(sum, count), times| (sum + times, count + 1));
            sum as f64 / f64::max(f64::from(count), 1.0)
        } else {
            self.solution.pass.innovations.len() as f64
        }
    }

    /// The normal equation in units that can be held out: runs, or blocks where runs are few. `terms` are
    /// those of the fit.
    #[must_use]
    pub fn units(&self, terms: &mut [Box<dyn ModelTerm>]) -> Vec<NormalEquations> {
        if self.solution.pass.runs.len() >= NUISANCES.min_runs_to_hold_out {
            return self.solution.pass.runs.clone();
        }
        if !self.parts.is_empty() {
            return self.parts.clone();
        }
        self.in_blocks(terms, NUISANCES.min_runs_to_hold_out.div_ceil(self.solution.pass.runs.len().max(1)))
    }

    /// Finds the directions of the geometry parameters that the measurements do not determine, and fixes them
    /// at their nominal values.
    pub(crate) fn fix_unobservable(&mut self) -> Result<(), EstimationError> {
        let Some(information) = self.solution.information(&self.columns) else { return Ok(()) };
        let directions = with_stated_wheels(unobservable(&information.matrix), self.records.is_partial());
        if !Rule::FixUnobservable.applies(!directions.is_empty()) {
            let was_fixed = !std::mem::take(&mut self.unobservable).is_empty();
            // A direction that has become observable is free again.
            return if was_fixed { self.refit(Some(self.current_values()), &mut []) } else { Ok(()) };
        }
        // The model goes back to where it began along unobservable directions only.
        let nominal = [self.start.m_per_rad.left, self.start.m_per_rad.right, self.start.separation_m];
        let mut model = self.solution.model.clone();
        let found = [model.m_per_rad.left, model.m_per_rad.right, model.separation_m];
        let moved = DVector::from_fn(3, |row, _| f64::ln(found[row] / nominal[row]));
        let along: Vec<f64> = directions.iter().map(|direction| direction.dot(&moved)).collect();
        let is_fixed = |(direction, along): (&DVector<f64>, &f64)| {
            let within: f64 = self.unobservable.iter().map(|fixed| fixed.dot(direction).powi(2)).sum();
            within.sqrt() > COMMON.min_named_direction && along.abs() < COMMON.max_nominal_deviation
        };
        if directions.len() == self.unobservable.len() && directions.iter().zip(&along).all(is_fixed) {
            return Ok(());
        }
        for (direction, along) in directions.iter().zip(along) {
            for (column, share) in Column::GEOMETRY.into_iter().zip(direction.iter()) {
                model.advance(column, -along * share);
            }
        }
        self.unobservable = directions;
        let from = InitialValues { model, noise: None, free_headings: None };
        self.refit(Some(from), &mut [])
    }

    /// One pass at the values found, with the sensitivities of further terms at zero: what score tests are
    /// made of. The terms of the fit come first.
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
        let (model, gate) = (self.with_zero_terms(terms), self.gate());
        let Solution { noise, free_headings, .. } = &self.solution;
        pass(&self.records, &self.selections, &model, noise, free_headings, terms, PassOptions { gate, ..options })
    }

    /// The model found with further terms at zero; those of the fit come first and keep their values.
    fn with_zero_terms(&self, terms: &[Box<dyn ModelTerm>]) -> Model {
        let mut model = self.solution.model.clone();
        model.term_values.resize(terms.iter().map(|term| term.parameters().len()).sum(), 0.0);
        model
    }

    pub(crate) fn gate(&self) -> OutlierGate {
        OutlierGate::of(self.ungated)
    }

    /// The fit to every measurement, outliers too. A large effect that shows in few measurements makes
    /// outliers of these, and is lost without them. Where measurements have gross errors of their own, it is
    /// a worse fit. It has no innovations, which [`Self::with_innovations`] finds.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn refit_ungated(&self) -> Result<Self, EstimationError> {
        let mut ungated_fit = Self { ungated: true, ..self.clone() };
        let options = FitOptions { innovations: false, ..ungated_fit.fit_options() };
        ungated_fit.refit_by(&options, None, &mut [])?;
        Ok(ungated_fit)
    }

    /// The values found, evaluated on every measurement of the first phase, outliers too; nothing is fitted
    /// again.
    #[must_use]
    pub fn evaluated_ungated(&self) -> Self {
        let first = self.selections.iter().take(1).cloned().collect();
        Self { ungated: true, selections: Arc::new(first), ..self.clone() }
    }

    /// The same fit with outliers rejected. `terms` are those of the fit.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn refit_gated(&self, terms: &mut [Box<dyn ModelTerm>]) -> Result<Self, EstimationError> {
        let mut gated = Self { ungated: false, ..self.clone() };
        gated.refit(Some(self.current_values()), terms)?;
        Ok(gated)
    }

    /// The normal equations of the same pass for terms that are tested one by one: the last parameters come
    /// in parts of these sizes, and columns of two parts have no products. Neither have columns that are not
    /// free.
    #[must_use]
    pub fn scan_parts(&self, terms: &mut [Box<dyn ModelTerm>], parts: &[usize]) -> Vec<NormalEquations> {
        let (model, gate) = (self.with_zero_terms(terms), self.gate());
        let Solution { noise, free_headings, .. } = &self.solution;
        let pass_options = PassOptions { parts, gate, free: Some(&self.columns), ..PassOptions::default() };
        pass(&self.records, &self.selections, &model, noise, free_headings, terms, pass_options).runs
    }

    /// The fit with further terms, whose values are free beside the columns that are free already, on the
    /// same measurements; without innovations, which [`Self::with_innovations`] finds.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn extended(&self, terms: &mut [Box<dyn ModelTerm>]) -> Result<Self, EstimationError> {
        let parameters = terms.iter().map(|term| term.parameters().len()).sum::<usize>();
        self.extended_from(vec![0.0; parameters], terms)
    }

    /// The same from given values of all `terms`, which replace those of this fit.
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
        let mut from = self.current_values();
        from.model.term_values = term_values;
        // Models with terms are compared by their likelihoods.
        let mut extended = Self { columns, ends: ConvergenceCriterion::Likelihood, ..self.clone() };
        let options = FitOptions { innovations: false, ..extended.fit_options() };
        extended.solution = fit_from(&extended.records, &extended.selections, from, &extended.prior, terms, &options)?;
        Ok(extended)
    }

    /// Where a column stands among the free ones, in steps and covariances; `None` where it is not free.
    #[must_use]
    pub fn position(&self, column: Column) -> Option<usize> {
        self.columns.iter().position(|of| *of == column)
    }

    /// Whether what is fitted explains all that was measured: the noise, and every standard deviation with
    /// it, is that of the prior then.
    #[must_use]
    pub fn shows_no_scatter(&self) -> bool {
        self.solution.pass.shows_no_scatter(self.free_basis().ncols())
    }

    /// An orthonormal basis of the directions of the free columns that are observable.
    #[must_use]
    pub fn free_basis(&self) -> DMatrix<f64> {
        free_basis(self.columns.len(), &self.fixed())
    }

    /// The same of some columns alone.
    #[must_use]
    pub fn free_basis_of(&self, columns: &[Column]) -> DMatrix<f64> {
        free_basis(columns.len(), &self.fixed_along(columns))
    }

    /// The Schur complement of the free columns, without some.
    #[must_use]
    pub fn eliminated(&self, equations: &NormalEquations, others: &[usize]) -> Option<SchurComplement> {
        let columns: Vec<Column> =
            self.columns.iter().copied().filter(|column| !others.contains(&column.index())).collect();
        let basis = self.free_basis_of(&columns);
        SchurComplement::of(equations, &columns, basis)
    }
}
/// The directions of the three geometry parameters that a normal equation, which begins with them, does not
/// determine.
pub(crate) fn unobservable(matrix: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let SymmetricEigen { eigenvalues, eigenvectors } = geometry_information(matrix).symmetric_eigen();
    let directions: Vec<Vector3<f64>> = (0..3)
        .filter(|&k| eigenvalues[k] < COMMON.max_observable_sigma.powi(-2))
        .map(|k| eigenvectors.column(k).into_owned())
        .collect();
    disentangled(&directions).into_iter().map(|of| DVector::from_column_slice(of.as_slice())).collect()
}

/// The same space, by the separation alone, or the wheels' common scale, where these lie in it: eigenvectors
/// that are equally unobservable are any mixture.
fn disentangled(directions: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    if directions.len() < 2 {
        return directions.to_vec();
    }
    let within = |of: &Vector3<f64>| directions.iter().map(|direction| direction * direction.dot(of)).sum();
    let named = [Vector3::z(), Vector3::new(1.0, 1.0, 0.0).normalize(), Vector3::new(1.0, -1.0, 0.0).normalize()];
    let mut own: Vec<Vector3<f64>> = Vec::new();
    for of in named.iter().chain(directions) {
        let inside: Vector3<f64> = within(of);
        let rest = own.iter().fold(inside, |rest, before| rest - before * before.dot(&rest));
        // What is no direction of its own any more is left out; the named ones only where they are inside.
        let is_own =
            rest.norm() > if directions.contains(of) { COMMON.min_own_direction } else { COMMON.min_named_direction };
        if is_own && own.len() < directions.len() {
            own.push(rest.normalize());
        }
    }
    if own.len() == directions.len() { own } else { directions.to_vec() }
}

/// Information on the three geometry parameters with the other columns eliminated.
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
