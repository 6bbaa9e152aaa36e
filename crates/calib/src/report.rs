//! Calibrations as documents: the JSON of `yair calibrate` and the TOML file that `yair evaluate
//! --calibration` takes, which have the same names.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use dataset::{NominalRobot, NotNegative, Number, OutOfRange, Positive};
use serde::{Deserialize, Serialize};

use crate::estimate::{CalibError, Calibration, GroupInstrument, OdometryNoise, Parameter};
use crate::named_calibration::NamedCalibration;
use crate::settings::MAX_FILE_BYTES;
use crate::stated::nominal_value;
use crate::trained_on::TrainedOn;
use estimation::OneStep;

/// Why a calibration file is not one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The text is no calibration.
    #[error("{place}: not a calibration: {message}")]
    NotACalibration {
        /// File, and line where it is known.
        place: String,
        /// What is wrong.
        message: String,
    },
}

/// What `yair calibrate` found, for one robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationReport {
    /// The dataset's name, or a list of them.
    #[serde(default)]
    pub dataset: Names,
    /// The runs that the values rest on, for whoever evaluates them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trained_on: Vec<TrainedOn>,
    /// What each method found.
    pub methods: Vec<MethodReport>,
}

/// One name or several.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Names {
    /// A single dataset.
    One(String),
    /// Sessions of one robot.
    Several(Vec<String>),
}

impl Default for Names {
    fn default() -> Self {
        Self::Several(Vec::new())
    }
}

impl Names {
    /// A single name for one, a list for several.
    #[must_use]
    pub fn of(names: Vec<String>) -> Self {
        match <[String; 1]>::try_from(names) {
            Ok([name]) => Self::One(name),
            Err(names) => Self::Several(names),
        }
    }
}

/// What one method found, or why it found nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodReport {
    /// The method's name.
    pub method: String,
    /// Why the method cannot be applied; then there are no parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The values by key.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, ReportedValue>,
    /// Instruments of sessions or runs that have their own, null where these runs do not determine it; their
    /// means stand among the parameters.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[serde(rename = "own_instruments")]
    pub group_instruments: Vec<GroupInstrument>,
    /// Noise of the odometry, where the method estimates it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<OdometryNoise>,
    /// What the data do not determine.
    #[serde(default)]
    pub not_observable: Vec<ReportedBlindness>,
    /// How many runs the values rest on.
    #[serde(default)]
    pub runs_used: usize,
    /// What was left out.
    #[serde(default)]
    pub runs_rejected: Vec<ReportedRejection>,
    /// How the values were found where the datasets are too large to be fitted as a whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub one_step: Option<OneStep>,
    /// Whether the method converged.
    #[serde(default)]
    pub converged: bool,
    /// Implausible values, and what to check.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Values far from the stated ones that may be right, and instruments that moved between sessions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
}

/// A value with its standard deviation. A bare number is read as a value without one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ValueOrNumber")]
pub struct ReportedValue {
    /// In SI units; `None` where the data do not determine it, with the reason under `not_observable`.
    pub value: Option<f64>,
    /// The value over the stated one, of what is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratio_to_nominal: Option<f64>,
    /// One standard deviation.
    pub sigma: Option<f64>,
    /// Why there is no sigma.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_why_null: Option<String>,
    /// Ends of the profile interval at 95 %, where it was computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_95: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum ValueOrNumber {
    Number(f64),
    Value {
        value: f64,
        ratio_to_nominal: Option<f64>,
        sigma: Option<f64>,
        sigma_why_null: Option<String>,
        interval_95: Option<[f64; 2]>,
    },
}

impl TryFrom<ValueOrNumber> for ReportedValue {
    type Error = OutOfRange;

    fn try_from(from: ValueOrNumber) -> Result<Self, OutOfRange> {
        match from {
            ValueOrNumber::Number(value) => Ok(Self::of(value, None)),
            ValueOrNumber::Value { value, ratio_to_nominal, sigma, sigma_why_null, interval_95 } => {
                ratio_to_nominal.map(Positive::try_from).transpose()?;
                sigma.map(NotNegative::try_from).transpose()?;
                interval_95.into_iter().flatten().try_for_each(|end| Number::try_from(end).map(drop))?;
                Ok(Self { value: Some(value), ratio_to_nominal, sigma, sigma_why_null, interval_95 })
            }
        }
    }
}

impl ReportedValue {
    /// A value with its standard deviation, and nothing else known of it.
    #[must_use]
    pub const fn of(value: f64, sigma: Option<f64>) -> Self {
        Self { value: Some(value), ratio_to_nominal: None, sigma, sigma_why_null: None, interval_95: None }
    }
}

/// A parameter that the data do not determine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportedBlindness {
    /// Its key.
    pub parameter: String,
    /// Why.
    pub why: String,
}

/// A run that was left out.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReportedRejection {
    /// The run's id.
    pub run: String,
    /// Why.
    pub why: String,
}

impl MethodReport {
    /// The document's form of a method's outcome on a robot that believes itself `nominal`.
    #[must_use]
    pub fn new(method: &str, outcome: &Result<Calibration, CalibError>, nominal: &NominalRobot) -> Self {
        let empty = Self {
            method: method.to_owned(),
            error: None,
            parameters: BTreeMap::new(),
            group_instruments: Vec::new(),
            noise: None,
            not_observable: Vec::new(),
            runs_used: 0,
            runs_rejected: Vec::new(),
            one_step: None,
            converged: false,
            warnings: Vec::new(),
            remarks: Vec::new(),
        };
        let calibration = match outcome {
            Ok(calibration) => calibration,
            Err(error) => return Self { error: Some(error.to_string()), ..empty },
        };
        // What is not determined keeps its stated value, which nothing measured.
        let is_open = |parameter| calibration.not_observable.iter().any(|blind| blind.parameter == parameter);
        let value = |estimate: crate::Estimate| {
            let (sigma, why) = match estimate.sigma {
                Some(_) if is_open(estimate.parameter) => (None, Some("these runs do not determine it")),
                Some(sigma) => (Some(sigma), None),
                None => (None, Some("too few runs to show a scatter")),
            };
            ReportedValue {
                ratio_to_nominal: nominal_value(nominal, estimate.parameter.key())
                    .map(|nominal| estimate.value / nominal),
                sigma_why_null: why.map(str::to_owned),
                ..ReportedValue::of(estimate.value, sigma)
            }
        };
        Self {
            parameters: calibration
                .estimates()
                .map(|estimate| (estimate.parameter.key().to_owned(), value(estimate)))
                .collect(),
            group_instruments: calibration.group_instruments.clone(),
            noise: calibration.noise,
            not_observable: calibration
                .not_observable
                .iter()
                .map(|blind| ReportedBlindness {
                    parameter: blind.parameter.key().to_owned(),
                    why: blind.why.to_string(),
                })
                .collect(),
            runs_used: calibration.runs_used,
            runs_rejected: calibration
                .runs_rejected
                .iter()
                .map(|rejected| ReportedRejection { run: rejected.run.clone(), why: rejected.why.clone() })
                .collect(),
            one_step: calibration.one_step,
            converged: calibration.converged,
            warnings: calibration.plausibility_warnings(nominal),
            remarks: calibration.remarks(nominal),
            ..empty
        }
    }
}

impl CalibrationReport {
    /// The calibration file's text.
    ///
    /// # Errors
    /// [`ReportError::NotACalibration`] when a value has no TOML form.
    pub fn to_toml(&self) -> Result<String, ReportError> {
        let mut known = self.clone();
        for method in &mut known.methods {
            method.parameters.retain(|_, value| value.value.is_some());
        }
        toml::to_string(&known).map_err(|error| ReportError::NotACalibration {
            place: "calibration".to_owned(),
            message: error.to_string(),
        })
    }

    /// Reads a calibration file.
    ///
    /// # Errors
    /// [`ReportError`] with the file and, where it is known, the line.
    pub fn read(path: &Path) -> Result<Self, ReportError> {
        let io = |source| ReportError::Io { path: path.to_owned(), source };
        let place = path.display().to_string();
        let mut text = String::new();
        let file = std::fs::File::open(path).map_err(io)?;
        file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text).map_err(io)?;
        if text.len() as u64 > MAX_FILE_BYTES {
            let message = format!("it has more than {MAX_FILE_BYTES} bytes");
            return Err(ReportError::NotACalibration { place, message });
        }
        let report: Self = toml::from_str(&text).map_err(|error| {
            let line = error.span().map(|span| text[..span.start].matches('\n').count() + 1);
            let place = line.map_or_else(|| place.clone(), |line| format!("{place}:{line}"));
            ReportError::NotACalibration { place, message: error.message().trim().replace('\n', "; ") }
        })?;
        for method in &report.methods {
            for (key, value) in method.parameters.iter().filter_map(|(key, value)| Some((key, value.value?))) {
                let is_length = !Parameter::INSTRUMENT.iter().any(|of| of.key() == key.as_str());
                let is_value =
                    if is_length { Positive::try_from(value).is_ok() } else { Number::try_from(value).is_ok() };
                if !is_value || !KNOWN_KEYS.contains(&key.as_str()) {
                    let message = format!(
                        "[methods.parameters] of {}: {key} = {value:?} is no known value; lengths are positive; known: {}",
                        method.method,
                        KNOWN_KEYS.join(", ")
                    );
                    return Err(ReportError::NotACalibration { place, message });
                }
            }
        }
        Ok(report)
    }

    /// The calibrations in the file that have values, each under the name of its method.
    #[must_use]
    pub fn calibrations(&self) -> Vec<NamedCalibration> {
        // Those of single runs are summed up in the values.
        let are_of_sessions = |own: &[GroupInstrument]| match &self.dataset {
            Names::One(_) => false,
            Names::Several(sessions) => own.iter().all(|own| sessions.contains(&own.of)),
        };
        let of_sessions = |own: &Vec<GroupInstrument>| if are_of_sessions(own) { own.clone() } else { Vec::new() };
        self.methods
            .iter()
            .filter(|method| method.error.is_none())
            .map(|method| NamedCalibration {
                name: method.method.clone(),
                values: method.parameters.iter().filter_map(|(key, value)| Some((key.clone(), value.value?))).collect(),
                own_instruments: of_sessions(&method.group_instruments),
            })
            .collect()
    }
}

/// Keys that a calibration file may have under `parameters`.
const KNOWN_KEYS: &[&str] = &[
    Parameter::LeftWheelDiameter.key(),
    Parameter::RightWheelDiameter.key(),
    Parameter::WheelSeparation.key(),
    Parameter::LeftPerTick.key(),
    Parameter::RightPerTick.key(),
    Parameter::SensorX.key(),
    Parameter::SensorY.key(),
    Parameter::SensorTheta.key(),
    Parameter::Latency.key(),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> CalibrationReport {
        let noise =
            OdometryNoise { wheel_sigma_m_per_sqrt_m: 1e-3, turn_sigma_rad_per_sqrt_rad: 2e-3, is_assumed: true };
        let value = ReportedValue::of;
        CalibrationReport {
            trained_on: vec![TrainedOn {
                dataset: "a".to_owned(),
                runs: BTreeMap::from([("run-01".to_owned(), "00ff".to_owned())]),
            }],
            dataset: Names::of(vec!["a".to_owned()]),
            methods: vec![MethodReport {
                group_instruments: Vec::new(),
                noise: Some(noise),
                method: "umbmark".to_owned(),
                error: None,
                parameters: [
                    ("left_wheel_diameter_m".to_owned(), value(0.084, Some(1e-5))),
                    ("wheel_separation_m".to_owned(), value(0.2, None)),
                ]
                .into(),
                not_observable: vec![ReportedBlindness {
                    parameter: "common_scale".to_owned(),
                    why: "closed".to_owned(),
                }],
                runs_used: 6,
                runs_rejected: vec![ReportedRejection { run: "run-01".to_owned(), why: "far".to_owned() }],
                one_step: Some(OneStep { measurements: 1_000_000, first_measurements: 65_536, passes: 1 }),
                converged: true,
                warnings: Vec::new(),
                remarks: Vec::new(),
            }],
        }
    }

    #[test]
    fn a_calibration_file_reads_back_as_it_was_written() {
        let text = report().to_toml().expect("serialises");
        assert_eq!(toml::from_str::<CalibrationReport>(&text).expect("parses"), report());
    }

    #[test]
    fn numbers_that_are_none_are_refused_wherever_they_stand() {
        let text = report().to_toml().expect("serialises");
        let read = |text: &str| toml::from_str::<CalibrationReport>(text).map_err(|error| error.to_string());
        assert!(read(&text.replace("value = 0.084", "value = 0.085")).is_ok());
        for bad in ["nan", "-nan", "inf", "-inf", "1e308", "-1.0"] {
            for field in ["sigma = 0.00001", "wheel_sigma_m_per_sqrt_m = 0.001", "turn_sigma_rad_per_sqrt_rad = 0.002"]
            {
                let key = field.split_once(' ').expect("a key").0;
                assert!(text.contains(field), "{field} is not in {text}");
                let why = read(&text.replace(field, &format!("{key} = {bad}"))).expect_err(key);
                assert!(why.contains("is expected"), "{why}");
            }
        }
        for bad in ["nan", "inf", "-inf", "1e308", "0.0", "-1.0"] {
            let with_ratio = text.replace("value = 0.084", &format!("value = 0.084\nratio_to_nominal = {bad}"));
            assert!(read(&with_ratio).expect_err("a ratio").contains("is expected"), "{bad}");
        }
        for bad in ["nan", "inf", "1e308"] {
            let with_interval = text.replace("value = 0.084", &format!("value = 0.084\ninterval_95 = [0.0, {bad}]"));
            assert!(read(&with_interval).expect_err("an interval").contains("is expected"), "{bad}");
        }
    }

    #[test]
    fn a_file_of_the_limit_is_read_and_a_longer_one_refused() {
        let path = std::env::temp_dir().join(format!("yair-calibration-{}.toml", std::process::id()));
        let text = "methods = []\n#".to_owned() + &"x".repeat(MAX_FILE_BYTES as usize - 14);
        std::fs::write(&path, &text).expect("written");
        let of_the_limit = CalibrationReport::read(&path);
        std::fs::write(&path, text + "x").expect("written");
        let longer = CalibrationReport::read(&path);
        std::fs::remove_file(&path).expect("removed");
        assert!(of_the_limit.is_ok_and(|report| report.methods.is_empty()));
        assert!(longer.expect_err("refused").to_string().contains("more than 1048576 bytes"));
    }
}
