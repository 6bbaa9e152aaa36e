//! From errors of parameters to drift: the scenario's validation path, driven on paper by the true robot and reckoned with a calibration.

use dataset::{Motion, MotionProgram, Schedule};
use kinematics::{DriveGeometry, GeometryError, Increment, Pose, Wheels};
use scenario::Scenario;

/// One run: how far the wheels turn motion by motion, and where the true robot ends.
struct Drive {
    wheel_rad: Vec<Wheels<f64>>,
    true_end: Pose,
}

/// The validation path of a scenario.
pub(super) struct Validation {
    runs: Vec<Drive>,
    length_m: f64,
}

impl Validation {
    /// The path that `[[sweep.validation]]` states; `None` when it states none.
    pub(super) fn new(scenario: &Scenario) -> Result<Option<Self>, GeometryError> {
        let schedules = scenario.sweep.as_ref().map_or(&[][..], |sweep| &sweep.validation[..]);
        let (nominal, truth) = (scenario.nominal_geometry()?, scenario.true_geometry()?);
        let programs: Vec<MotionProgram> = schedules.iter().flat_map(Schedule::programs).collect();
        let mut length_m = 0.0;
        let runs = programs.iter().map(|program| {
            let mut wheel_rad = Vec::with_capacity(program.motions.len());
            for motion in &program.motions {
                let increment = match *motion {
                    Motion::Straight { length_m } => Increment { distance_m: length_m, turn_rad: 0.0 },
                    Motion::Spin { turn_rad } => Increment { distance_m: 0.0, turn_rad },
                    Motion::Arc { radius_m, turn_rad } => Increment { distance_m: radius_m * turn_rad.abs(), turn_rad },
                    Motion::Pause { .. } | Motion::Measure => continue,
                };
                wheel_rad.push(nominal.travel_m(increment).zip_with(nominal.m_per_rad(), |m, m_per_rad| m / m_per_rad));
            }
            let true_end = reckon(&wheel_rad, &truth);
            length_m += wheel_rad.iter().map(|rad| truth.increment(travel(*rad, &truth)).distance_m.abs()).sum::<f64>();
            Drive { wheel_rad, true_end }
        });
        let runs: Vec<Drive> = runs.collect();
        Ok((!runs.is_empty()).then_some(Self { runs, length_m }))
    }

    /// Final position errors over the path's length, per cent, of odometry that believes `geometry` and counts perfectly.
    pub(super) fn drift_percent(&self, geometry: &DriveGeometry) -> f64 {
        let error_m = |run: &Drive| reckon(&run.wheel_rad, geometry).position().distance_m(run.true_end.position());
        100.0 * self.runs.iter().map(error_m).sum::<f64>() / self.length_m
    }
}

fn travel(wheel_rad: Wheels<f64>, geometry: &DriveGeometry) -> Wheels<f64> {
    wheel_rad.zip_with(geometry.m_per_rad(), |rad, m_per_rad| rad * m_per_rad)
}

/// The end of a drive from the origin.
fn reckon(wheel_rad: &[Wheels<f64>], geometry: &DriveGeometry) -> Pose {
    wheel_rad.iter().fold(Pose::IDENTITY, |pose, rad| pose * geometry.increment(travel(*rad, geometry)).arc())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_error_drifts_by_itself_on_a_straight_and_not_at_all_on_a_square() {
        let mut scenario =
            Scenario::parse(include_str!("../../../../scenarios/paper.toml"), "paper.toml").expect("shipped");
        let with = |scenario: &mut Scenario, path: Schedule| {
            scenario.sweep.as_mut().expect("the paper sweeps").validation = vec![path];
            Validation::new(scenario).expect("valid").expect("there is a path")
        };
        let truth = scenario.true_geometry().expect("valid");
        // Wheels and wheelbase larger by 1 %: the same turns, 1 % more way.
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
