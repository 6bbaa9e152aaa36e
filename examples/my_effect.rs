//! An effect of one's own, fitted beside the calibration without a change to this workspace.
//!
//! ```sh
//! cargo run --example my_effect
//! ```
//!
//! The robot pulls a cable from a drum. The cable pulls back, off the middle: the longer it is, the more each
//! metre turns the robot. No catalogue has that. What an estimator needs of an effect is a [`ModelTerm`]: how
//! much the motion of an interval changes with its parameter, by what was recorded. From there on the fit
//! gives its size, its standard deviation, and whether new runs drift less with it.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::Write;

use yair::calib::{AugmentedCalibration, EvaluationOptions, NamedCalibration, Parameter, evaluate_runs};
use yair::dataset::Dataset;
use yair::effects::{Channel, Effect, SparseTerm, description};
use yair::estimation::{FitSettings, ModelFit, total};
use yair::kinematics::{DriveGeometry, Pose};
use yair::model_term::{Interval, ModelTerm, TermParameter};
use yair::scenario::Scenario;
use yair::sim_yair::simulate;

/// The cable's pull. Its length is taken to grow with the time of the run.
#[derive(Clone)]
struct Cable;

impl ModelTerm for Cable {
    fn parameters(&self) -> &[TermParameter] {
        // A pull of 1 mrad for each metre and second would be large.
        &[TermParameter { name: "pull_rad_m_s", unit: "rad/(m·s)", prior_sigma: 1e-3 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        // Derivative of the interval's motion by the parameter: x ahead, y to the left, θ counter-clockwise.
        // One of several parameters fills several; one with a state keeps it in `self` and forgets it in
        // `restart`; one that is in what the instrument sees implements `measurement`.
        let middle_s = interval.t_s + 0.5 * interval.dt_s;
        gradient[0] = Pose::new(0.0, 0.0, interval.increment().distance_m * middle_s);
    }
}

/// The size that is hidden, rad/(m·s).
pub(crate) const HIDDEN: f64 = 5e-4;

/// What the example finds.
pub(crate) struct Found {
    pub(crate) pull_rad_m_s: f64,
    pub(crate) sigma_rad_m_s: f64,
    /// Log likelihood with the effect over that without.
    pub(crate) log_likelihood_gain: f64,
    /// In a new session, per cent of the distance: calibrated without the effect, and with it.
    pub(crate) drift_percent: [f64; 2],
}

fn main() -> Result<(), Box<dyn Error>> {
    let found = find()?;
    let out = &mut std::io::stdout();
    writeln!(out, "pull: {:.2e} ± {:.1e} rad/(m·s); hidden was {HIDDEN:.2e}", found.pull_rad_m_s, found.sigma_rad_m_s)?;
    writeln!(out, "log likelihood gained: {:.1}", found.log_likelihood_gain)?;
    let [without, with] = found.drift_percent;
    writeln!(out, "drift in a new session: {without:.3} % calibrated, {with:.3} % with the cable")?;
    Ok(())
}

/// Simulates the robot, fits it without and with the effect, and tries both on a new session.
pub(crate) fn find() -> Result<Found, Box<dyn Error>> {
    let [fitted, new] = sessions()?;
    // Without the effect: the two wheels and their separation.
    let base = FitSettings::GEOMETRY_ONLY.fit(&[fitted.session()])?;
    // With it: the same measurements, one parameter more.
    let mut terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Cable)];
    let extended = base.extended(&mut terms)?;
    // Parameters of terms are the last rows, in the order of the terms.
    let covariance = extended.covariance(&mut terms).ok_or("the runs do not determine the effect")?;
    let last = covariance.nrows() - 1;
    let cost = |fit: &ModelFit<'_>| total(&fit.solution.pass.runs).map(|sum| sum.cost());
    let (before, after) = (cost(&base).ok_or("no runs")?, cost(&extended).ok_or("no runs")?);

    let drift_percent = |fit: &ModelFit<'_>, terms: Vec<Box<dyn ModelTerm>>| {
        let model = &fit.solution.model;
        let geometry = DriveGeometry::new(model.m_per_rad.map(|m_per_rad| 2.0 * m_per_rad), model.separation_m)?;
        let values = [
            (Parameter::LeftWheelDiameter, geometry.wheel_diameter_m().left),
            (Parameter::RightWheelDiameter, geometry.wheel_diameter_m().right),
            (Parameter::WheelSeparation, geometry.wheel_separation_m()),
        ];
        let values = values.map(|(parameter, value)| (parameter.key().to_owned(), value)).into();
        let calibration = NamedCalibration::new("mine".to_owned(), values);
        let augmented = AugmentedCalibration { calibration, terms, term_values: model.term_values.clone() };
        let runs = evaluate_runs(&new.session(), Some(&augmented), &EvaluationOptions::default(), &mut 0.0);
        let missed_m: f64 = runs.iter().filter_map(|run| run.final_position_m).sum();
        let driven_m: f64 = runs.iter().map(|run| run.length_m).sum();
        Ok::<f64, Box<dyn Error>>(100.0 * missed_m / driven_m)
    };
    Ok(Found {
        pull_rad_m_s: extended.solution.model.term_values[0],
        sigma_rad_m_s: covariance[(last, last)].sqrt(),
        log_likelihood_gain: before - after,
        drift_percent: [drift_percent(&base, Vec::new())?, drift_percent(&extended, terms.clone())?],
    })
}

/// Two sessions of a robot with the effect. The simulator takes any product of covariates as a term; your own
/// robot brings its effect along.
fn sessions() -> Result<[Dataset; 2], Box<dyn Error>> {
    let mut robot = Scenario::parse(include_str!("../scenarios/drifting.toml"), "drifting.toml")?;
    // Only what the calibration itself mends stays: the wheels' and the separation's ratios.
    robot.effects.retain(|effect| description(effect.id()).is_some_and(|of| of.geometry.is_some()));
    robot.effects.push(Effect::Term(SparseTerm {
        channel: Channel::Yaw,
        covariates: vec!["v".to_owned(), "time in run".to_owned()],
        // Its time in run is in minutes.
        coefficient: 60.0 * HIDDEN,
        of_runs: BTreeMap::new(),
    }));
    let session = |trial| simulate(&robot, robot.seed, trial).map(|driven| driven.dataset);
    Ok([session(0)?, session(1)?])
}
