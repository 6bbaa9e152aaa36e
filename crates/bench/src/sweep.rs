//! Sweeps: points × trials × methods on all cores, the same result on any number of them.

use calib::{Calibration, Method, Parameter, method};
use rayon::prelude::*;
use scenario::{Point, Scenario, ScenarioError};
use serde::Serialize;
use sim_yair::SimulationError;

use crate::moments::Moments;
use crate::trial::Trial;

/// Parameters that a sweep follows: the paper's C_L, C_R and B.
pub const TRACKED: [Parameter; 3] = [Parameter::LeftPerTick, Parameter::RightPerTick, Parameter::WheelSeparation];

/// Trials whose sums are gathered by one task. Fixed, so that the order of additions does not depend on the number of threads.
const TRIALS_PER_CHUNK: u64 = 64;

/// Half-width of the central 95 % of a standard normal.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Why a sweep cannot be run or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The scenario has no `[sweep]`.
    #[error("{scenario}: the scenario has no [sweep] section; add trials and methods")]
    NoSweep {
        /// The scenario's name.
        scenario: String,
    },
    /// A method that does not exist.
    #[error("unknown method \"{name}\"; known: {}", known.join(", "))]
    UnknownMethod {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<&'static str>,
    },
    /// Fewer trials than a spread needs.
    #[error("{trials} trials show no spread; ask for at least 2")]
    TooFewTrials {
        /// How many were asked for.
        trials: u64,
    },
    /// The scenario's points are not scenarios.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A cause of the paper's contradictions cannot be fitted.
    #[error(transparent)]
    Cause(#[from] crate::paper::cause::CauseError),
    /// A point cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The threads cannot be started.
    #[error("cannot start {jobs} threads: {why}")]
    Threads {
        /// How many were asked for.
        jobs: usize,
        /// The system's reason.
        why: String,
    },
    /// Results cannot be written.
    #[error("{path}: {why}")]
    Write {
        /// The file.
        path: String,
        /// The reason.
        why: String,
    },
}

/// A sweep ready to run.
pub struct SweepPlan {
    scenario: String,
    seed: u64,
    trials: u64,
    points: Vec<Point>,
    methods: Vec<&'static dyn Method>,
}

impl SweepPlan {
    /// Plans a scenario's sweep; `trials` and `seed` take the place of the scenario's.
    ///
    /// # Errors
    /// [`BenchError`] when there is no sweep in it, or its methods or axes do not exist.
    pub fn new(scenario: &Scenario, trials: Option<u64>, seed: Option<u64>) -> Result<Self, BenchError> {
        let sweep = scenario.sweep.as_ref().ok_or_else(|| BenchError::NoSweep { scenario: scenario.name.clone() })?;
        let trials = trials.unwrap_or(sweep.trials);
        if trials < 2 {
            return Err(BenchError::TooFewTrials { trials });
        }
        let known = || calib::METHODS.iter().map(|method| method.name()).collect();
        let methods = sweep
            .methods
            .iter()
            .map(|name| method(name).ok_or_else(|| BenchError::UnknownMethod { name: name.clone(), known: known() }))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            scenario: scenario.name.clone(),
            seed: seed.unwrap_or(scenario.seed),
            trials,
            points: sweep.points(scenario, &scenario.name)?,
            methods,
        })
    }

    /// Trials over all points.
    #[must_use]
    pub fn total_trials(&self) -> u64 {
        self.trials * self.points.len() as u64
    }

    /// Runs the sweep on `jobs` threads (0 = one a core). `progress` is told of trials done, from any thread.
    ///
    /// # Errors
    /// [`BenchError`] when a point cannot be simulated. A method that fails on a trial is counted and is no error.
    pub fn run(&self, jobs: usize, progress: &(dyn Fn(u64) + Sync)) -> Result<SweepResult, BenchError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(jobs)
            .build()
            .map_err(|error| BenchError::Threads { jobs, why: error.to_string() })?;
        let chunks = self.trials.div_ceil(TRIALS_PER_CHUNK);
        let tasks: Vec<(usize, u64)> =
            (0..self.points.len()).flat_map(|point| (0..chunks).map(move |chunk| (point, chunk))).collect();
        let done: Vec<Result<Vec<Tally>, BenchError>> =
            pool.install(|| tasks.par_iter().map(|&(point, chunk)| self.chunk(point, chunk, progress)).collect());

        let mut done = done.into_iter();
        let mut points = Vec::with_capacity(self.points.len());
        for point in &self.points {
            let mut sums = vec![Tally::default(); self.methods.len() * TRACKED.len()];
            for chunk in done.by_ref().take(usize::try_from(chunks).unwrap_or(usize::MAX)) {
                for (sum, tally) in sums.iter_mut().zip(chunk?) {
                    sum.merge(&tally);
                }
            }
            points.push(self.point_result(point, &sums)?);
        }
        Ok(SweepResult { scenario: self.scenario.clone(), seed: self.seed, trials: self.trials, points })
    }

    /// One task: a chunk of one point's trials, summed in order.
    fn chunk(&self, point: usize, chunk: u64, progress: &(dyn Fn(u64) + Sync)) -> Result<Vec<Tally>, BenchError> {
        let mut trial = Trial::new(&self.points[point].scenario, self.seed)?;
        let truth = TRACKED.map(|parameter| truth(&trial, parameter));
        let mut tallies = vec![Tally::default(); self.methods.len() * TRACKED.len()];
        let first = chunk * TRIALS_PER_CHUNK;
        let last = (first + TRIALS_PER_CHUNK).min(self.trials);
        for number in first..last {
            let session = [trial.drive(number)?];
            for (tallies, method) in tallies.chunks_exact_mut(TRACKED.len()).zip(&self.methods) {
                let calibration = method.calibrate(&session);
                for ((tally, parameter), truth) in tallies.iter_mut().zip(TRACKED).zip(truth) {
                    tally.take(calibration.as_ref().ok(), parameter, truth);
                }
            }
        }
        progress(last - first);
        Ok(tallies)
    }

    fn point_result(&self, point: &Point, sums: &[Tally]) -> Result<PointResult, BenchError> {
        let trial = Trial::new(&point.scenario, self.seed)?;
        let estimators = sums
            .chunks_exact(TRACKED.len())
            .zip(&self.methods)
            .flat_map(|(sums, method)| sums.iter().zip(TRACKED).map(|(sum, parameter)| (*method, sum, parameter)))
            .map(|(method, sum, parameter)| sum.result(method.name(), parameter, truth(&trial, parameter)))
            .collect();
        Ok(PointResult { levels: point.levels.iter().cloned().collect(), estimators })
    }
}

fn truth(trial: &Trial, parameter: Parameter) -> f64 {
    let geometry = trial.true_geometry();
    let per_tick = std::f64::consts::PI / trial.ticks_per_rev().unwrap_or(f64::NAN);
    match parameter {
        Parameter::LeftPerTick => per_tick * geometry.wheel_diameter_m().left,
        Parameter::RightPerTick => per_tick * geometry.wheel_diameter_m().right,
        Parameter::LeftWheelDiameter => geometry.wheel_diameter_m().left,
        Parameter::RightWheelDiameter => geometry.wheel_diameter_m().right,
        _ => geometry.wheel_separation_m(),
    }
}

/// What is kept of one method's estimates of one parameter at one point.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    errors: Moments,
    with_sigma: u64,
    covered: u64,
    failures: u64,
    blind: u64,
}

impl Tally {
    fn take(&mut self, calibration: Option<&Calibration>, parameter: Parameter, truth: f64) {
        let estimate =
            calibration.filter(|calibration| calibration.converged).and_then(|found| found.estimate(parameter));
        let Some(estimate) = estimate.filter(|estimate| estimate.value.is_finite()) else {
            self.failures += 1;
            return;
        };
        let error = estimate.value - truth;
        self.errors.push(error);
        if let Some(sigma) = estimate.sigma {
            self.with_sigma += 1;
            self.covered += u64::from(error.abs() <= NORMAL_95 * sigma);
        }
        let scale =
            |blind: &calib::NotObservable| blind.parameter == parameter || blind.parameter == Parameter::CommonScale;
        self.blind += u64::from(calibration.is_some_and(|calibration| calibration.not_observable.iter().any(scale)));
    }

    fn merge(&mut self, other: &Self) {
        self.errors.merge(&other.errors);
        self.with_sigma += other.with_sigma;
        self.covered += other.covered;
        self.failures += other.failures;
        self.blind += other.blind;
    }

    #[allow(clippy::cast_precision_loss)] // counts of trials
    fn result(&self, method: &str, parameter: Parameter, truth: f64) -> EstimatorResult {
        let (bias, bias_mcse) = self.errors.bias().unzip();
        let (variance, variance_mcse) = self.errors.variance().unzip();
        let (rmse, rmse_mcse) = self.errors.rmse().unzip();
        EstimatorResult {
            method: method.to_owned(),
            parameter: parameter.key().to_owned(),
            truth,
            bias,
            bias_mcse,
            variance,
            variance_mcse,
            rmse,
            rmse_mcse,
            coverage: (self.with_sigma > 0).then(|| self.covered as f64 / self.with_sigma as f64),
            failures: self.failures,
            common_scale_observable: self.blind == 0,
            cramer_rao_ratio: None,
            cramer_rao_why_null: "the bound of this protocol's information is not computed yet",
        }
    }
}

/// A sweep's result, as `yair sweep --json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepResult {
    /// The scenario's name.
    pub scenario: String,
    /// Seed of every draw.
    pub seed: u64,
    /// Trials at each point.
    pub trials: u64,
    /// Point by point, in the order of the grid.
    pub points: Vec<PointResult>,
}

/// One point of the grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointResult {
    /// Level on each axis.
    pub levels: std::collections::BTreeMap<String, f64>,
    /// Each method's account of each parameter.
    pub estimators: Vec<EstimatorResult>,
}

/// How one method did on one parameter. `null` where no trial succeeded.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimatorResult {
    /// The method.
    pub method: String,
    /// The parameter's key.
    pub parameter: String,
    /// Its true value.
    pub truth: f64,
    /// Mean error.
    pub bias: Option<f64>,
    /// Monte-Carlo standard error of the bias.
    pub bias_mcse: Option<f64>,
    /// Variance of the error.
    pub variance: Option<f64>,
    /// Monte-Carlo standard error of the variance.
    pub variance_mcse: Option<f64>,
    /// Root of the mean squared error.
    pub rmse: Option<f64>,
    /// Monte-Carlo standard error of the RMSE.
    pub rmse_mcse: Option<f64>,
    /// Share of the 95 % intervals (±1.96 sigma) that hold the truth.
    pub coverage: Option<f64>,
    /// Trials in which the method gave no value.
    pub failures: u64,
    /// False when the method cannot see the scale common to both wheels: its bias is then that scale's.
    pub common_scale_observable: bool,
    /// RMSE² over the Cramér–Rao bound.
    pub cramer_rao_ratio: Option<f64>,
    /// Why there is no ratio.
    pub cramer_rao_why_null: &'static str,
}

impl EstimatorResult {
    /// Standard deviation of the error with its Monte-Carlo standard error.
    #[must_use]
    pub fn std(&self) -> Option<(f64, f64)> {
        let (variance, mcse) = (self.variance?, self.variance_mcse?);
        let std = variance.sqrt();
        Some((std, if std > 0.0 { mcse / (2.0 * std) } else { 0.0 }))
    }
}
