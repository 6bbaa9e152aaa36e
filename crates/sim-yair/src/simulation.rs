//! A whole scenario simulated: the dataset that a robot would have brought home, and the truth that it hides.

use dataset::{Dataset, Provenance, Run};
use effects::{Address, Effect};
use kinematics::Pose;
use motion_programs::{MotionProgram, Platform};
use scenario::Scenario;
use serde::Serialize;

use crate::robot::{SimulatedRobot, SimulationError};

/// What a simulation gives: what was measured, and apart from it what no estimator may see.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// What was measured. Nothing in it says what was hidden.
    pub dataset: Dataset,
    /// What was hidden.
    pub truth: HiddenTruth,
}

/// The truth behind a simulated dataset, kept apart from it. Diameters and separation are means over what
/// varies with motion; effects have their sizes as the scenario has them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HiddenTruth {
    /// The scenario's name.
    pub scenario: String,
    /// Seed of the draws.
    pub seed: u64,
    /// Point of the sweep's design, counted from 0; 0 outside of sweeps.
    pub point: u32,
    /// Trial of the draws.
    pub trial: u64,
    /// Mean effective diameter of the left wheel, metres.
    pub left_wheel_diameter_m: f64,
    /// Mean effective diameter of the right wheel, metres.
    pub right_wheel_diameter_m: f64,
    /// Mean effective distance between the wheel contacts, metres.
    pub wheel_separation_m: f64,
    /// Every effect with its sizes.
    pub effects: Vec<Effect>,
    /// Where each run really began and ended.
    pub runs: Vec<TrueRun>,
}

/// Where a run really began and ended, the drive's centre in the room.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrueRun {
    /// The run's id.
    pub run: String,
    /// Start: x, y in metres.
    pub start_x_m: f64,
    /// Start: y in metres.
    pub start_y_m: f64,
    /// Start: heading in radians.
    pub start_theta_rad: f64,
    /// End: x in metres.
    pub end_x_m: f64,
    /// End: y in metres.
    pub end_y_m: f64,
    /// End: heading in radians, whole turns counted from the start.
    pub end_theta_rad: f64,
}

impl TrueRun {
    fn new(run: &str, start: Pose, end: Pose) -> Self {
        Self {
            run: run.to_owned(),
            start_x_m: start.x_m,
            start_y_m: start.y_m,
            start_theta_rad: start.theta_rad,
            end_x_m: end.x_m,
            end_y_m: end.y_m,
            end_theta_rad: end.theta_rad,
        }
    }
}

/// Drives a scenario's protocols once. The result is a function of its arguments: equal seeds and trials give
/// equal bits on any machine, other trials of a seed are independent of each other.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated: the closed form is asked for where an effect is
/// not exact in it, or the controllers cannot reach the commanded speed.
pub fn simulate(scenario: &Scenario, seed: u64, trial: u64) -> Result<Simulation, SimulationError> {
    simulate_programs(scenario, &scenario.programs(), Address { seed, point: 0, trial, run: 0 })
}

/// Drives programs with a scenario's robot, its draws at `first_run` and the runs that follow: one trial of a
/// sweep, as the sweep had it.
///
/// # Errors
/// [`SimulationError`] when the scenario cannot be simulated.
pub fn simulate_programs(
    scenario: &Scenario,
    programs: &[MotionProgram],
    first_run: Address,
) -> Result<Simulation, SimulationError> {
    let Address { seed, point, trial, .. } = first_run;
    let mut robot = SimulatedRobot::new(scenario, seed, trial)?.at_point(point);
    let (mut runs, mut true_runs) = (Vec::with_capacity(programs.len()), Vec::with_capacity(programs.len()));
    for program in programs {
        let mut run = Run::default();
        robot.drive_into(program, &mut run)?;
        true_runs.push({
            let (start, end) = robot.last_true_ends();
            TrueRun::new(&program.id, start, end)
        });
        runs.push(run);
    }
    let geometry = robot.true_geometry();
    Ok(Simulation {
        dataset: Dataset {
            provenance: Provenance::default(),
            robot: robot.robot(),
            truth_noise: robot.truth_noise(),
            points: robot.points().to_vec(),
            runs,
        },
        truth: HiddenTruth {
            scenario: scenario.name.clone(),
            seed,
            point,
            trial,
            left_wheel_diameter_m: geometry.wheel_diameter_m().left,
            right_wheel_diameter_m: geometry.wheel_diameter_m().right,
            wheel_separation_m: geometry.wheel_separation_m(),
            effects: scenario.effects.clone(),
            runs: true_runs,
        },
    })
}
