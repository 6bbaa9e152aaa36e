//! A sweep: cases and axes over any numeric key of the scenario, and who estimates from which protocols.

use std::collections::BTreeMap;

use motion_programs::Schedule;
use serde::{Deserialize, Deserializer, Serialize};

use crate::axis::Levels;

/// What a sweep varies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Trials at every point.
    pub trials: u64,
    /// Calibration methods that each trial is given to.
    pub methods: Vec<String>,
    /// Dotted keys of the scenario, each with its levels; several keys apart by commas take the same level
    /// together. A list is indexed by number (`protocol.0.runs`) or by its element's kind or id
    /// (`effect.wheelbase.ratio`).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub axes: BTreeMap<String, Levels>,
    /// Sobol points in the axes' ranges instead of a grid of their lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sobol: Option<Sobol>,
    /// Named sets of values; every case is crossed with all points of the axes.
    #[serde(default, rename = "case", skip_serializing_if = "Vec::is_empty")]
    pub cases: Vec<Case>,
    /// What a method drives instead of the scenario's own protocols, by the method's name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub protocols: BTreeMap<String, Vec<Schedule>>,
    /// What is driven on paper after a calibration, to turn errors of parameters into drift. No budget bounds
    /// it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validation: Vec<Schedule>,
}

/// Sobol points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sobol {
    /// How many; a power of two fills the ranges most evenly.
    pub points: u32,
}

/// A named set of values: a robot, a room.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// A name for people and tables.
    pub name: String,
    /// Dotted keys of the scenario, as for the axes, each with its value.
    #[serde(default, deserialize_with = "quoted_keys")]
    pub set: BTreeMap<String, f64>,
}

/// Numbers by their dotted keys. A key without quotes is a table in TOML, and the refusal says how it is
/// meant.
fn quoted_keys<'de, D: Deserializer<'de>>(set: D) -> Result<BTreeMap<String, f64>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "every value must be a number, and every dotted key must be in quotes")]
    enum Value {
        Number(f64),
    }
    let values = BTreeMap::<String, Value>::deserialize(set)?;
    Ok(values.into_iter().map(|(key, Value::Number(value))| (key, value)).collect())
}

/// Most points of a sweep: each is a scenario in memory.
const MAX_POINTS: u32 = 10_000;

/// Dimensions for which the Sobol sequence has direction numbers.
const MAX_SOBOL_AXES: usize = 256;

impl Sweep {
    /// What can be said without the scenario.
    pub(crate) fn check(&self) -> Result<(), String> {
        if self.trials < 2 {
            return Err(format!("sweep.trials is {}; a spread needs at least 2", self.trials));
        }
        if self.methods.is_empty() {
            return Err("sweep.methods is empty; name at least one method".to_owned());
        }
        if let Some(name) = twice(&self.methods) {
            return Err(format!("sweep.methods names \"{name}\" twice"));
        }
        if let Some(name) = self.protocols.keys().find(|name| !self.methods.contains(name)) {
            let methods = self.methods.join(", ");
            return Err(format!("sweep.protocols.{name}: no such method in sweep.methods, which has: {methods}"));
        }
        let names: Vec<String> = self.cases.iter().map(|case| case.name.clone()).collect();
        if names.iter().any(String::is_empty) {
            return Err("a [[sweep.case]] has an empty name".to_owned());
        }
        if let Some(name) = twice(&names) {
            return Err(format!("two [[sweep.case]] have the name \"{name}\"; names must differ"));
        }
        if let Some(sobol) = self.sobol {
            if sobol.points == 0 {
                return Err("sweep.sobol.points is 0; ask for at least 1".to_owned());
            }
            if self.axes.is_empty() || self.axes.len() > MAX_SOBOL_AXES {
                let axes = self.axes.len();
                return Err(format!("sweep.sobol needs 1 to {MAX_SOBOL_AXES} ranges in sweep.axes, which has {axes}"));
            }
        }
        let levels = |levels: &Levels| match levels {
            Levels::List(list) if self.sobol.is_none() => list.len(),
            _ => 1,
        };
        let count = |n: usize| f64::from(u32::try_from(n).unwrap_or(u32::MAX));
        let grid: f64 = self.axes.values().map(|axis| count(levels(axis))).product();
        let points = grid * self.sobol.map_or(1.0, |sobol| f64::from(sobol.points)) * count(self.cases.len().max(1));
        if points > f64::from(MAX_POINTS) {
            return Err(format!("the sweep crosses into {points} points; at most {MAX_POINTS} are driven"));
        }
        Ok(())
    }
}

fn twice(names: &[String]) -> Option<&String> {
    names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)).map(|(_, name)| name)
}
