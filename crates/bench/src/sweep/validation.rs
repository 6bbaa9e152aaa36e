//! From a calibration to drift: the scenario's validation path, driven by the robot as it is, without random
//! effects, and dead-reckoned with the calibration.
//!
//! Systematic effects act on the path as they acted on the protocols, so that a calibration is judged by what
//! odometry is for; noise, scatter, faults of the records and the instrument's errors are left out, since
//! they are not the calibration's.

use dataset::Dataset;
use effects::{Address, Hypothesis};
use kinematics::{DriveGeometry, Pose, Rule};
use motion_programs::{MotionProgram, Schedule};
use scenario::{Log, Noise, Placement, Scenario};
use sim_yair::{SimulationError, simulate_programs};

/// Rows this far apart mix the end of a straight with the start of a turn over millimetres only.
const LARGEST_INTERVAL_S: f64 = 0.02;

/// The validation path of a scenario.
pub(super) struct Validation {
    dataset: Dataset,
    /// Each run's motion from start to end.
    true_motion: Vec<Pose>,
    length_m: f64,
}

impl Validation {
    /// The path that `[[sweep.validation]]` states; `None` when it states none.
    pub(super) fn new(scenario: &Scenario) -> Result<Option<Self>, SimulationError> {
        let schedules = scenario.sweep.as_ref().map_or(&[][..], |sweep| &sweep.validation[..]);
        let programs: Vec<MotionProgram> = schedules.iter().flat_map(Schedule::programs).collect();
        if programs.is_empty() {
            return Ok(None);
        }
        let mut certain = scenario.clone();
        certain.noise = Noise { wheel_sigma_m_per_sqrt_m: 0.0, sensitivity_sigma: 0.0 };
        certain.placement = Placement { half_width_m: 0.0, half_width_rad: 0.0 };
        let interval_s = scenario.log.map_or(LARGEST_INTERVAL_S, |log| log.interval_s.min(LARGEST_INTERVAL_S));
        certain.log = Some(Log { interval_s });
        certain.instruments = Vec::new();
        certain
            .effects
            .retain(|effect| matches!(effect.hypothesis(), Some(Hypothesis::Geometry | Hypothesis::Terms(_))));
        let driven =
            simulate_programs(&certain, &programs, Address { seed: scenario.seed, point: 0, trial: 0, run: 0 })?;
        let true_motion = driven
            .truth
            .runs
            .iter()
            .map(|run| {
                let start = Pose::new(run.start_x_m, run.start_y_m, run.start_theta_rad);
                start.inverse() * Pose::new(run.end_x_m, run.end_y_m, run.end_theta_rad)
            })
            .collect();
        let mut validation = Self { dataset: driven.dataset, true_motion, length_m: 0.0 };
        validation.length_m = validation.dead_reckon(&scenario.true_geometry()?).map(|(_, length_m)| length_m).sum();
        Ok(Some(validation))
    }

    /// Final position errors over the path's length, per cent, of odometry that believes `geometry`.
    pub(super) fn drift_percent(&self, geometry: &DriveGeometry) -> f64 {
        let errors = self.dead_reckon(geometry).zip(&self.true_motion);
        100.0 * errors.map(|((end, _), truth)| end.position().distance_m(truth.position())).sum::<f64>() / self.length_m
    }

    /// Each run's end, from the origin, and its length, metres.
    fn dead_reckon(&self, geometry: &DriveGeometry) -> impl Iterator<Item = (Pose, f64)> {
        let session = self.dataset.session();
        let ends: Vec<(Pose, f64)> = session
            .runs
            .iter()
            .map(|run| {
                let (mut last, mut length_m) = (Pose::IDENTITY, 0.0);
                run.dead_reckon(session.robot, geometry, Rule::ExactArc, Pose::IDENTITY, |_, pose| {
                    length_m += pose.position().distance_m(last.position());
                    last = pose;
                });
                (last, length_m)
            })
            .collect();
        ends.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_error_drifts_by_itself_on_a_straight_and_not_at_all_on_a_square() {
        let mut scenario = Scenario::parse(scenario::PAPER, "paper.toml").expect("shipped");
        let with = |scenario: &mut Scenario, path: Schedule| {
            scenario.sweep.as_mut().expect("the paper sweeps").validation = vec![path];
            Validation::new(scenario).expect("valid").expect("there is a path")
        };
        let truth = scenario.true_geometry().expect("valid");
        // Wheels and wheelbase larger by 1 %: the same turns, 1 % more distance.
        let scaled = DriveGeometry::new(truth.wheel_diameter_m().map(|d| 1.01 * d), 1.01 * truth.wheel_separation_m())
            .expect("valid");
        let straight = with(&mut scenario, Schedule::Straights { length_m: 2.0, runs: 1 });
        // The true robot's path bends by 0.3° a metre: chord against arc is 1e-5 of it.
        assert!((straight.drift_percent(&scaled) - 1.0).abs() < 1e-4, "{}", straight.drift_percent(&scaled));
        assert!(straight.drift_percent(&truth) < 1e-12);
        let square = with(&mut scenario, Schedule::Squares { side_m: 2.0, runs_each_way: 1 });
        assert!(square.drift_percent(&scaled) < 0.1, "{}", square.drift_percent(&scaled));
    }
}
