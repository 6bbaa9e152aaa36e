//! `dataset.toml`: who was measured, with what and how precisely, and which runs there are.

use std::collections::{BTreeMap, HashMap};
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use jiff::Timestamp;
use kinematics::Point;
use serde::Deserialize;
use toml::{Spanned, Value};

use crate::corrections::Corrections;
use crate::counter;
use crate::error::{DatasetError, shown};
use crate::identity::{parse_recorded, parse_robot_id};
use crate::map_distortion::MapDistortion;
use crate::partial::{GyroNoise, LidarExtrinsics};
use crate::record::{CovarianceScale, MarkedPoint, NominalRobot, Protocol, Provenance, RunInfo, TruthNoise};
use crate::settings::MANIFEST_LIMIT_BYTES;
use crate::table::open_file;

/// Name of the file.
pub(crate) const MANIFEST: &str = "dataset.toml";

/// The format that is read and written here.
pub(crate) const FORMAT: i64 = 1;

const EXPECTED: &str = "a dataset's format, [robot] and one [[run]] for every run";

/// Keys of a run that belong to its protocol or its clock; with another unit they are mistakes, not
/// covariates.
const RUN_QUANTITIES: [(&str, &str); 5] =
    [("side", "side_m"), ("radius", "radius_m"), ("length", "length_m"), ("turn", "turn_rad"), ("start", "start_s")];

/// Keys of a run that are not numbers.
const RUN_WORDS: [&str; 3] = ["id", "protocol", "continuous"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestToml {
    format: Spanned<i64>,
    name: Option<String>,
    licence: Option<String>,
    source: Option<String>,
    notes: Option<String>,
    recorded: Option<Spanned<Value>>,
    robot: Spanned<RobotToml>,
    #[serde(default)]
    truth: TruthToml,
    #[serde(default)]
    gyro: GyroToml,
    lidar: Option<LidarToml>,
    corrections: Option<Spanned<Corrections>>,
    #[serde(default)]
    run: Vec<Spanned<RunToml>>,
    #[serde(default)]
    point: Vec<PointToml>,
}

/// [`NominalRobot`] with places for messages.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotToml {
    id: Option<Spanned<String>>,
    left_wheel_diameter_m: Spanned<f64>,
    right_wheel_diameter_m: Spanned<f64>,
    wheel_separation_m: Spanned<f64>,
    ticks_per_rev: Option<Spanned<f64>>,
    counter_bits: Option<Spanned<i64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct TruthToml {
    sigma_xy_m: Option<Spanned<f64>>,
    sigma_theta_rad: Option<Spanned<f64>>,
    map_sigma_xy_m: Option<Spanned<f64>>,
    map_sigma_theta_rad: Option<Spanned<f64>>,
    map_length_m: Option<Spanned<f64>>,
    #[serde(default)]
    covariance_scale: CovarianceScale,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct GyroToml {
    scale_sigma: Option<Spanned<f64>>,
    noise_rad_per_sqrt_s: Option<Spanned<f64>>,
    bias_walk_radps_per_sqrt_s: Option<Spanned<f64>>,
    sampling: Option<GyroSampling>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LidarToml {
    yaw_rad: Option<Spanned<f64>>,
}

/// What the rate of a row is.
#[derive(Deserialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
enum GyroSampling {
    /// The mean over the interval that ends at the row.
    IntervalEnd,
    /// The rate at the row's instant.
    Instantaneous,
}

type RunToml = BTreeMap<Spanned<String>, Spanned<Value>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PointToml {
    id: Spanned<String>,
    x_m: Spanned<f64>,
    y_m: Spanned<f64>,
}

/// The content of `dataset.toml`, checked.
#[derive(Debug)]
pub(crate) struct Manifest {
    pub(crate) provenance: Provenance,
    pub(crate) robot: NominalRobot,
    /// Where `[robot]` stands.
    pub(crate) robot_line: u64,
    pub(crate) truth_noise: TruthNoise,
    pub(crate) corrections: Corrections,
    pub(crate) points: Vec<MarkedPoint>,
    pub(crate) runs: Vec<RunInfo>,
    /// Where each `[[run]]` stands.
    pub(crate) run_lines: Vec<u64>,
}

impl Manifest {
    /// Reads and checks the file.
    pub(crate) fn read(file: &Path) -> Result<Self, DatasetError> {
        let io = |source| DatasetError::Io { path: file.to_owned(), source };
        let too_long = || DatasetError::FileTooLong { file: file.to_owned(), limit_bytes: MANIFEST_LIMIT_BYTES };
        let opened = open_file(file, EXPECTED)?;
        if opened.metadata().map_err(io)?.len() > MANIFEST_LIMIT_BYTES {
            return Err(too_long());
        }
        // Once more while reading, as a file may grow.
        let mut bytes = Vec::new();
        opened.take(MANIFEST_LIMIT_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() as u64 > MANIFEST_LIMIT_BYTES {
            return Err(too_long());
        }
        if bytes.iter().all(u8::is_ascii_whitespace) {
            return Err(DatasetError::EmptyFile { file: file.to_owned(), expected: EXPECTED.to_owned() });
        }
        let text = match std::str::from_utf8(&bytes) {
            Ok(text) => text.strip_prefix('\u{feff}').unwrap_or(text),
            Err(error) => {
                let line = 1 + memchr::memchr_iter(b'\n', &bytes[..error.valid_up_to()]).count() as u64;
                return Err(DatasetError::NotUtf8 { file: file.to_owned(), line });
            }
        };
        let line_ends = memchr::memchr_iter(b'\n', text.as_bytes()).collect();
        Source { file, text, line_ends }.manifest()
    }
}

/// The text that is being read, for messages that say where.
struct Source<'a> {
    file: &'a Path,
    text: &'a str,
    /// Offsets of all line ends, so that the lines of many runs are found in little time.
    line_ends: Vec<usize>,
}

impl Source<'_> {
    fn line(&self, span: &Range<usize>) -> u64 {
        1 + self.line_ends.partition_point(|end| *end < span.start) as u64
    }

    fn error(&self, span: &Range<usize>, message: String) -> DatasetError {
        DatasetError::Toml { file: self.file.to_owned(), line: self.line(span), message }
    }

    fn manifest(&self) -> Result<Manifest, DatasetError> {
        let toml: ManifestToml = toml::from_str(self.text).map_err(|error| self.why_not_parsed(&error))?;
        if *toml.format.as_ref() != FORMAT {
            return Err(self.unsupported(&toml.format));
        }
        let robot_line = self.line(&toml.robot.span());
        let mut robot_toml = toml.robot.into_inner();
        let robot_id = robot_toml
            .id
            .take()
            .map(|id| parse_robot_id(id.as_ref()).map_err(|why| self.error(&id.span(), format!("[robot] id: {why}"))));
        let robot_id = robot_id.transpose()?;
        let recorded = toml.recorded.map(|recorded| self.recorded(&recorded)).transpose()?;
        let robot = self.robot(robot_toml)?;
        let of_lidar = |LidarToml { yaw_rad }| {
            let yaw_rad = yaw_rad.map(|yaw_rad| self.finite("yaw_rad", &yaw_rad)).transpose()?;
            Ok::<_, DatasetError>(LidarExtrinsics { yaw_rad })
        };
        let truth_noise = TruthNoise {
            lidar: toml.lidar.map(of_lidar).transpose()?,
            covariance_scale: toml.truth.covariance_scale,
            map: self.map_distortion(&toml.truth)?,
            sigma_xy_m: self.sigma("sigma_xy_m", toml.truth.sigma_xy_m)?,
            sigma_theta_rad: self.sigma("sigma_theta_rad", toml.truth.sigma_theta_rad)?,
            gyro: GyroNoise {
                scale_sigma: self.sigma("scale_sigma", toml.gyro.scale_sigma)?,
                noise_rad_per_sqrt_s: self.sigma("noise_rad_per_sqrt_s", toml.gyro.noise_rad_per_sqrt_s)?,
                bias_walk_radps_per_sqrt_s: self
                    .sigma("bias_walk_radps_per_sqrt_s", toml.gyro.bias_walk_radps_per_sqrt_s)?,
                is_instantaneous: toml.gyro.sampling == Some(GyroSampling::Instantaneous),
            },
        };
        let corrections = toml.corrections.map_or(Ok(Corrections::default()), |found| self.corrections(found))?;
        if toml.run.is_empty() {
            return Err(self.error(&(0..0), "no [[run]]; expected one for every run of the tables".to_owned()));
        }
        let mut run_lines = Vec::with_capacity(toml.run.len());
        let mut runs = Vec::with_capacity(toml.run.len());
        let mut ids = HashMap::new();
        for run in &toml.run {
            run_lines.push(self.line(&run.span()));
            let (info, id_span) = self.run(run)?;
            self.new_id(&mut ids, "run", &info.id, &id_span)?;
            runs.push(info);
        }
        let mut points = Vec::with_capacity(toml.point.len());
        let mut ids = HashMap::new();
        for PointToml { id, x_m, y_m } in toml.point {
            self.new_id(&mut ids, "point", id.as_ref(), &id.span())?;
            let body = Point::new(self.finite("x_m", &x_m)?, self.finite("y_m", &y_m)?);
            points.push(MarkedPoint { id: id.into_inner(), body });
        }
        let ManifestToml { name, licence, source, notes, .. } = toml;
        let provenance = Provenance { name, licence, source, notes, robot_id, recorded };
        Ok(Manifest { provenance, robot, robot_line, truth_noise, corrections, points, runs, run_lines })
    }

    /// A later format may have other keys: its number is the better reason then.
    fn why_not_parsed(&self, error: &toml::de::Error) -> DatasetError {
        #[derive(Deserialize)]
        struct FormatOnly {
            format: Spanned<i64>,
        }
        match toml::from_str::<FormatOnly>(self.text) {
            Ok(found) if *found.format.as_ref() != FORMAT => self.unsupported(&found.format),
            _ => self.error(&error.span().unwrap_or(0..0), self.in_words(error)),
        }
    }

    /// The parser's message, with what a person is likely to have done.
    fn in_words(&self, error: &toml::de::Error) -> String {
        let message = error.message().replace('\n', "; ");
        let of_syntax =
            !["unknown field", "missing field", "invalid type"].iter().any(|kind| message.starts_with(kind));
        // In a whole file more of it stands behind a fault.
        let in_last_line = error.span().filter(|span| !self.text[span.start..].trim_end().contains('\n'));
        if let Some(span) = in_last_line.filter(|_| of_syntax) {
            return format!("the file may be cut off at line {}: {message}", self.line(&span));
        }
        let unknown = message.strip_prefix("unknown field `").and_then(|rest| rest.split('`').next());
        if unknown.is_some_and(|key| key.contains("radius")) {
            return format!("{message}; a diameter is twice the radius");
        }
        message
    }

    fn unsupported(&self, format: &Spanned<i64>) -> DatasetError {
        let (file, line) = (self.file.to_owned(), self.line(&format.span()));
        DatasetError::UnsupportedFormat { file, line, found: *format.as_ref() }
    }

    fn robot(&self, robot: RobotToml) -> Result<NominalRobot, DatasetError> {
        let counter_bits = match robot.counter_bits {
            None => None,
            Some(bits) => match u8::try_from(*bits.as_ref()) {
                Ok(accepted) if counter::ACCEPTED_BITS.contains(&accepted) => Some(accepted),
                _ => {
                    let message = format!("counter_bits = {}; expected a width from 2 to 63 bits", bits.as_ref());
                    return Err(self.error(&bits.span(), message));
                }
            },
        };
        Ok(NominalRobot {
            left_wheel_diameter_m: self.positive("left_wheel_diameter_m", &robot.left_wheel_diameter_m)?,
            right_wheel_diameter_m: self.positive("right_wheel_diameter_m", &robot.right_wheel_diameter_m)?,
            wheel_separation_m: self.positive("wheel_separation_m", &robot.wheel_separation_m)?,
            ticks_per_rev: robot.ticks_per_rev.map(|ticks| self.positive("ticks_per_rev", &ticks)).transpose()?,
            counter_bits,
        })
    }

    /// An instant, written as a text or as TOML's own date and time with an offset.
    fn recorded(&self, value: &Spanned<Value>) -> Result<Timestamp, DatasetError> {
        let text = match value.as_ref() {
            Value::String(text) => text.clone(),
            Value::Datetime(instant) => instant.to_string(),
            _ => return Err(self.wrong_type("recorded", value, "an instant of RFC 3339")),
        };
        parse_recorded(&text).map_err(|why| self.error(&value.span(), format!("recorded: {why}")))
    }

    /// Corrections whose factors are factors.
    fn corrections(&self, found: Spanned<Corrections>) -> Result<Corrections, DatasetError> {
        let span = found.span();
        let corrections = found.into_inner();
        for (key, factor) in [
            ("time_factor", corrections.time_factor),
            ("truth_time_factor", corrections.truth_time_factor),
            ("truth_length_factor", corrections.truth_length_factor),
        ] {
            self.positive(key, &Spanned::new(span.clone(), factor))?;
        }
        self.positive("1 + truth_clock_rate", &Spanned::new(span.clone(), 1.0 + corrections.truth_clock_rate))?;
        self.finite("truth_shift_s", &Spanned::new(span, corrections.truth_shift_s))?;
        Ok(corrections)
    }

    fn run(&self, run: &Spanned<RunToml>) -> Result<(RunInfo, Range<usize>), DatasetError> {
        let mut info = RunInfo::default();
        let mut id_span = None;
        for (key, value) in run.as_ref() {
            let text = || value.as_ref().as_str().ok_or_else(|| self.wrong_type(key.as_ref(), value, "a text"));
            match key.as_ref().as_str() {
                "id" => {
                    text()?.clone_into(&mut info.id);
                    id_span = Some(value.span());
                }
                "protocol" => info.protocol = Some(self.protocol(text()?, &value.span())?),
                "continuous" => {
                    info.continuous = value
                        .as_ref()
                        .as_bool()
                        .ok_or_else(|| self.wrong_type("continuous", value, "true or false"))?;
                }
                _ => self.run_number(&mut info, key, value)?,
            }
        }
        let id_span = id_span.ok_or_else(|| self.error(&run.span(), "missing key id of a [[run]]".to_owned()))?;
        Ok((info, id_span))
    }

    /// A number of a run: of its protocol, its start or a covariate.
    fn run_number(
        &self,
        info: &mut RunInfo,
        key: &Spanned<String>,
        value: &Spanned<Value>,
    ) -> Result<(), DatasetError> {
        let name = key.as_ref();
        if let Some(expected) = meant_quantity(name) {
            let (file, line) = (self.file.to_owned(), self.line(&key.span()));
            return Err(DatasetError::WrongUnit { file, line, key: shown(name.as_bytes()), expected });
        }
        // A covariate of more than 2^53 that must be exact is not a measurement.
        let number = match value.as_ref() {
            Value::Float(number) => *number,
            Value::Integer(number) => *number as f64,
            _ => return Err(self.wrong_type(name, value, "a number (any key but id, protocol and continuous is one)")),
        };
        let number = Spanned::new(value.span(), number);
        match name.as_str() {
            "side_m" => info.settings.side_m = Some(self.positive(name, &number)?),
            "radius_m" => info.settings.radius_m = Some(self.positive(name, &number)?),
            "length_m" => info.settings.length_m = Some(self.finite(name, &number)?),
            "turn_rad" => info.settings.turn_rad = Some(self.finite(name, &number)?),
            "start_s" => info.start_s = Some(self.finite(name, &number)?),
            _ => {
                info.covariates.insert(name.clone(), self.finite(name, &number)?);
            }
        }
        Ok(())
    }

    fn protocol(&self, name: &str, span: &Range<usize>) -> Result<Protocol, DatasetError> {
        // The derived message lists the known names.
        Value::String(name.to_owned())
            .try_into()
            .map_err(|error: toml::de::Error| self.error(span, format!("protocol: {}", error.message())))
    }

    fn wrong_type(&self, key: &str, value: &Spanned<Value>, expected: &str) -> DatasetError {
        let message =
            format!("key {} is of type {}; expected {expected}", shown(key.as_bytes()), value.as_ref().type_str());
        self.error(&value.span(), message)
    }

    fn not_physical(&self, key: &str, value: &Spanned<f64>, expected: &'static str) -> DatasetError {
        DatasetError::NotPhysical {
            file: self.file.to_owned(),
            line: self.line(&value.span()),
            key: shown(key.as_bytes()),
            value: *value.as_ref(),
            expected,
        }
    }

    fn finite(&self, key: &str, value: &Spanned<f64>) -> Result<f64, DatasetError> {
        if value.as_ref().is_finite() {
            Ok(*value.as_ref())
        } else {
            Err(self.not_physical(key, value, "a finite number"))
        }
    }

    fn positive(&self, key: &str, value: &Spanned<f64>) -> Result<f64, DatasetError> {
        if value.as_ref().is_finite() && *value.as_ref() > 0.0 {
            Ok(*value.as_ref())
        } else {
            Err(self.not_physical(key, value, "a positive finite number"))
        }
    }

    /// A standard deviation; 0 is unknown.
    /// The errors of the instrument's map, where some are stated.
    fn map_distortion(&self, truth: &TruthToml) -> Result<Option<MapDistortion>, DatasetError> {
        let TruthToml { map_sigma_xy_m, map_sigma_theta_rad, map_length_m, .. } = truth;
        let sigmas = [("map_sigma_xy_m", map_sigma_xy_m), ("map_sigma_theta_rad", map_sigma_theta_rad)];
        let mut stated = None;
        let mut values = [0.0; 2];
        for (value, (key, of)) in values.iter_mut().zip(sigmas) {
            if let Some(sigma) = self.sigma(key, of.clone())? {
                *value = sigma;
                stated = of.as_ref();
            }
        }
        let Some(stated) = stated else { return Ok(None) };
        let [sigma_xy_m, sigma_theta_rad] = values;
        let Some(length_m) = self.sigma("map_length_m", map_length_m.clone())? else {
            let message =
                "map_length_m is missing: over what distance, metres, do the map's errors resemble each other?";
            return Err(self.error(&stated.span(), message.to_owned()));
        };
        Ok(Some(MapDistortion { sigma_xy_m, sigma_theta_rad, length_m }))
    }

    fn sigma(&self, key: &str, value: Option<Spanned<f64>>) -> Result<Option<f64>, DatasetError> {
        match value {
            None => Ok(None),
            Some(zero) if *zero.as_ref() == 0.0 => Ok(None),
            Some(value) => self.positive(key, &value).map(Some),
        }
    }

    fn new_id(
        &self,
        ids: &mut HashMap<String, u64>,
        kind: &str,
        id: &str,
        span: &Range<usize>,
    ) -> Result<(), DatasetError> {
        let line = self.line(span);
        if let Some(expected) = why_no_id(id) {
            let id = shown(id.as_bytes());
            return Err(DatasetError::BadId { file: self.file.to_owned(), line, id, expected });
        }
        match ids.insert(id.to_owned(), line) {
            None => Ok(()),
            Some(first) => {
                let id = shown(id.as_bytes());
                Err(self.error(span, format!("a second {kind} with id \"{id}\"; the first is in line {first}")))
            }
        }
    }
}

/// The key that was meant by a known quantity with a unit that is not its own.
pub(crate) fn meant_quantity(key: &str) -> Option<&'static str> {
    let stem = key.rsplit_once('_').map_or(key, |(stem, _unit)| stem);
    RUN_QUANTITIES.into_iter().find(|(known, right)| *known == stem && *right != key).map(|(_, right)| right)
}

/// Whether a key of a run is taken, so that no covariate can have it.
pub(crate) fn is_run_key(key: &str) -> bool {
    RUN_WORDS.contains(&key) || RUN_QUANTITIES.iter().any(|(_, right)| *right == key)
}

/// Why an id cannot stand in a table, if it cannot.
pub(crate) fn why_no_id(id: &str) -> Option<&'static str> {
    if id.is_empty() {
        Some("expected a text that is not empty")
    } else if id.contains(char::is_control) {
        Some("expected a text without line ends or control characters")
    } else {
        None
    }
}
