//! Values that the data do not determine are taken back before a person or a robot uses them.

use crate::estimate::Parameter;
use crate::report::{MethodReport, ReportedBlindness, ReportedValue};

impl MethodReport {
    /// Takes the values back that the data do not determine: each stays at, or depends on, what is stated.
    /// `of_scale` says whether a common scale that is not observable leaves no length determined; methods
    /// that keep the stated mean wheel by design say no.
    pub fn withhold_undetermined(&mut self, of_scale: bool) {
        let mut more = Vec::new();
        for blind in &self.not_observable {
            let is_scale = blind.parameter == Parameter::CommonScale.key();
            let keys: &[Parameter] = match () {
                () if is_scale && of_scale => &Parameter::ESTIMATED,
                () if blind.parameter == Parameter::LeftWheelDiameter.key() => {
                    &[Parameter::LeftWheelDiameter, Parameter::LeftPerTick]
                }
                () if blind.parameter == Parameter::RightWheelDiameter.key() => {
                    &[Parameter::RightWheelDiameter, Parameter::RightPerTick]
                }
                () if blind.parameter == Parameter::WheelSeparation.key() => &[Parameter::WheelSeparation],
                () if blind.parameter == Parameter::SensorTheta.key() => &[Parameter::SensorTheta],
                () => &[],
            };
            for parameter in keys {
                let Some(value) = self.parameters.get_mut(parameter.key()) else { continue };
                let why = "the data do not determine the value".to_owned();
                *value = ReportedValue {
                    value: None,
                    ratio_to_nominal: None,
                    sigma: None,
                    sigma_why_null: Some(why),
                    interval_95: None,
                };
                if parameter.key() != blind.parameter {
                    let why = blind.why.clone();
                    more.push(ReportedBlindness { parameter: parameter.key().to_owned(), why });
                }
            }
        }
        more.retain(|blind| !self.not_observable.contains(blind));
        self.not_observable.extend(more);
    }

    /// Whether a geometry parameter has a value.
    #[must_use]
    pub fn determines_anything(&self) -> bool {
        let of =
            |parameter: &Parameter| self.parameters.get(parameter.key()).is_some_and(|value| value.value.is_some());
        Parameter::ESTIMATED.iter().any(of)
    }
}
