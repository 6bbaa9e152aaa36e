//! What a header leaves of the drift: dead reckoning of a dataset by the nominal values, by what runs on
//! board, and by the whole model with rows on both sides.

use std::path::Path;

use ::export::{CalibratedRobot, LogStart, Options};
use calib::{CalibrationDrift, EvaluationOptions, RunDrift, evaluate_path, evaluate_runs};
use dataset::{Dataset, Loaded, Session};
use serde::Serialize;

use crate::calibration_file::GivenCalibration;
use crate::terminal::{Failure, Terminal};

/// Drift, per cent of the distance driven; null where it is not known.
#[derive(Serialize)]
pub(crate) struct Drift {
    nominal: Option<f64>,
    /// By the header.
    on_board: Option<f64>,
    /// By the header where the robot is told nothing beside its counts; null where no effect needs it.
    on_board_untold: Option<f64>,
    /// By the whole model, with rows on both sides.
    offline: Option<f64>,
    /// Why something is null.
    #[serde(skip_serializing_if = "Option::is_none")]
    why_null: Option<String>,
}

impl Drift {
    const fn unknown(why: String) -> Self {
        Self { nominal: None, on_board: None, on_board_untold: None, offline: None, why_null: Some(why) }
    }

    /// One line for people.
    pub(crate) fn text(&self) -> String {
        let why = self.why_null.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        if self.nominal.or(self.on_board).is_none() {
            return format!("drift: not known{why}");
        }
        let percent = |of: Option<f64>| of.map_or_else(|| "not known".to_owned(), |of| format!("{of:.3} %"));
        let untold = self.on_board_untold.map_or_else(String::new, |of| format!(" ({of:.3} % when told nothing)"));
        format!(
            "drift: nominal {}, on board {}{untold}, offline {}{why}",
            percent(self.nominal),
            percent(self.on_board),
            percent(self.offline)
        )
    }
}

/// The drift of a dataset's runs by a robot of a calibration file; without a dataset it says that it needs
/// one.
pub(crate) fn of(
    robot: &CalibratedRobot,
    source: &Path,
    dataset: Option<&Path>,
    options: &Options,
    terminal: &Terminal,
) -> Result<Drift, Failure> {
    match dataset {
        None => Ok(Drift::unknown("it needs a dataset with absolute truth; give --dataset DIR".to_owned())),
        Some(path) => of_dataset(robot, source, path, options, terminal),
    }
}

fn of_dataset(
    robot: &CalibratedRobot,
    source: &Path,
    path: &Path,
    options: &Options,
    terminal: &Terminal,
) -> Result<Drift, Failure> {
    let place = path.display().to_string();
    let given = GivenCalibration::read(source)?;
    let Some(given) = given.into_iter().find(|given| given.calibration().calibration.name == robot.name) else {
        return Ok(Drift::unknown(format!("{}: it has no calibration {}", source.display(), robot.name)));
    };
    let Loaded { dataset, .. } = dataset::read(path)?;
    given.check(&dataset.robot, &place)?;
    let records = given.undone(&dataset, &place, terminal)?;
    let (raw, records) = (dataset.session(), records.session());
    let options_of = EvaluationOptions::default();
    let nominal = evaluate_runs(&raw, None, &options_of, &mut 0.0);
    let offline = evaluate_runs(&records, Some(given.calibration()), &options_of, &mut 0.0);
    let on_board = |is_logged: bool| on_board(robot, &given, &dataset, &records, options, is_logged);
    let summary = |runs| CalibrationDrift::of_runs(None, runs);
    let logged = summary(on_board(true)?);
    let untold = robot.needs_inputs().then(|| on_board(false)).transpose()?.map(summary);
    Ok(Drift {
        nominal: summary(nominal).drift_percent,
        on_board: logged.drift_percent,
        on_board_untold: untold.and_then(|untold| untold.drift_percent),
        offline: summary(offline).drift_percent,
        why_null: logged.why_null,
    })
}

/// The runs by what runs on board, from the raw records; measured as the whole model measures them.
fn on_board(
    robot: &CalibratedRobot,
    given: &GivenCalibration,
    dataset: &Dataset,
    records: &Session<'_>,
    options: &Options,
    is_logged: bool,
) -> Result<Vec<RunDrift>, Failure> {
    let mut driven_m = 0.0;
    let mut all = Vec::with_capacity(records.runs.len());
    for (run, raw) in records.runs.iter().zip(&dataset.runs) {
        let mut failed = None;
        let options_of = EvaluationOptions::default();
        let drift = evaluate_path(
            records,
            run,
            given.calibration(),
            &options_of,
            &mut driven_m,
            |world_from_body, session_m| {
                let start = LogStart { world_from_body, session_m, is_logged };
                let path = robot.on_board_path(raw, options.counter_bits, &start);
                let mut path = path.unwrap_or_else(|error| {
                    failed = Some(error);
                    None
                })?;
                // Where the times of the log were corrected, the path has the corrected ones.
                let t_s = &run.odometry().t_s;
                if t_s.len() == path.len() {
                    path.iter_mut().zip(t_s).for_each(|((at_s, _), t_s)| *at_s = *t_s);
                }
                Some(path)
            },
        );
        if let Some(error) = failed {
            return Err(error.into());
        }
        all.push(drift);
    }
    Ok(all)
}
