//! What `--calibration FILE` takes: a calibration file, or a scenario with effects such as the extended model
//! of a diagnosis.

use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

use ::diagnose::ExtendedModel;
use calib::{AugmentedCalibration, CalibrationReport, OdometryNoise, ReportError, TrainedOn};
use dataset::{Dataset, NominalRobot, Run};
use scenario::{LARGEST_FILE_BYTES, Scenario};

use crate::terminal::{Failure, Terminal};

/// A calibration with the file that it is from.
pub(crate) struct GivenCalibration {
    place: String,
    given: Given,
    noise: Option<OdometryNoise>,
    trained_on: Vec<TrainedOn>,
}

enum Given {
    Values(AugmentedCalibration),
    Model(ExtendedModel),
}

impl GivenCalibration {
    /// The calibrations of a file.
    pub(crate) fn read(path: &Path) -> Result<Vec<Self>, Failure> {
        let place = path.display().to_string();
        let of = |given, noise, trained_on: &[TrainedOn]| Self {
            place: place.clone(),
            given,
            noise,
            trained_on: trained_on.to_vec(),
        };
        if is_scenario(path)? {
            let scenario = Scenario::read(path)?;
            let model = ExtendedModel::of(&scenario).map_err(|error| format!("{place}: {error}"))?;
            let noise = OdometryNoise {
                wheel_sigma_m_per_sqrt_m: scenario.noise.wheel_sigma_m_per_sqrt_m,
                turn_sigma_rad_per_sqrt_rad: 0.0,
                is_assumed: false,
            };
            return Ok(vec![of(Given::Model(model), Some(noise), &[])]);
        }
        let report = CalibrationReport::read(path)?;
        let calibrations = report.calibrations();
        if calibrations.is_empty() {
            let message = "it holds no values".to_owned();
            return Err(ReportError::NotACalibration { place, message }.into());
        }
        let noise = |name: &str| report.methods.iter().find(|method| method.method == name)?.noise;
        let given = calibrations.into_iter().map(|named| {
            let noise = noise(&named.name);
            of(Given::Values(named.into()), noise, &report.trained_on)
        });
        Ok(given.collect())
    }

    pub(crate) const fn calibration(&self) -> &AugmentedCalibration {
        match &self.given {
            Given::Values(calibration) => calibration,
            Given::Model(model) => &model.calibration,
        }
    }

    /// The noise of the wheels, where the file has it.
    pub(crate) const fn noise(&self) -> Option<OdometryNoise> {
        self.noise
    }

    /// The extended model, where it is one.
    pub(crate) const fn model(&self) -> Option<&ExtendedModel> {
        match &self.given {
            Given::Values(_) => None,
            Given::Model(model) => Some(model),
        }
    }

    /// Whether the calibration was made from a run.
    pub(crate) fn was_trained_on(&self, run: &Run) -> bool {
        self.trained_on.iter().any(|dataset| dataset.has(run))
    }

    /// What of the calibration is no correction of a robot's stated values.
    pub(crate) fn why_of_another_robot(&self, robot: &NominalRobot) -> Option<String> {
        self.calibration().calibration.other_robot(robot)
    }

    /// Remarks what dead reckoning does without.
    pub(crate) fn remark(&self, terminal: &Terminal) {
        let Given::Model(model) = &self.given else { return };
        for remark in &model.remarks {
            terminal.remark(&format!("{}: {remark}", self.place));
        }
    }

    /// Whether a dataset must be read whole: faults of its records are undone first.
    pub(crate) const fn changes_records(&self) -> bool {
        matches!(&self.given, Given::Model(model) if model.changes_records())
    }

    /// Refuses the model of another robot.
    pub(crate) fn check(&self, robot: &NominalRobot, dataset: &str) -> Result<(), Failure> {
        let Given::Model(model) = &self.given else { return Ok(()) };
        let what =
            |error| format!("{}: {error} ({dataset}); give the robot's own, or correct [robot] there", self.place);
        Ok(model.check(robot).map_err(what)?)
    }

    /// The records without the faults that the model has.
    pub(crate) fn undone<'d>(
        &self,
        dataset: &'d Dataset,
        name: &str,
        terminal: &Terminal,
    ) -> Result<Cow<'d, Dataset>, Failure> {
        let Given::Model(model) = &self.given else { return Ok(Cow::Borrowed(dataset)) };
        if !model.changes_records() {
            return Ok(Cow::Borrowed(dataset));
        }
        let (records, remarks) = model.undone(dataset).map_err(|error| format!("{name}: {}: {error}", self.place))?;
        for remark in remarks {
            terminal.remark(&format!("{name}: {}: {remark}", self.place));
        }
        Ok(Cow::Owned(records))
    }

    /// The file's name, for messages.
    pub(crate) fn place(&self) -> &str {
        &self.place
    }
}

/// Whether a file is TOML with a robot, as scenarios have it and calibration files do not. What is neither is
/// refused as a calibration.
///
/// # Errors
/// Of the manifest of a dataset, which has a robot too.
pub(crate) fn is_scenario(path: &Path) -> Result<bool, Failure> {
    let mut text = String::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(LARGEST_FILE_BYTES).read_to_string(&mut text));
    let Some(table) = read.ok().and_then(|_| text.parse::<toml::Table>().ok()) else { return Ok(false) };
    if table.contains_key("robot") && table.contains_key("format") {
        let why = "it is the manifest of a dataset, and no calibration; yair calibrate DATASET --out FILE makes one";
        return Err(format!("{}: {why}", path.display()).into());
    }
    Ok(table.contains_key("robot"))
}
