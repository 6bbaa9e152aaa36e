//! An extended scenario as dead reckoning takes it: geometry, the mean terms of its effects with their sizes,
//! and the faults of the records that are undone before.
//!
//! It is the inverse of `extended_scenario.rs`, which writes under `[estimated]` what a simulated robot does
//! not say. Where a scenario has no such estimates, an effect whose sizes are those of its mean term gives
//! it.

use std::ops::Range;

use calib::{AugmentedCalibration, NamedCalibration, Parameter};
use dataset::{Dataset, NominalRobot};
use effects::{Effect, Hypothesis, RecordCorrection, Variant, effect_from_estimates};
use kinematics::{GeometryError, Pose};
use model_term::ModelTerm;
use scenario::{Estimated, EstimatedTerm, Instrument, Scenario};

use crate::settings::RECORDS;

/// Why a scenario is no model for dead reckoning, or not that of a robot's log.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExtendedModelError {
    /// The sizes of an effect are not those of its mean term.
    #[error(
        "effect {id}: its sizes do not say how it acts on average; `yair diagnose --out` writes [[estimated.term]] for it: give that file, or delete the effect"
    )]
    NoTerm {
        /// The effect.
        id: &'static str,
    },
    /// Effect and estimate differ.
    #[error(
        "[[estimated.term]] of kind \"{kind}\" is not that of an [[effect]] of the file; change both, or delete the former"
    )]
    NotOfAnEffect {
        /// The estimate's effect.
        kind: String,
    },
    /// The effects leave no drive.
    #[error("its effects leave no drive: {0}")]
    Geometry(#[from] GeometryError),
    /// The records have no form of a fault, so that it cannot be undone.
    #[error("effect {id}: these records do not show how it is undone; correct the log, then delete the effect")]
    NotUndone {
        /// The fault.
        id: &'static str,
    },
    /// The dataset is of another robot.
    #[error("it is the model of another robot: {0}")]
    OtherRobot(String),
}

/// An effect of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelledEffect {
    /// Its id; of a term outside of the catalogue that of such terms.
    pub id: &'static str,
    /// Sizes of its mean term by name, with what is held of it; those of its simulation model where it has no
    /// mean.
    pub values: Vec<(String, f64)>,
    /// Its mean terms among those of the calibration.
    pub terms: Range<usize>,
}

/// What dead reckoning applies of a scenario.
#[derive(Debug, Clone)]
pub struct ExtendedModel {
    /// Geometry, extrinsics, and mean terms with their sizes.
    pub calibration: AugmentedCalibration,
    /// All effects of the scenario, applied or not.
    pub effects: Vec<ModelledEffect>,
    /// What dead reckoning does without, for people.
    pub remarks: Vec<String>,
    /// Faults of the records in the order in which they act.
    faults: Vec<Effect>,
}

impl ExtendedModel {
    /// The model of a scenario.
    ///
    /// # Errors
    /// [`ExtendedModelError`] when an effect cannot be applied, or its estimate is not of it.
    pub fn of(scenario: &Scenario) -> Result<Self, ExtendedModelError> {
        let estimated = scenario.estimated.as_ref().map_or(&[][..], |estimated| &estimated.terms);
        let is_of = |term: &EstimatedTerm, effect: &Effect| {
            effect.id() == term.kind && effect_from_estimates(&term.kind, &named(term)).as_ref() == Some(effect)
        };
        if let Some(other) = estimated.iter().find(|term| !scenario.effects.iter().any(|effect| is_of(term, effect))) {
            return Err(ExtendedModelError::NotOfAnEffect { kind: other.kind.clone() });
        }
        let (mut terms, mut term_values): (Vec<Box<dyn ModelTerm>>, Vec<f64>) = Default::default();
        let (mut faults, mut remarks, mut effects) = (Vec::new(), Vec::new(), Vec::new());
        for effect in &scenario.effects {
            let id = effect.id();
            let first = terms.len();
            let mut own_sizes = sizes(effect);
            match effect.hypothesis().ok_or(ExtendedModelError::NoTerm { id })? {
                Hypothesis::Geometry | Hypothesis::Silent => {}
                Hypothesis::UnknownMotion { .. } => {
                    remarks
                        .push(format!("{id} happens without a trace in the counts: dead reckoning cannot follow it"));
                }
                Hypothesis::Scatter(_) => {
                    remarks.push(format!("{id} only scatters: dead reckoning does without it"));
                }
                Hypothesis::Records(_) => faults.push(effect.clone()),
                Hypothesis::Terms(variants) | Hypothesis::TermsAndScatter(variants, _) => {
                    let own = estimated.iter().find(|term| is_of(term, effect));
                    let values = own.map_or_else(|| sizes(effect), |term| term.values.clone().into_iter().collect());
                    let found = of_variants(variants, &values);
                    if found.is_empty() {
                        return Err(ExtendedModelError::NoTerm { id });
                    }
                    for (term, values) in found {
                        terms.push(term);
                        term_values.extend(values);
                    }
                    own_sizes = values;
                }
            }
            effects.push(ModelledEffect { id, values: own_sizes, terms: first..terms.len() });
        }
        let calibration = NamedCalibration::new(scenario.name.clone(), calibrated(scenario)?);
        Ok(Self { calibration: AugmentedCalibration { calibration, terms, term_values }, effects, remarks, faults })
    }

    /// Whether records must be changed before dead reckoning, which takes whole datasets.
    #[must_use]
    pub const fn changes_records(&self) -> bool {
        !self.faults.is_empty()
    }

    /// A dataset without the faults of the records that the model has, and what was undone, for people.
    ///
    /// # Errors
    /// [`ExtendedModelError::NotUndone`] for a fault that any log may have, and that this one gives no form
    /// of. One that leaves a trace is not there where the log shows none.
    pub fn undone(&self, dataset: &Dataset) -> Result<(Dataset, Vec<String>), ExtendedModelError> {
        let (mut records, mut remarks) = (dataset.clone(), Vec::new());
        for fault in self.faults.iter().rev() {
            let (id, sizes) = (fault.id(), sizes(fault));
            let Some(Hypothesis::Records(corrections)) = fault.hypothesis() else { continue };
            let same = corrections(&records).into_iter().find(|form| is_of_sizes(form, &sizes));
            let leaves_a_trace = || effects::description(id).is_some_and(|of| of.record_fault.leaves_a_trace);
            match same {
                Some(correction) => {
                    remarks.push(format!("{id} is undone: {}", correction.sentence));
                    records = correction.records;
                }
                None if leaves_a_trace() => remarks.push(format!("{id}: this log shows no trace of it")),
                None => return Err(ExtendedModelError::NotUndone { id }),
            }
        }
        Ok((records, remarks))
    }

    /// Whether it may be the model of a robot.
    ///
    /// # Errors
    /// [`ExtendedModelError::OtherRobot`] when a length is no correction of the nominal one.
    pub fn check(&self, robot: &NominalRobot) -> Result<(), ExtendedModelError> {
        let off = self.calibration.calibration.implausible_for(robot);
        off.map_or(Ok(()), |what| Err(ExtendedModelError::OtherRobot(what)))
    }
}

/// The calibrated values by their keys.
fn calibrated(scenario: &Scenario) -> Result<std::collections::BTreeMap<String, f64>, ExtendedModelError> {
    let geometry = scenario.true_geometry()?;
    let diameter_m = geometry.wheel_diameter_m();
    let (sensor, latency_s) = instrument(scenario);
    let values = [
        (Parameter::LeftWheelDiameter, diameter_m.left),
        (Parameter::RightWheelDiameter, diameter_m.right),
        (Parameter::WheelSeparation, geometry.wheel_separation_m()),
        (Parameter::SensorX, sensor.x_m),
        (Parameter::SensorY, sensor.y_m),
        (Parameter::SensorTheta, sensor.theta_rad),
        (Parameter::Latency, latency_s),
    ];
    Ok(values.into_iter().map(|(parameter, value)| (parameter.key().to_owned(), value)).collect())
}

/// Extrinsics and latency: as estimated, or those of the simulated instrument.
fn instrument(scenario: &Scenario) -> (Pose, f64) {
    if let Some(Estimated { sensor_x_m, sensor_y_m, sensor_theta_rad, latency_s, .. }) = scenario.estimated {
        return (Pose::new(sensor_x_m, sensor_y_m, sensor_theta_rad), latency_s);
    }
    let mounted = |instrument: &Instrument| match *instrument {
        Instrument::MotionCapture { latency_s, lever_x_m, lever_y_m, lever_theta_rad, .. } => {
            Some((Pose::new(lever_x_m, lever_y_m, lever_theta_rad), latency_s))
        }
        _ => None,
    };
    scenario.instruments.iter().find_map(mounted).unwrap_or((Pose::IDENTITY, 0.0))
}

fn named(term: &EstimatedTerm) -> Vec<(&str, f64)> {
    term.values.iter().map(|(name, value)| (&name[..], *value)).collect()
}

/// An effect's sizes by name, as its mean term has them, or as a scenario does where both mean the same.
fn sizes(effect: &Effect) -> Vec<(String, f64)> {
    let own = effect.physical().estimates();
    if !own.is_empty() {
        return own.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    }
    let number = |value: &toml::Value| match value {
        toml::Value::Float(value) => Some(*value),
        toml::Value::Integer(value) => Some(*value as f64),
        toml::Value::Boolean(value) => Some(f64::from(u8::from(*value))),
        _ => None,
    };
    let fields = toml::Table::try_from(effect).unwrap_or_default();
    fields.iter().filter_map(|(name, value)| Some((name.clone(), number(value)?))).collect()
}

/// The variants whose parameters and held values all have a size, with the sizes: one of those that hold
/// something, all of those that do not.
fn of_variants(variants: Vec<Variant>, sizes: &[(String, f64)]) -> Vec<(Box<dyn ModelTerm>, Vec<f64>)> {
    let size = |name: &str| sizes.iter().find(|(of, _)| of == name).map(|(_, value)| *value);
    let mut found: Vec<(Box<dyn ModelTerm>, Vec<f64>)> = Vec::new();
    for Variant { fixed, term, at } in variants {
        let holds_something = !fixed.is_empty();
        if holds_something && !found.is_empty() {
            continue;
        }
        let term = match (&fixed[..], at) {
            ([(name, _)], Some(at)) => size(name).map(at),
            (fixed, _) => fixed.iter().all(|(name, value)| size(name) == Some(*value)).then_some(term),
        };
        let Some(term) = term else { continue };
        let values: Option<Vec<f64>> = term.parameters().iter().map(|parameter| size(parameter.name)).collect();
        found.extend(values.map(|values| (term, values)));
    }
    found
}

/// Whether a rewriting undoes a fault of these sizes. How often it strikes may differ.
fn is_of_sizes(form: &RecordCorrection, sizes: &[(String, f64)]) -> bool {
    form.values.iter().all(|(name, value)| {
        let own = sizes.iter().find(|(of, _)| of == name);
        *name == "probability"
            || own.is_some_and(|(_, own)| (own - value).abs() <= RECORDS.factor_tolerance * own.abs())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENARIO: &str = crate::small_robot::MOTION_CAPTURE;

    fn scenario(effects: &str) -> Scenario {
        let (head, _) = SCENARIO.split_once("[[effect]]").expect("effects");
        let (_, protocols) = SCENARIO.split_once("[[protocol]]").expect("protocols");
        Scenario::parse(&format!("{head}{effects}\n[[protocol]]{protocols}"), "a.toml").expect("a scenario")
    }

    fn model(effects: &str) -> Result<ExtendedModel, ExtendedModelError> {
        ExtendedModel::of(&scenario(effects))
    }

    #[test]
    fn a_model_has_the_geometry_and_the_mean_terms_of_its_effects() {
        let of = ExtendedModel::of(&Scenario::parse(SCENARIO, "a.toml").expect("shipped")).expect("a model");
        let effects: Vec<(&str, Range<usize>)> = of.effects.iter().map(|of| (of.id, of.terms.clone())).collect();
        // An eccentricity of two wheels is two terms, of which the left one's sizes are none.
        assert_eq!(
            effects[..4],
            [("wheel_scale", 0..0), ("wheel_mismatch", 0..0), ("wheelbase", 0..0), effects[3].clone()]
        );
        assert_eq!(of.effects.iter().map(|of| of.terms.len()).sum::<usize>(), of.calibration.terms.len());
        let slip = of.effects.iter().find(|of| of.id == "slip_speed").expect("it slips");
        assert_eq!(slip.values, [("slip_s_m".to_owned(), 0.004)]);
        assert_eq!(of.effects[0].values, [("scale".to_owned(), 1.01)]);
        assert!(of.calibration.term_values.contains(&0.004), "{:?}", of.calibration.term_values);
        let values = &of.calibration.calibration.values;
        // 0.363 · 1.015, and diameters whose mean is 0.16 · 1.01 with a ratio of 0.998.
        assert!((values["wheel_separation_m"] - 0.368_445).abs() < 1e-9, "{values:?}");
        let [left, right] = ["left_wheel_diameter_m", "right_wheel_diameter_m"].map(|key| values[key]);
        assert!((right / left - 0.998).abs() < 1e-9 && (left + right - 0.3232).abs() < 1e-3, "{values:?}");
        assert!(!of.changes_records() && of.remarks.is_empty());
        let robot = crate::small_robot::robot(0.363);
        assert!(of.check(&robot).is_ok());
        let other = NominalRobot { wheel_separation_m: 9.0, ..robot };
        assert!(matches!(of.check(&other), Err(ExtendedModelError::OtherRobot(_))));
    }

    #[test]
    fn what_has_no_mean_is_remarked_and_what_is_of_the_records_is_undone() {
        let of = model(
            "[[effect]]\nkind = \"swapped_wheels\"\nswapped = true\n\n[[effect]]\nkind = \"truth_outliers\"\nprobability = 0.01\njump_m = 0.1\njump_rad = 0.1\n",
        );
        let of = of.expect("a model");
        assert!(of.changes_records() && of.calibration.terms.is_empty());
        assert_eq!(of.remarks.len(), 1);
        let sound = crate::small_robot::session(0, 0.0);
        let (records, remarks) = of.undone(&sound).expect("any log may be swapped");
        let [before, after] = [&sound, &records].map(|dataset| match &dataset.runs[1].odometry.wheels {
            dataset::WheelLog::Angles(angles) => angles.left.clone(),
            other => panic!("angles, not {other:?}"),
        });
        assert!(before != after && remarks[0].starts_with("swapped_wheels is undone: "), "{remarks:?}");
        // A trace that the log does not have is remarked, and the log stays.
        let torn = model("[[effect]]\nkind = \"torn_read\"\nprobability = 0.01\njump_counts = 256\n").expect("a model");
        let (records, remarks) = torn.undone(&sound).expect("no trace");
        assert_eq!((records, &remarks[..]), (sound, &["torn_read: this log shows no trace of it".to_owned()][..]));
    }

    #[test]
    fn a_fault_is_undone_by_the_form_of_its_sizes() {
        let form = |values: &[(&'static str, f64)]| RecordCorrection {
            values: values.to_vec(),
            sentence: String::new(),
            visible_in_log: false,
            mistakes: 1,
            records: crate::small_robot::session(0, 0.0),
        };
        let sizes = [("factor".to_owned(), 2.0), ("side".to_owned(), -1.0)];
        assert!(is_of_sizes(&form(&[("factor", 2.09)]), &sizes) && !is_of_sizes(&form(&[("factor", 2.11)]), &sizes));
        assert!(is_of_sizes(&form(&[("side", -1.04)]), &sizes) && !is_of_sizes(&form(&[("side", -0.9)]), &sizes));
        assert!(is_of_sizes(&form(&[("probability", 0.3)]), &sizes) && !is_of_sizes(&form(&[("other", 2.0)]), &sizes));
    }
}
