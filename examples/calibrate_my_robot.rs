//! Calibrates a robot from its log and says how far it drifts in a session that the calibration has not seen.
//!
//! ```sh
//! cargo run --example calibrate_my_robot -- MONDAY TUESDAY
//! ```
//!
//! Both are datasets (docs/dataset.md), folders as `yair import` writes them. Without them a simulated robot
//! drives two sessions, and its table comes out.

use std::error::Error;
use std::io::Write;
use std::path::Path;

use yair::calib::{self, CalibrationReport, MethodReport, Names};
use yair::dataset::{self, Dataset};
use yair::export::{CalibratedRobot, Options, format::exporter};
use yair::preflight;
use yair::scenario::Scenario;
use yair::sim_yair::simulate;

fn main() -> Result<(), Box<dyn Error>> {
    let folders: Vec<String> = std::env::args().skip(1).collect();
    let [monday, tuesday] = match &folders[..] {
        [] => simulated()?,
        [monday, tuesday] => [read(monday)?, read(tuesday)?],
        _ => return Err("give two datasets: the first is calibrated, the second is new to it".into()),
    };
    calibrate(&monday, &tuesday, &mut std::io::stdout())
}

fn read(folder: &str) -> Result<Dataset, Box<dyn Error>> {
    Ok(dataset::read(Path::new(folder))?.dataset)
}

/// Two sessions of the tutorial's robot. A scenario holds all that its numbers depend on beside the seed and
/// the number of the trial.
pub(crate) fn simulated() -> Result<[Dataset; 2], Box<dyn Error>> {
    let scenario = Scenario::parse(include_str!("../scenarios/drifting.toml"), "drifting.toml")?;
    let session = |trial| simulate(&scenario, scenario.seed, trial).map(|driven| driven.dataset);
    Ok([session(0)?, session(1)?])
}

/// Checks and calibrates `monday`, evaluates both on `tuesday`, and writes it all to `out`.
pub(crate) fn calibrate(monday: &Dataset, tuesday: &Dataset, out: &mut impl Write) -> Result<(), Box<dyn Error>> {
    // A log that is wrong gives a calibration that is wrong, with small error bars.
    for problem in preflight::check(std::slice::from_ref(monday)).problems {
        writeln!(out, "{:?}: {}", problem.severity, problem.sentence)?;
    }

    // Any of `calib::METHODS`; "joint" is maximum likelihood over whole runs.
    let joint = calib::method("joint").ok_or("no such method")?;
    let found = joint.calibrate(&[monday.session()])?;
    for estimate in found.estimates() {
        // SI units: metres, seconds, radians; sigma is one standard deviation.
        let sigma = estimate.sigma.map_or_else(|| "not known".to_owned(), |sigma| format!("{sigma:.2e}"));
        writeln!(out, "{:24} {:.7} ± {sigma}", estimate.parameter.key(), estimate.value)?;
    }
    for blind in &found.not_observable {
        writeln!(out, "{} is not determined: {}", blind.parameter.key(), blind.why)?;
    }

    // As a report it can be written (`to_toml`), read, evaluated and exported.
    let method = MethodReport::new(joint.name(), &Ok(found), &monday.robot);
    let report =
        CalibrationReport { dataset: Names::One("monday".to_owned()), methods: vec![method], trained_on: Vec::new() };
    let calibration = report.calibrations().into_iter().next().ok_or("nothing was calibrated")?;
    for calibration in [None, Some(&calibration)] {
        let drift = calib::evaluate(&[tuesday.session()], calibration, false);
        let percent = drift.drift_percent.ok_or("the new session has no truth to compare with")?;
        writeln!(out, "drift of {} in the new session: {percent:.2} % of the distance", drift.name)?;
    }

    let robot = CalibratedRobot::of_method("this program", &report.methods[0], Some(&monday.robot))?;
    let yaml = exporter("ros2-yaml").ok_or("no such format")?;
    writeln!(out, "{}", (yaml.render)(&robot, &Options::default())?)?;
    Ok(())
}
