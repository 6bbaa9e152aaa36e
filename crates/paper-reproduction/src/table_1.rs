//! Table 1 from simulation, under three hypotheses about where its scatter comes from.
//!
//! The straight-run experiment is repeated many times; every statistic of the table gets its simulated
//! distribution and the published value its place in it. Each hypothesis has one free size, set so that its
//! mean variance is the published one (the mean of both wheels). What is left to tell the hypotheses apart is
//! the *shape* of the samples, by a synthetic likelihood (Wood 2010): the simulated mean and covariance of
//! the shape statistics make a normal density, which is read at the published values.

use calib::methods::direct::{Direct, RunValue};
use dataset::{Protocol, ProtocolSettings};
use kinematics::{Side, Wheels};
use motion_programs::{Motion, MotionProgram};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use scenario::{Instrument, Scenario};
use serde::Serialize;
use sim_yair::SimulationError;

use super::published::TABLE_1;
use super::shape::{ROWS, SampleShape};
use super::units::{COUNTS_PER_PULSE, MM_PER_M};
use bench::Trial;

/// Where the scatter of table 1 comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Hypothesis {
    /// The wheels: every run has its own sensitivity (eq. 4 and 5), and everything is measured exactly.
    Wheels,
    /// The measuring: whole pulses, a 1 mm grid and a reading error, and wheels that are always the same.
    Measuring,
    /// Both, with half of the variance that counting and grid leave from each.
    Both,
}

impl Hypothesis {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Wheels, Self::Measuring, Self::Both];

    /// One line on what it says.
    #[must_use]
    pub const fn says(self) -> &'static str {
        match self {
            Self::Wheels => "the sensitivity itself varies from run to run (eq. 4, 5), measured exactly",
            Self::Measuring => "whole pulses, a 1 mm grid and a reading error, on wheels that never vary",
            Self::Both => "half of each",
        }
    }
}

/// One statistic of one wheel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Its name.
    pub statistic: &'static str,
    /// What the paper prints.
    pub published: f64,
    /// Simulated 2.5, 50 and 97.5 percentiles.
    pub percentiles: [f64; 3],
    /// Share of the simulated experiments below the published value, in per cent; ties count half.
    pub published_falls_at_percent: f64,
}

/// Table 1 under one hypothesis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table1 {
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    /// Standard deviation of reading one coordinate of a mark, metres.
    pub reading_sigma_m: f64,
    /// Relative standard deviation of the sensitivity from run to run.
    pub sensitivity_sigma: f64,
    /// Left wheel.
    pub left: Vec<Row>,
    /// Right wheel.
    pub right: Vec<Row>,
    /// Log synthetic likelihood of the published shape statistics of both wheels.
    pub log_likelihood: f64,
    /// The same as a difference from the best hypothesis.
    pub below_best: f64,
}

/// Length of a straight run as it is commanded: 500 mm on the floor are about 484 nominal millimetres to this
/// robot.
const COMMANDED_M: f64 = 0.5 / 1.0328;

/// Commanded lengths step through a millimetre by the golden section, so that runs do not all end at the same
/// fraction of a pulse.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Trials from which a hypothesis' size is found, at each of two sizes.
const TRIALS_TO_FIT: u64 = 400;

fn programs(runs: usize) -> Vec<MotionProgram> {
    (0..runs)
        .map(|run| {
            let length_m = COMMANDED_M + 1e-3 * ((run as f64 * GOLDEN).fract() - 0.5);
            let length_m = if run % 2 == 0 { length_m } else { -length_m };
            MotionProgram {
                id: format!("straight_{run:03}"),
                protocol: Protocol::Straight,
                settings: ProtocolSettings { length_m: Some(length_m), ..ProtocolSettings::default() },
                motions: vec![Motion::Straight { length_m }],
            }
        })
        .collect()
}

/// The paper's robot under a hypothesis of given sizes.
fn scenario(base: &Scenario, hypothesis: Hypothesis, reading_sigma_m: f64, sensitivity_sigma: f64) -> Scenario {
    let mut scenario = base.clone();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.noise.sensitivity_sigma = sensitivity_sigma;
    if hypothesis == Hypothesis::Wheels {
        // Wheels alone: nothing is rounded.
        scenario.effects.retain(|effect| !matches!(effect.hypothesis(), Some(effects::Hypothesis::Silent)));
        scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 0.0 }];
    } else {
        scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 1e-3, reading_sigma_m }];
    }
    scenario
}

/// One experiment: as many runs as the paper kept, wheel by wheel, after the outlier rule.
struct Experiment {
    trial: Trial,
    mm_per_pulse: f64,
}

impl Experiment {
    fn new(scenario: &Scenario) -> Result<Self, SimulationError> {
        let programs = programs(TABLE_1.left.count.max(TABLE_1.right.count));
        let trial = Trial::with_programs(scenario, scenario.seed, programs)?;
        let counts_per_turn = scenario.robot.encoder.counts_per_wheel_turn();
        let mm_per_pulse = MM_PER_M * std::f64::consts::TAU * COUNTS_PER_PULSE / counts_per_turn;
        Ok(Self { trial, mm_per_pulse })
    }

    /// Sensitivities of a trial, mm/pulse.
    fn sensitivities(&mut self, trial: u64) -> Result<Wheels<Vec<f64>>, SimulationError> {
        let session = [self.trial.drive(trial)?];
        // Marks stand beside the axle in every scenario of the paper: the method's only refusal cannot come.
        let values = Direct::straight_values(&session).unwrap_or_default();
        let kept = |values: &[RunValue<'_>], count: usize| {
            let values = &values[..count.min(values.len())];
            let numbers: Vec<f64> = values.iter().map(|value| value.value * self.mm_per_pulse).collect();
            let stated = values.iter().map(|value| value.stated_sigma * self.mm_per_pulse).fold(0.0, f64::max);
            let keep = Direct::DEFAULT.outliers.keep(&numbers, stated);
            numbers.into_iter().zip(keep).filter_map(|(number, keep)| keep.then_some(number)).collect()
        };
        Ok(Wheels { left: kept(&values.left, TABLE_1.left.count), right: kept(&values.right, TABLE_1.right.count) })
    }
}

/// Trials that one task drives.
const TRIALS_PER_TASK: u64 = 50;

/// Shapes of `trials` experiments in order.
fn variants(scenario: &Scenario, first: u64, trials: u64) -> Result<Vec<Wheels<SampleShape>>, SimulationError> {
    let tasks = trials.div_ceil(TRIALS_PER_TASK);
    let done: Result<Vec<Vec<Wheels<SampleShape>>>, SimulationError> = (0..tasks)
        .into_par_iter()
        .map(|task| {
            let mut experiment = Experiment::new(scenario)?;
            let from = task * TRIALS_PER_TASK;
            let mut variants = Vec::new();
            for trial in from..(from + TRIALS_PER_TASK).min(trials) {
                let values = experiment.sensitivities(first + trial)?;
                if let (Some(left), Some(right)) = (SampleShape::of(&values.left), SampleShape::of(&values.right)) {
                    variants.push(Wheels { left, right });
                }
            }
            Ok(variants)
        })
        .collect();
    Ok(done?.into_iter().flatten().collect())
}

/// Simulates table 1 under each hypothesis, `trials` times; `progress` is told of the experiments done.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated.
pub fn table_1(base: &Scenario, trials: u64, progress: &(dyn Fn(u64) + Sync)) -> Result<Vec<Table1>, SimulationError> {
    let mut tables = Vec::new();
    for hypothesis in Hypothesis::ALL {
        let (reading_sigma_m, sensitivity_sigma) = fitted_sizes(base, hypothesis)?;
        let variants =
            variants(&scenario(base, hypothesis, reading_sigma_m, sensitivity_sigma), TRIALS_TO_FIT, trials)?;
        progress(trials);
        tables.push(Table1 {
            hypothesis,
            reading_sigma_m,
            sensitivity_sigma,
            left: rows(&variants, Side::Left),
            right: rows(&variants, Side::Right),
            log_likelihood: log_synthetic_likelihood(&variants),
            below_best: 0.0,
        });
    }
    let best = tables.iter().map(|table| table.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
    for table in &mut tables {
        table.below_best = best - table.log_likelihood;
    }
    Ok(tables)
}

/// The sensitivities of one experiment, mm/pulse, after the outlier rule.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated.
pub fn sample(
    base: &Scenario,
    hypothesis: Hypothesis,
    reading_sigma_m: f64,
) -> Result<Wheels<Vec<f64>>, SimulationError> {
    Experiment::new(&scenario(base, hypothesis, reading_sigma_m, 0.0))?.sensitivities(TRIALS_TO_FIT)
}

/// The sizes at which a hypothesis has the published variance, the mean of both wheels; variances add, so two
/// simulations say where.
fn fitted_sizes(base: &Scenario, hypothesis: Hypothesis) -> Result<(f64, f64), SimulationError> {
    let published = 0.5 * (TABLE_1.left.variance + TABLE_1.right.variance);
    let mean_c = 0.5 * (TABLE_1.left.mean + TABLE_1.right.mean);
    let variance = |reading_sigma_m: f64, sensitivity_sigma: f64| -> Result<f64, SimulationError> {
        let variants = variants(&scenario(base, hypothesis, reading_sigma_m, sensitivity_sigma), 0, TRIALS_TO_FIT)?;
        let n = variants.len() as f64;
        Ok(variants.iter().map(|shape| 0.5 * (shape.left.variance + shape.right.variance)).sum::<f64>() / n)
    };
    if hypothesis == Hypothesis::Wheels {
        return Ok((0.0, published.sqrt() / mean_c));
    }
    // Reading errors: from rounding alone to a millimetre of reading error the variance grows by a known
    // multiple of σ².
    let (none, some) = (variance(0.0, 0.0)?, variance(1e-3, 0.0)?);
    let left_to_explain = (published - none).max(0.0);
    let share = if hypothesis == Hypothesis::Both { 0.5 } else { 1.0 };
    let reading_sigma_m = 1e-3 * (share * left_to_explain / (some - none)).sqrt();
    Ok((reading_sigma_m, ((1.0 - share) * left_to_explain).sqrt() / mean_c))
}

fn rows(variants: &[Wheels<SampleShape>], side: Side) -> Vec<Row> {
    ROWS.iter()
        .map(|(statistic, of)| {
            let mut values: Vec<f64> = variants.iter().map(|shape| of(&shape[side])).collect();
            values.sort_unstable_by(f64::total_cmp);
            let published = of(&TABLE_1[side]);
            let below = values.iter().filter(|value| **value < published).count();
            let equal = values.iter().filter(|value| **value == published).count();
            let published_falls_at_percent = 100.0 * (below as f64 + 0.5 * equal as f64) / values.len() as f64;
            let percentiles = [0.025, 0.5, 0.975].map(|share| quantile(&values, share));
            Row { statistic, published, percentiles, published_falls_at_percent }
        })
        .collect()
}

/// Quantile of sorted values, interpolated between order statistics (type 7 of Hyndman & Fan 1996).
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let position = share * (sorted.len() - 1) as f64;
    let low = position.floor() as usize;
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + position.fract() * (sorted[high] - sorted[low])
}

/// What of a shape can discriminate hypotheses once location and scale are fitted: the spread of both wheels,
/// the extremes in standard deviations, and the standardized moments.
fn features(shape: &Wheels<SampleShape>) -> Vec<f64> {
    Side::BOTH
        .iter()
        .flat_map(|side| {
            let SampleShape { mean, std, min, max, skewness_z, kurtosis_z, .. } = shape[*side];
            [std.ln(), (mean - min) / std, (max - mean) / std, skewness_z, kurtosis_z]
        })
        .collect()
}

fn log_synthetic_likelihood(variants: &[Wheels<SampleShape>]) -> f64 {
    let features_of: Vec<DVector<f64>> = variants.iter().map(|shape| DVector::from_vec(features(shape))).collect();
    let size = features_of[0].len();
    let n = features_of.len() as f64;
    let mean = features_of.iter().fold(DVector::zeros(size), |sum, feature| sum + feature) / n;
    let covariance = features_of.iter().fold(DMatrix::zeros(size, size), |sum, feature| {
        let departure = feature - &mean;
        sum + &departure * departure.transpose()
    }) / (n - 1.0);
    let Some(cholesky) = covariance.cholesky() else { return f64::NEG_INFINITY };
    let departure = DVector::from_vec(features(&TABLE_1)) - mean;
    let log_determinant = 2.0 * cholesky.l().diagonal().iter().map(|diagonal| diagonal.ln()).sum::<f64>();
    let normalisation = size as f64 * std::f64::consts::TAU.ln();
    -0.5 * (departure.dot(&cholesky.solve(&departure)) + log_determinant + normalisation)
}
