//! Where the outside instrument is on the robot, and how late its stamps are, for whoever compares dead
//! reckoning with what it measured: a tag that is turned must not look like drift.

use std::borrow::Cow;
use std::collections::BTreeMap;

use dataset::Session;
use estimation::{FitSettings, Instrument};
use kinematics::Pose;

use crate::estimate::Parameter;
use crate::named_calibration::NamedCalibration;
use crate::settings::{MIN_LEVER_M, MIN_YAW_RAD};
use crate::trajectory::AugmentedCalibration;

/// The instrument that those calibrations are evaluated with which have none of their own, and the stated
/// values.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedInstrument {
    values: BTreeMap<String, f64>,
    /// The calibration's name, or that it is of the evaluated dataset itself.
    pub from: String,
}

impl EvaluatedInstrument {
    /// How [`Self::from`] names an instrument that was fitted to the evaluated runs.
    pub const IN_SAMPLE: &'static str = "these runs, with all lengths free";

    /// Of the first calibration that has the instrument elsewhere than at the drive's centre, looking ahead
    /// and in time; else by a fit of the evaluated session with all lengths free. `None` where neither has
    /// it elsewhere, or poses are few or have no headings: it is then taken to be at the centre.
    #[must_use]
    pub fn of<'c>(mut calibrations: impl Iterator<Item = &'c NamedCalibration>, session: &Session<'_>) -> Option<Self> {
        let is_elsewhere = |body_from_sensor: Pose, latency_s: f64| {
            let lever_m = body_from_sensor.x_m.hypot(body_from_sensor.y_m);
            lever_m > MIN_LEVER_M || body_from_sensor.theta_rad.abs() > MIN_YAW_RAD || latency_s != 0.0
        };
        let given = calibrations.find(|of| is_elsewhere(of.body_from_sensor(), of.latency_s()));
        let (body_from_sensor, latency_s, from) = match given {
            Some(of) => (of.body_from_sensor(), of.latency_s(), of.name.clone()),
            None => {
                let Instrument { body_from_sensor, latency_s } = FitSettings::instrument(session)?;
                is_elsewhere(body_from_sensor, latency_s).then_some(())?;
                (body_from_sensor, latency_s, Self::IN_SAMPLE.to_owned())
            }
        };
        let Pose { x_m, y_m, theta_rad } = body_from_sensor;
        let values = Parameter::INSTRUMENT
            .into_iter()
            .map(|of| of.key().to_owned())
            .zip([x_m, y_m, theta_rad, latency_s])
            .collect();
        Some(Self { values, from })
    }
}

impl NamedCalibration {
    /// Does it say where the instrument is, or how late?
    #[must_use]
    pub fn has_instrument(&self) -> bool {
        Parameter::INSTRUMENT.iter().any(|parameter| self.values.contains_key(parameter.key()))
    }
}

/// A calibration, or the stated values, with an instrument where it has none of its own.
#[must_use]
pub fn with_instrument<'c>(
    calibration: Option<&'c AugmentedCalibration>,
    instrument: Option<&EvaluatedInstrument>,
) -> Option<Cow<'c, AugmentedCalibration>> {
    let Some(instrument) = instrument else { return calibration.map(Cow::Borrowed) };
    match calibration {
        Some(calibration) if calibration.calibration.has_instrument() => Some(Cow::Borrowed(calibration)),
        Some(calibration) => {
            let mut with = calibration.clone();
            with.calibration.values.extend(instrument.values.clone());
            Some(Cow::Owned(with))
        }
        None => {
            let stated = NamedCalibration::new("nominal".to_owned(), instrument.values.clone());
            Some(Cow::Owned(stated.into()))
        }
    }
}
