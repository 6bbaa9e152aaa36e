//! A calibration method of one's own, benched against `joint`.
//!
//! ```sh
//! cargo run --release --example my_method
//! ```
//!
//! The method takes straights and whole turns apart, as one does with a tape measure and a protractor: the
//! straights give the scale common to both wheels, the turns their separation. It takes both wheels to be
//! alike. The bench drives a simulated robot many times and says how far each method misses the truth, which
//! no method can see.

use std::error::Error;
use std::io::Write;

use yair::bench::{SweepOptions, SweepPlan, SweepResult};
use yair::calib::{
    self, CalibError, Calibration, EvaluationOptions, Method, NotObservable, Parameter, evaluate_runs_and_paths,
};
use yair::dataset::{Protocol, Session};
use yair::kinematics::{DriveGeometry, Pose, wrap_to_pi};
use yair::motion_programs::Schedule;
use yair::scenario::Scenario;

/// Tape measure and protractor.
struct Tape;

const NAME: &str = "tape";

impl Tape {
    fn not_applicable(why: &str) -> CalibError {
        CalibError::NotApplicable { method: NAME, why: why.to_owned() }
    }
}

impl Method for Tape {
    fn name(&self) -> &'static str {
        NAME
    }

    fn about(&self) -> &'static str {
        "lengths of straights and angles of turns, wheels taken to be alike"
    }

    fn protocol(&self) -> Vec<Schedule> {
        // What the bench drives for this method where a scenario does not say.
        vec![
            Schedule::Straights { length_m: 1.5, runs: 6 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 6 },
        ]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let robot = sessions.first().ok_or_else(|| Self::not_applicable("there is no session"))?.robot;
        let nominal = robot.geometry().map_err(|source| CalibError::NotADrive { method: NAME, source })?;
        let (mut counted_m, mut driven_m, mut counted_rad, mut turned_rad) = (0.0, 0.0, 0.0, 0.0);
        let mut runs_used = 0;
        let options = EvaluationOptions::default();
        let paths = |session| evaluate_runs_and_paths(session, None, &options, &mut 0.0);
        for (run, (_, path)) in sessions.iter().flat_map(|session| session.runs.iter().zip(paths(session))) {
            // Where the instrument saw the robot, and where the counts have it at the same instants.
            let Some(path) = path else { continue };
            let both = |(seen, counted): (&Pose, &Option<Pose>)| Some((*seen, (*counted)?));
            let mut pairs = path.measured.iter().zip(&path.at_measured).filter_map(both);
            let Some((first, last)) = pairs.next().and_then(|first| Some((first, pairs.next_back()?))) else {
                continue;
            };
            let length_m = |from: Pose, to: Pose| from.position().distance_m(to.position());
            match run.info().protocol {
                Some(Protocol::Straight) => {
                    counted_m += length_m(first.1, last.1);
                    driven_m += length_m(first.0, last.0);
                }
                Some(Protocol::Spin) => {
                    let turn_rad = last.1.theta_rad - first.1.theta_rad;
                    // A measured heading is known up to whole turns: the counts say how many.
                    let beyond_rad = wrap_to_pi(last.0.theta_rad - first.0.theta_rad - turn_rad);
                    counted_rad += turn_rad.abs();
                    turned_rad += (turn_rad + beyond_rad).abs();
                }
                _ => continue,
            }
            runs_used += 1;
        }
        if counted_m <= 0.0 || counted_rad <= 0.0 {
            return Err(Self::not_applicable("it needs straights and spins with the pose measured at both ends"));
        }
        let scale = driven_m / counted_m;
        let diameter_m = nominal.wheel_diameter_m().map(|nominal_m| nominal_m * scale);
        let separation_m = nominal.wheel_separation_m() * scale * counted_rad / turned_rad;
        let geometry = DriveGeometry::new(diameter_m, separation_m)
            .map_err(|source| CalibError::NotADrive { method: NAME, source })?;
        Ok(Calibration {
            runs_used,
            // What a method cannot see it says.
            not_observable: [Parameter::LeftWheelDiameter, Parameter::RightWheelDiameter]
                .map(|parameter| NotObservable { parameter, why: "both wheels are taken to be alike".into() })
                .to_vec(),
            ..Calibration::new(NAME, geometry, robot.ticks_per_rev)
        })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = &mut std::io::stdout();
    for point in bench(100)?.points {
        for row in point.estimators {
            let percent = |value: Option<f64>| value.map_or(f64::NAN, |value| 100.0 * value / row.truth);
            let (bias, rmse) = (percent(row.bias), percent(row.rmse));
            writeln!(out, "{:6} {:24} bias {bias:8.4} %   RMSE {rmse:7.4} %", row.method, row.parameter)?;
        }
    }
    Ok(())
}

/// Both methods over some trials.
pub(crate) fn bench(trials: u64) -> Result<SweepResult, Box<dyn Error>> {
    let mut scenario = Scenario::parse(include_str!("../scenarios/joint-efficiency.toml"), "joint-efficiency.toml")?;
    // Its second case has outliers, which are not the question here.
    if let Some(sweep) = &mut scenario.sweep {
        sweep.cases.truncate(1);
    }
    let joint = calib::method("joint").ok_or("no such method")?;
    let options = SweepOptions { trials: Some(trials), ..SweepOptions::default() };
    // The result is the same on any number of threads (0: one a core).
    Ok(SweepPlan::with_methods(&scenario, options, vec![joint, &Tape])?.run(0, &|_| ())?)
}
