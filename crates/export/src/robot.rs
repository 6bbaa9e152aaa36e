//! A calibrated robot as formats take it: lengths with what they replace, noise, and the effects of an
//! extended model.

use std::f64::consts::PI;

use calib::{MethodReport, NamedCalibration, OdometryNoise, Parameter, nominal_value};
use dataset::NominalRobot;
use diagnose::{ExtendedModel, ModelledEffect};
use effects::{Effect, Hypothesis, OnBoard, Variant};
use kinematics::{DriveGeometry, Wheels};
use model_term::ModelTerm;
use scenario::Scenario;

use crate::error::ExportError;
use crate::settings::{SAME_NOMINAL_TOLERANCE, WHOLE_COUNTS_TOLERANCE};

/// A calibrated length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Length {
    /// The value, metres.
    pub value_m: f64,
    /// One standard deviation, metres, where it is known.
    pub sigma_m: Option<f64>,
    /// What it replaces, metres, where it is known.
    pub nominal_m: Option<f64>,
}

/// An effect of an extended model beyond the drive's geometry.
#[derive(Clone)]
pub struct RobotEffect {
    /// Its id.
    pub id: &'static str,
    /// Its meaning in one line.
    pub meaning: &'static str,
    /// What a robot's own odometry can do of it.
    pub on_board: OnBoard,
    /// Sizes by name.
    pub values: Vec<(String, f64)>,
    /// Its mean terms, each with the values of its parameters.
    pub terms: Vec<(Box<dyn ModelTerm>, Vec<f64>)>,
    /// It is innocent: a format without it leaves out nothing.
    pub is_silent: bool,
}

impl RobotEffect {
    /// A size by its name; 0 where it has none of that name.
    #[must_use]
    pub fn size(&self, name: &str) -> f64 {
        self.values.iter().find(|(of, _)| of == name).map_or(0.0, |(_, value)| *value)
    }

    /// The sizes that its statements may read: those of its mean terms, or of its simulation model where it
    /// has no mean.
    pub(crate) fn size_names(&self) -> Vec<String> {
        let variants = effects::hypothesis(self.id).and_then(Hypothesis::into_variants).unwrap_or_default();
        let mut names: Vec<String> = Vec::new();
        for Variant { fixed, term, .. } in &variants {
            names.extend(fixed.iter().map(|(name, _)| (*name).to_owned()));
            names.extend(term.parameters().iter().map(|parameter| parameter.name.to_owned()));
        }
        if variants.is_empty() {
            names.extend(self.values.iter().map(|(name, _)| name.clone()));
        }
        let mut seen = std::collections::BTreeSet::new();
        names.retain(|name| self.on_board.uses(name) && seen.insert(name.clone()));
        names
    }
}

impl std::fmt::Debug for RobotEffect {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { id, values, .. } = self;
        formatter.debug_struct("RobotEffect").field("id", id).field("values", values).finish_non_exhaustive()
    }
}

/// A calibrated robot.
#[derive(Debug)]
pub struct CalibratedRobot {
    /// The file that it is from.
    pub place: String,
    /// The calibration's name: its method, or the scenario's name.
    pub name: String,
    /// Rolling diameters.
    pub wheel_diameter: Wheels<Length>,
    /// Distance between the wheel contacts.
    pub wheel_separation: Length,
    /// Counts of a wheel turn, where they are known.
    pub ticks_per_rev: Option<f64>,
    /// Width of the counters, bits, where it is stated.
    pub counter_bits: Option<u8>,
    /// Noise of the odometry, where it was estimated.
    pub noise: Option<OdometryNoise>,
    /// It is an extended model: its dead reckoning goes by exact arcs.
    pub is_extended: bool,
    /// Effects beyond the geometry, in the order in which they act.
    pub effects: Vec<RobotEffect>,
    /// What the data do not determine, and other cautions.
    pub cautions: Vec<String>,
}

impl CalibratedRobot {
    /// The result of a method in a calibration file; `robot` is what a dataset states.
    ///
    /// # Errors
    /// [`ExportError`] when a length has no value, or the dataset is of another robot.
    pub fn of_method(place: &str, method: &MethodReport, robot: Option<&NominalRobot>) -> Result<Self, ExportError> {
        if let Some(why) = &method.error {
            let (method, why) = (method.method.clone(), why.clone());
            return Err(ExportError::NoResult { place: place.to_owned(), method, why });
        }
        refuse_other_robot(place, method, robot)?;
        if let Some(OdometryNoise { wheel_sigma_m_per_sqrt_m, turn_sigma_rad_per_sqrt_rad, .. }) = method.noise {
            for value in [wheel_sigma_m_per_sqrt_m, turn_sigma_rad_per_sqrt_rad] {
                if !(value.is_finite() && value >= 0.0) {
                    return Err(ExportError::BadNoise { place: place.to_owned(), value });
                }
            }
        }
        let ticks_per_rev = ticks_per_rev(method, robot);
        let [left, right, separation] =
            Parameter::LENGTHS.map(|parameter| length(place, method, parameter, ticks_per_rev, robot));
        let caution =
            |blind: &calib::ReportedBlindness| format!("{} is not determined: {}", blind.parameter, blind.why);
        let mut robot = Self {
            place: place.to_owned(),
            name: method.method.clone(),
            wheel_diameter: Wheels { left: left?, right: right? },
            wheel_separation: separation?,
            ticks_per_rev,
            counter_bits: robot.and_then(|robot| robot.counter_bits),
            noise: method.noise,
            is_extended: false,
            effects: Vec::new(),
            cautions: method.not_observable.iter().map(caution).chain(method.warnings.iter().cloned()).collect(),
        };
        // A file that somebody wrote by hand says nothing of runs.
        if method.runs_used > 0 && !method.converged {
            robot.cautions.push("the fit did not converge: its numbers are no result".to_owned());
        }
        robot.geometry()?;
        Ok(robot)
    }

    /// The robot of an extended model; `scenario` is that of the model.
    ///
    /// # Errors
    /// [`ExportError`] when the values are no drive, or the dataset is of another robot.
    pub fn of_model(
        place: &str,
        scenario: &Scenario,
        model: &ExtendedModel,
        robot: Option<&NominalRobot>,
    ) -> Result<Self, ExportError> {
        if let Some(what) = robot.and_then(|robot| model.calibration.calibration.other_robot(robot)) {
            return Err(ExportError::OtherRobot { place: place.to_owned(), what });
        }
        let nominal = scenario.robot.nominal();
        let values = &model.calibration.calibration.values;
        let length = |parameter: Parameter| Length {
            value_m: values.get(parameter.key()).copied().unwrap_or(f64::NAN),
            sigma_m: None,
            nominal_m: nominal_value(&nominal, parameter.key()),
        };
        let [left, right, wheel_separation] = Parameter::LENGTHS.map(length);
        let robot = Self {
            place: place.to_owned(),
            name: scenario.name.clone(),
            wheel_diameter: Wheels { left, right },
            wheel_separation,
            // A tick of the log may be several counts of the controller.
            ticks_per_rev: nominal.ticks_per_rev.map(|counts| counts / counts_per_tick(scenario)),
            counter_bits: robot.and_then(|robot| robot.counter_bits),
            noise: Some(OdometryNoise {
                wheel_sigma_m_per_sqrt_m: scenario.noise.wheel_sigma_m_per_sqrt_m,
                turn_sigma_rad_per_sqrt_rad: 0.0,
                is_assumed: false,
            }),
            is_extended: true,
            effects: model.effects.iter().filter_map(|effect| of_robot(effect, model)).collect(),
            cautions: Vec::new(),
        };
        robot.geometry()?;
        Ok(robot)
    }

    /// The calibrated drive.
    ///
    /// # Errors
    /// [`ExportError::NotADrive`] when a length is not positive.
    pub fn geometry(&self) -> Result<DriveGeometry, ExportError> {
        let diameter_m = self.wheel_diameter.map(|length| length.value_m);
        DriveGeometry::new(diameter_m, self.wheel_separation.value_m)
            .map_err(|source| ExportError::NotADrive { place: self.place.clone(), source })
    }

    /// Counts of a wheel turn.
    ///
    /// # Errors
    /// [`ExportError::NoTicks`] where nothing states them.
    pub fn ticks_per_rev(&self) -> Result<f64, ExportError> {
        self.ticks_per_rev.ok_or_else(|| ExportError::NoTicks { place: self.place.clone() })
    }

    /// Geometric mean of the wheels' diameters, metres.
    #[must_use]
    pub fn mean_diameter_m(&self) -> f64 {
        (self.wheel_diameter.left.value_m * self.wheel_diameter.right.value_m).sqrt()
    }

    /// Effects that a format leaves out; one that runs effects leaves out what cannot run on board, and names
    /// what is of the instrument too.
    pub fn left_out(&self, runs_effects: bool) -> impl Iterator<Item = &RobotEffect> {
        self.effects.iter().filter(move |effect| match effect.on_board {
            OnBoard::OfInstrument => runs_effects,
            _ if !runs_effects => !effect.is_silent,
            OnBoard::Never(_) => true,
            OnBoard::CovarianceOnly(_) => self.noise.is_none(),
            _ => false,
        })
    }

    /// Faults of the records in the order in which they are undone: the last that acted is the first.
    pub fn corrections(&self) -> impl Iterator<Item = &RobotEffect> {
        self.effects.iter().rev().filter(|effect| matches!(effect.on_board, OnBoard::Constant(_)))
    }
}

/// Counts of a tick of the log.
fn counts_per_tick(scenario: &Scenario) -> f64 {
    let of = |effect: &Effect| effect.physical().forward()?.counts_per_tick();
    scenario.effects.iter().filter_map(of).map(f64::from).product()
}

/// An effect of a model, unless the geometry has it or nothing is said of it.
fn of_robot(effect: &ModelledEffect, model: &ExtendedModel) -> Option<RobotEffect> {
    let description = effects::description(effect.id);
    let on_board = description
        .as_ref()
        .map_or(OnBoard::Never("a product of covariates has no statements of its own"), |of| of.on_board);
    if matches!(on_board, OnBoard::Geometry) {
        return None;
    }
    let mut values = &model.calibration.term_values[..];
    let mut terms = Vec::new();
    for (number, term) in model.calibration.terms.iter().enumerate() {
        let (own, others) = values.split_at(term.parameters().len());
        if effect.terms.contains(&number) {
            terms.push((term.clone(), own.to_vec()));
        }
        values = others;
    }
    Some(RobotEffect {
        id: effect.id,
        meaning: description.map_or("a product of covariates outside of the catalogue", |of| of.meaning),
        on_board,
        values: effect.values.clone(),
        terms,
        is_silent: matches!(effects::hypothesis(effect.id), Some(Hypothesis::Silent)),
    })
}

fn value(method: &MethodReport, parameter: Parameter) -> Option<(f64, Option<f64>)> {
    let reported = method.parameters.get(parameter.key())?;
    Some((reported.value?, reported.sigma))
}

/// Counts of a turn: as the dataset states them, or what diameters and travels of the file make.
fn ticks_per_rev(method: &MethodReport, robot: Option<&NominalRobot>) -> Option<f64> {
    let stated = robot.and_then(|robot| robot.ticks_per_rev);
    stated.or_else(|| {
        let of = |diameter: Parameter, per_tick: Parameter| {
            Some(PI * value(method, diameter)?.0 / value(method, per_tick)?.0)
        };
        let ticks = of(Parameter::LeftWheelDiameter, Parameter::LeftPerTick)
            .or_else(|| of(Parameter::RightWheelDiameter, Parameter::RightPerTick))?;
        let whole = ticks.round();
        Some(if (ticks - whole).abs() < WHOLE_COUNTS_TOLERANCE * whole { whole } else { ticks })
    })
}

/// A length of a file; a diameter follows from the travel of a count where that alone is there.
fn length(
    place: &str,
    method: &MethodReport,
    parameter: Parameter,
    ticks_per_rev: Option<f64>,
    robot: Option<&NominalRobot>,
) -> Result<Length, ExportError> {
    let per_tick = match parameter {
        Parameter::LeftWheelDiameter => Some(Parameter::LeftPerTick),
        Parameter::RightWheelDiameter => Some(Parameter::RightPerTick),
        _ => None,
    };
    let from_ticks = || {
        let (per_tick_m, sigma_m) = value(method, per_tick?)?;
        let factor = ticks_per_rev? / PI;
        Some((per_tick_m * factor, sigma_m.map(|sigma_m| sigma_m * factor)))
    };
    let Some((value_m, sigma_m)) = value(method, parameter).or_else(from_ticks) else {
        let has_ticks = per_tick.is_some_and(|per_tick| value(method, per_tick).is_some());
        if has_ticks {
            return Err(ExportError::NoTicks { place: place.to_owned() });
        }
        let is_why = |key: &str| method.not_observable.iter().find(|blind| blind.parameter == key);
        let why = is_why(parameter.key()).or_else(|| is_why(Parameter::CommonScale.key()));
        let why = why.map_or_else(|| "the file does not have it".to_owned(), |blind| blind.why.clone());
        return Err(ExportError::NotDetermined { place: place.to_owned(), parameter: parameter.key(), why });
    };
    let ratio = |of: Parameter| method.parameters.get(of.key()).and_then(|reported| reported.ratio_to_nominal);
    let stated_m = robot.and_then(|robot| nominal_value(robot, parameter.key()));
    let from_ratio = || ratio(parameter).or_else(|| ratio(per_tick?)).map(|ratio| value_m / ratio);
    Ok(Length {
        value_m,
        sigma_m: sigma_m.filter(|sigma_m| sigma_m.is_finite() && *sigma_m >= 0.0),
        nominal_m: stated_m.or_else(from_ratio).filter(|nominal_m| nominal_m.is_finite() && *nominal_m > 0.0),
    })
}

/// Refuses a dataset that states other lengths than those that the calibration corrects.
fn refuse_other_robot(place: &str, method: &MethodReport, robot: Option<&NominalRobot>) -> Result<(), ExportError> {
    let Some(robot) = robot else { return Ok(()) };
    let other = |what| Err(ExportError::OtherRobot { place: place.to_owned(), what });
    let values = method.parameters.iter().filter_map(|(key, value)| Some((key.clone(), value.value?))).collect();
    if let Some(what) = NamedCalibration::new(method.method.clone(), values).other_robot(robot) {
        return other(what);
    }
    for (key, reported) in &method.parameters {
        let Some(((value, ratio), stated)) =
            reported.value.zip(reported.ratio_to_nominal).zip(nominal_value(robot, key))
        else {
            continue;
        };
        let corrected = value / ratio;
        if (corrected / stated - 1.0).abs() > SAME_NOMINAL_TOLERANCE {
            return other(format!("it corrects {key} = {corrected}, the dataset states {stated}"));
        }
    }
    Ok(())
}

/// A calibrated robot for the formats' own tests.
#[cfg(test)]
pub(crate) fn specimen() -> CalibratedRobot {
    let length = |value_m, sigma_m, nominal_m| Length { value_m, sigma_m: Some(sigma_m), nominal_m: Some(nominal_m) };
    CalibratedRobot {
        place: "robot.toml".to_owned(),
        name: "joint".to_owned(),
        wheel_diameter: Wheels { left: length(0.202, 2e-5, 0.2), right: length(0.198, 2e-5, 0.2) },
        wheel_separation: length(0.408, 2e-4, 0.4),
        ticks_per_rev: Some(10_000.0),
        counter_bits: None,
        noise: Some(OdometryNoise {
            wheel_sigma_m_per_sqrt_m: 1e-3,
            turn_sigma_rad_per_sqrt_rad: 2e-3,
            is_assumed: false,
        }),
        is_extended: false,
        effects: Vec::new(),
        cautions: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calib::ReportedBlindness;

    /// A method as a file has it.
    fn method(values: &[(Parameter, f64, Option<f64>)]) -> MethodReport {
        let reported = |(parameter, value, ratio): &(Parameter, f64, Option<f64>)| {
            let value =
                calib::ReportedValue { ratio_to_nominal: *ratio, ..calib::ReportedValue::of(*value, Some(1e-5)) };
            (parameter.key().to_owned(), value)
        };
        MethodReport {
            method: "joint".to_owned(),
            error: None,
            parameters: values.iter().map(reported).collect(),
            group_instruments: Vec::new(),
            noise: None,
            not_observable: Vec::new(),
            runs_used: 1,
            runs_rejected: Vec::new(),
            one_step: None,
            converged: true,
            warnings: Vec::new(),
            remarks: Vec::new(),
        }
    }

    const WHOLE: [(Parameter, f64, Option<f64>); 5] = [
        (Parameter::LeftWheelDiameter, 0.202, Some(1.01)),
        (Parameter::RightWheelDiameter, 0.198, Some(0.99)),
        (Parameter::WheelSeparation, 0.408, Some(1.02)),
        (Parameter::LeftPerTick, PI * 0.202 / 1000.0, Some(1.01)),
        (Parameter::RightPerTick, PI * 0.198 / 1000.0, Some(0.99)),
    ];

    const NOMINAL: NominalRobot = NominalRobot {
        left_wheel_diameter_m: 0.2,
        right_wheel_diameter_m: 0.2,
        wheel_separation_m: 0.4,
        ticks_per_rev: Some(1000.0),
        counter_bits: Some(16),
    };

    #[test]
    fn lengths_nominal_values_and_counts_come_from_the_file_or_the_dataset() {
        let of = |values: &[_], robot| CalibratedRobot::of_method("c.toml", &method(values), robot).expect("has all");
        let whole = of(&WHOLE, None);
        assert_eq!(whole.ticks_per_rev, Some(1000.0));
        // A ratio of two doubles and back.
        assert!(whole.wheel_separation.nominal_m.is_some_and(|nominal_m| (nominal_m - 0.4).abs() < 1e-15));
        // Travels per tick and the dataset make diameters.
        let of_ticks = of(&WHOLE[2..], Some(&NOMINAL));
        assert!((of_ticks.wheel_diameter.left.value_m - 0.202).abs() < 1e-15);
        assert!(of_ticks.wheel_diameter.left.sigma_m.is_some_and(|sigma_m| (sigma_m - 1e-2 / PI).abs() < 1e-15));
        assert_eq!((of_ticks.wheel_diameter.right.nominal_m, of_ticks.counter_bits), (Some(0.2), Some(16)));
        let mut odd = WHOLE;
        odd[2].2 = Some(0.0);
        assert_eq!(of(&odd, None).wheel_separation.nominal_m, None);
    }

    #[test]
    fn what_no_robot_should_use_is_refused_or_cautioned_of() {
        let of = |method: &MethodReport, robot| CalibratedRobot::of_method("c.toml", method, robot);
        // Travels per tick alone do not say the counts of a turn.
        assert!(matches!(of(&method(&WHOLE[2..]), None), Err(ExportError::NoTicks { .. })));
        let mut blind = method(&WHOLE[..2]);
        blind.not_observable =
            vec![ReportedBlindness { parameter: "wheel_separation_m".to_owned(), why: "no turns".to_owned() }];
        let error = of(&blind, None).err();
        assert!(
            matches!(error, Some(ExportError::NotDetermined { parameter: "wheel_separation_m", why, .. }) if why == "no turns")
        );
        let other = NominalRobot { wheel_separation_m: 0.401, ..NOMINAL };
        assert!(matches!(of(&method(&WHOLE), Some(&other)), Err(ExportError::OtherRobot { .. })));
        assert!(of(&method(&WHOLE), Some(&NOMINAL)).is_ok());
        let mut noisy = method(&WHOLE);
        noisy.noise = Some(OdometryNoise {
            wheel_sigma_m_per_sqrt_m: f64::NAN,
            turn_sigma_rad_per_sqrt_rad: 0.0,
            is_assumed: false,
        });
        assert!(matches!(of(&noisy, None), Err(ExportError::BadNoise { .. })));
        let mut stopped = method(&WHOLE);
        stopped.converged = false;
        assert_eq!(of(&stopped, None).expect("has all").cautions.len(), 1);
    }
}
