//! A sweep ready to run: the points of its design, who estimates at each of them from what, and one chunk of
//! trials at a time.

use calib::{Calibration, Method, Parameter, method};
use dataset::LANES;
use motion_programs::MotionProgram;
use scenario::{Point, Scenario};

use super::result::{DriftResult, EstimatorResult, MethodCost, PointResult};
use super::tally::{Bound, ChunkSum, Outcome, PointSum, Tally, estimator_result, largest_drift_error, largest_error};
use super::validation::Validation;
use crate::bound::FisherInformation;
use crate::error::BenchError;
use crate::moments::Moments;
use crate::trial::Trial;

/// Parameters that a sweep follows: the paper's C_L, C_R and B.
pub const TRACKED: [Parameter; 3] = [Parameter::LeftPerTick, Parameter::RightPerTick, Parameter::WheelSeparation];

/// Trials that are summed by one task, a leaf of the tree of sums. Fixed, so that the sums do not depend on
/// who adds them; few, so that stepped trials of a second lose little when a campaign is killed.
pub(super) const TRIALS_PER_CHUNK: u64 = 16;

/// Most trials at a point that is to become precise, unless the caller says otherwise.
const MAX_FOR_PRECISION: u64 = 1_000_000;

/// Fewest trials from which the number that a precision needs is foretold: below, kurtoses are guesses.
const MIN_FOR_PRECISION: u64 = 512;

/// What takes the place of the scenario's own.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SweepOptions {
    /// Trials at each point; with a precision, at most so many.
    pub trials: Option<u64>,
    /// Seed of every draw.
    pub seed: Option<u64>,
    /// Run each point until the largest Monte-Carlo error of its numbers is this: of bias and quantiles
    /// relative to the spread, of spread, RMSE and efficiency relative to themselves, of coverages as it is.
    pub precision: Option<f64>,
}

/// A sweep ready to run.
pub struct SweepPlan {
    pub(super) scenario: Scenario,
    pub(super) trials: u64,
    pub(super) precision: Option<f64>,
    pub(super) points: Vec<Point>,
    pub(super) methods: Vec<&'static dyn Method>,
    /// True values of [`TRACKED`] at each point.
    pub(super) truth: Vec<[f64; TRACKED.len()]>,
}

impl SweepPlan {
    /// Plans a scenario's sweep with the methods that it names.
    ///
    /// # Errors
    /// [`BenchError`] when there is no sweep in it, or its methods or axes do not exist.
    pub fn new(scenario: &Scenario, options: SweepOptions) -> Result<Self, BenchError> {
        let sweep = scenario.sweep.as_ref().ok_or_else(|| BenchError::NoSweep { scenario: scenario.name.clone() })?;
        let known = || calib::METHODS.iter().map(|method| method.name()).collect();
        let methods = sweep
            .methods
            .iter()
            .map(|name| method(name).ok_or_else(|| BenchError::UnknownMethod { name: name.clone(), known: known() }))
            .collect::<Result<_, _>>()?;
        Self::with_methods(scenario, options, methods)
    }

    /// Plans a scenario's sweep with methods of the caller's own.
    ///
    /// # Errors
    /// As [`Self::new`]; also when a point's robot cannot be simulated.
    pub fn with_methods(
        scenario: &Scenario,
        options: SweepOptions,
        methods: Vec<&'static dyn Method>,
    ) -> Result<Self, BenchError> {
        let mut scenario = scenario.clone();
        let sweep = scenario.sweep.as_ref().ok_or_else(|| BenchError::NoSweep { scenario: scenario.name.clone() })?;
        let trials = match options.precision {
            Some(_) => options.trials.unwrap_or(MAX_FOR_PRECISION),
            None => options.trials.unwrap_or(sweep.trials),
        };
        if trials < 2 {
            return Err(BenchError::TooFewTrials { trials });
        }
        scenario.seed = options.seed.unwrap_or(scenario.seed);
        let points = sweep.points(&scenario, &scenario.name)?;
        let truth = points.iter().map(|point| {
            let robot = Trial::with_programs(&point.scenario, scenario.seed, Vec::new())?;
            Ok(TRACKED.map(|parameter| true_value(&robot, parameter)))
        });
        let truth = truth.collect::<Result<_, BenchError>>()?;
        Ok(Self { scenario, trials, precision: options.precision, points, methods, truth })
    }

    /// Trials over all points; with a precision, at most.
    #[must_use]
    pub fn total_trials(&self) -> u64 {
        self.trials * self.points.len() as u64
    }

    /// The points of the design.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Seed of every draw.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.scenario.seed
    }

    /// Chunks of a point with all its trials.
    pub(super) const fn chunks(&self) -> u64 {
        self.trials.div_ceil(TRIALS_PER_CHUNK)
    }

    /// Trials before a chunk begins.
    pub(super) fn trials_before(&self, chunk: u64) -> u64 {
        (chunk * TRIALS_PER_CHUNK).min(self.trials)
    }

    /// Estimates of one trial: methods times parameters.
    pub(super) const fn estimates(&self) -> usize {
        self.methods.len() * TRACKED.len()
    }

    /// Where a point is first looked at: with a precision, after the fewest trials that tell one; else at its
    /// end.
    pub(super) const fn first_decision(&self) -> u64 {
        let fewest = MIN_FOR_PRECISION / TRIALS_PER_CHUNK;
        if self.precision.is_some() && fewest < self.chunks() { fewest } else { self.chunks() }
    }

    /// The chunk at which a point that has reached its decision is examined again; `None` when it is done.
    /// With a precision it is where the error, falling with the root of the number of trials, will have
    /// reached it, but no more than four times as far. They depend on the trials alone and never on when
    /// somebody looked: the number of trials is part of the result.
    pub(super) fn next_decision(&self, point: usize, sum: &PointSum) -> Option<u64> {
        let done = sum.chunks.next();
        let excess = self.largest_error(point, sum) / self.precision?;
        if excess <= 1.0 || done >= self.chunks() {
            return None;
        }
        // A twentieth more than foretold: the error has an error itself.
        let needed = (done as f64 * (1.05 * excess * excess).min(4.0)).ceil() as u64;
        Some(needed.max(done + 1).min(self.chunks()))
    }

    /// The account of a point all of whose trials are in `sum`.
    pub(super) fn point_result(&self, index: usize, sum: &PointSum) -> Result<PointResult, BenchError> {
        let point = &self.points[index];
        let setup = PointSetup::new(self, index)?;
        let total = sum.chunks.total().unwrap_or_default();
        let mut estimators: Vec<EstimatorResult> = Vec::with_capacity(self.estimates());
        let mut costs = Vec::new();
        for (number, method) in self.methods.iter().enumerate() {
            let programs = setup.programs_of(number);
            let information = match &programs {
                Ok(programs) => FisherInformation::of(&point.scenario, programs).map_err(|why| why.to_string()),
                Err(why) => Err((*why).to_owned()),
            };
            if let Ok(programs) = programs {
                let cost = point.scenario.cost_of(programs);
                let runs = programs.len() as u64;
                costs.push(MethodCost {
                    method: method.name().to_owned(),
                    runs,
                    minutes: cost.minutes,
                    metres: cost.metres,
                });
            }
            for (k, parameter) in TRACKED.into_iter().enumerate() {
                let at = number * TRACKED.len() + k;
                let tally = total.estimates.get(at).copied().unwrap_or_default();
                let bound: Bound = information.as_ref().map_err(Clone::clone).and_then(|information| {
                    // A method that does not see the common scale takes the mean diameter as given.
                    let of = if tally.is_blind() { information.given_mean_diameter() } else { *information };
                    let var = of.bound_var(parameter);
                    var.ok_or_else(|| format!("this protocol does not determine {}", parameter.key()))
                });
                let mut result = estimator_result(
                    method.name(),
                    parameter,
                    self.truth[index][k],
                    &tally,
                    &sum.histograms[at],
                    &bound,
                );
                result.not_applicable = programs.err().map(ToOwned::to_owned);
                estimators.push(result);
            }
        }
        let drift = self.methods.iter().zip(&total.drift).map(|(method, drift)| {
            let (mean, mean_mcse) = drift.bias().unzip();
            let (rms, rms_mcse) = drift.rmse().unzip();
            DriftResult {
                method: method.name().to_owned(),
                mean_percent: mean,
                mean_percent_mcse: mean_mcse,
                rms_percent: rms,
                rms_percent_mcse: rms_mcse,
            }
        });
        Ok(PointResult {
            levels: point.levels.iter().cloned().collect(),
            trials: self.trials_before(sum.chunks.next()),
            precise: self.precision.map(|precision| self.largest_error(index, sum) <= precision),
            costs,
            estimators,
            drift: if setup.validation.is_some() { drift.collect() } else { Vec::new() },
        })
    }

    /// The largest Monte-Carlo error of a point's numbers.
    fn largest_error(&self, point: usize, sum: &PointSum) -> f64 {
        let total = sum.chunks.total().unwrap_or_default();
        let estimates = total.estimates.iter().zip(&sum.histograms).zip(self.truth[point].iter().cycle());
        let errors = estimates.map(|((tally, histogram), truth)| largest_error(tally, histogram, *truth));
        errors.chain(total.drift.iter().map(largest_drift_error)).fold(0.0, f64::max)
    }
}

/// What a chunk of trials gives.
pub(super) struct ChunkOutcome {
    pub(super) sum: ChunkSum,
    /// Every estimate in the order of trial, method, parameter.
    pub(super) outcomes: Vec<Outcome>,
}

/// Methods that estimate from the same runs.
struct Group {
    trial: Trial,
    programs: Vec<MotionProgram>,
    methods: Vec<usize>,
}

impl Group {
    /// Drives trials and calibrates each by every method, side by side where that can be; `take` gets trial,
    /// method and calibration, a method's in the order of trials.
    fn calibrate(
        &mut self,
        plan: &SweepPlan,
        trials: std::ops::Range<u64>,
        mut take: impl FnMut(u64, usize, Option<Calibration>),
    ) -> Result<(), BenchError> {
        for first in trials.clone().step_by(LANES) {
            let block = first..trials.end.min(first + LANES as u64);
            if let Some(replicates) = self.trial.drive_side_by_side(first) {
                for &number in &self.methods {
                    let trials = (block.end - block.start) as usize;
                    let calibrations = plan.methods[number].calibrate_replicates(replicates, trials);
                    for (trial, calibration) in block.clone().zip(calibrations) {
                        take(trial, number, calibration.ok());
                    }
                }
                continue;
            }
            for trial in block {
                let session = [self.trial.drive(trial)?];
                for &number in &self.methods {
                    take(trial, number, plan.methods[number].calibrate(&session).ok());
                }
            }
        }
        Ok(())
    }
}

/// The bench set up for one point: its robot, what is driven, and for whom.
pub(super) struct PointSetup {
    point: usize,
    groups: Vec<Group>,
    /// By method: why it cannot be used here.
    not_applicable: Vec<Option<String>>,
    validation: Option<Validation>,
}

impl PointSetup {
    pub(super) fn new(plan: &SweepPlan, point: usize) -> Result<Self, BenchError> {
        let scenario = &plan.points[point].scenario;
        let mut groups: Vec<Group> = Vec::new();
        let mut not_applicable = vec![None; plan.methods.len()];
        for (number, method) in plan.methods.iter().enumerate() {
            match scenario.programs_for(method.name()) {
                Ok(programs) => match groups.iter_mut().find(|group| group.programs == programs) {
                    Some(group) => group.methods.push(number),
                    None => {
                        let trial = Trial::with_programs(scenario, plan.seed(), programs.clone())?;
                        groups.push(Group { trial: trial.at_point(point as u32), programs, methods: vec![number] });
                    }
                },
                Err(no_fit) => not_applicable[number] = Some(no_fit.to_string()),
            }
        }
        let validation = Validation::new(scenario)?;
        Ok(Self { point, groups, not_applicable, validation })
    }

    fn programs_of(&self, method: usize) -> Result<&[MotionProgram], &str> {
        let group = self.groups.iter().find(|group| group.methods.contains(&method));
        group.map(|group| &group.programs[..]).ok_or_else(|| self.not_applicable[method].as_deref().unwrap_or_default())
    }

    /// Is it the bench of this point?
    pub(super) const fn is_at(&self, point: usize) -> bool {
        self.point == point
    }

    /// Drives one chunk.
    pub(super) fn drive(&mut self, plan: &SweepPlan, chunk: u64) -> Result<ChunkOutcome, BenchError> {
        let (first, last) = (plan.trials_before(chunk), plan.trials_before(chunk + 1));
        let (methods, parameters) = (plan.methods.len(), TRACKED.len());
        let mut sum =
            ChunkSum { estimates: vec![Tally::default(); plan.estimates()], drift: vec![Moments::default(); methods] };
        // Every estimate in the order of trial, method, parameter.
        let mut outcomes = vec![Outcome::of(None, TRACKED[0]); (last - first) as usize * plan.estimates()];
        for group in &mut self.groups {
            group.calibrate(plan, first..last, |trial, number, calibration| {
                let of_trial = (trial - first) as usize * plan.estimates();
                for (k, parameter) in TRACKED.into_iter().enumerate() {
                    outcomes[of_trial + number * parameters + k] = Outcome::of(calibration.as_ref(), parameter);
                }
                if let (Some(validation), Some(calibration)) = (&self.validation, calibration)
                    && calibration.converged
                {
                    sum.drift[number].push(validation.drift_percent(&calibration.geometry));
                }
            })?;
        }
        for of_trial in outcomes.chunks(plan.estimates().max(1)) {
            for (k, (tally, outcome)) in sum.estimates.iter_mut().zip(of_trial).enumerate() {
                tally.take(*outcome, plan.truth[self.point][k % parameters]);
            }
        }
        Ok(ChunkOutcome { sum, outcomes })
    }
}

fn true_value(trial: &Trial, parameter: Parameter) -> f64 {
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use motion_programs::Schedule;

    use super::*;

    /// Draws that come twice, in another trial, chunk or point, make trials look like more than they are.
    #[test]
    fn no_trial_of_a_sweep_has_the_draws_of_another() {
        // Marks are read to the last digit, so that no two trials give the same estimates by chance. What
        // points differ in changes nothing where motors follow exactly.
        let text = scenario::PAPER
            .replace("resolution_m = 0.001", "resolution_m = 0.0")
            .replace(
                "\"noise.wheel_sigma_m_per_sqrt_m\" = [0.0, 0.0005, 0.001]",
                "\"robot.motor.supply_v\" = [24.0, 25.0, 26.0]",
            )
            .replace("\"instrument.floor_grid.reading_sigma_m\" = [0.0, 0.0005, 0.001, 0.002]", "");
        let mut paper = Scenario::parse(&text, "paper.toml").expect("a scenario");
        paper.protocols =
            vec![Schedule::Straights { length_m: 0.5, runs: 4 }, Schedule::Spins { turn_rad: 6.0, runs: 4 }];
        let sweep = paper.sweep.as_mut().expect("the paper sweeps");
        sweep.methods = vec!["direct".to_owned()];
        let plan =
            SweepPlan::new(&paper, SweepOptions { trials: Some(64), ..SweepOptions::default() }).expect("a plan");
        assert_eq!((plan.points.len(), plan.chunks()), (3, 4));
        let mut seen = BTreeSet::new();
        let mut trials = 0;
        for point in 0..plan.points.len() {
            let mut setup = PointSetup::new(&plan, point).expect("a setup");
            for chunk in 0..plan.chunks() {
                let found = setup.drive(&plan, chunk).expect("driven");
                for outcomes in found.outcomes.chunks(plan.estimates()) {
                    seen.insert(outcomes.iter().map(|outcome| outcome.value.to_bits()).collect::<Vec<_>>());
                    trials += 1;
                }
            }
        }
        assert_eq!((trials, seen.len()), (64 * plan.points.len(), trials));
    }
}
