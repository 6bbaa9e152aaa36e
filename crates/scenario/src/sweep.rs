//! A sweep: axes over any numeric key of the scenario, crossed into points, and who estimates.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::experiment::{Scenario, ScenarioError};

/// What a sweep varies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Trials at every point.
    pub trials: u64,
    /// Calibration methods that each trial is given to.
    pub methods: Vec<String>,
    /// Dotted keys of the scenario, each with its levels. A list is indexed by number (`protocol.0.runs`) or by its element's kind
    /// (`effect.wheelbase.ratio`).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub axes: BTreeMap<String, Vec<f64>>,
}

/// Most points of a grid: each is a scenario in memory.
const MOST_POINTS: f64 = 10_000.0;

/// One axis with the level that a point takes on it.
pub type Axis = (String, f64);

/// One point of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The level on each axis, in the order of the axes.
    pub levels: Vec<Axis>,
    /// The scenario with these levels.
    pub scenario: Scenario,
}

impl Sweep {
    /// The full grid over the axes, the last axis varying fastest; one point when there is none.
    ///
    /// # Errors
    /// [`ScenarioError::Axis`] when a key is not in the scenario or no number, and whatever makes a point's scenario invalid.
    pub fn points(&self, scenario: &Scenario, place: &str) -> Result<Vec<Point>, ScenarioError> {
        let toml_error = |message: String| ScenarioError::Toml { place: place.to_owned(), message };
        if self.trials < 2 {
            return Err(toml_error(format!("sweep.trials is {}; a spread needs at least 2", self.trials)));
        }
        if self.methods.is_empty() {
            return Err(toml_error("sweep.methods is empty; name at least one method".to_owned()));
        }
        for (k, method) in self.methods.iter().enumerate() {
            if self.methods[..k].contains(method) {
                return Err(toml_error(format!("sweep.methods names \"{method}\" twice")));
            }
        }
        let points: f64 =
            self.axes.values().map(|levels| f64::from(u32::try_from(levels.len()).unwrap_or(u32::MAX))).product();
        if points > MOST_POINTS {
            return Err(toml_error(format!("sweep.axes cross into {points} points; at most {MOST_POINTS} are driven")));
        }
        let base = Table::try_from(scenario).map_err(|error| toml_error(error.to_string()))?;
        let mut tables = vec![(Vec::new(), base)];
        for (key, levels) in &self.axes {
            let axis_error =
                |problem: String| ScenarioError::Axis { place: place.to_owned(), key: key.clone(), problem };
            if matches!(key.split('.').next(), Some("seed" | "sweep")) {
                return Err(axis_error("the seed and the sweep itself are the same at every point".to_owned()));
            }
            if levels.is_empty() {
                return Err(axis_error("it has no levels".to_owned()));
            }
            let mut crossed = Vec::with_capacity(tables.len() * levels.len());
            for (point, table) in tables {
                for &level in levels {
                    let (mut point, mut table) = (point.clone(), table.clone());
                    set_number(&mut table, key, level).map_err(axis_error)?;
                    point.push((key.clone(), level));
                    crossed.push((point, table));
                }
            }
            tables = crossed;
        }
        tables
            .into_iter()
            .map(|(levels, table)| {
                let scenario: Scenario =
                    table.try_into().map_err(|error: toml::de::Error| toml_error(error.message().to_owned()))?;
                scenario.check(place)?;
                Ok(Point { levels, scenario })
            })
            .collect()
    }
}

/// Puts `level` at the dotted key, keeping integers integers.
fn set_number(table: &mut Table, key: &str, level: f64) -> Result<(), String> {
    let mut words = key.split('.');
    let first = words.next().unwrap_or_default();
    let known = |table: &Table| table.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    let unknown = format!("no \"{first}\" in the scenario; it has: {}", known(table));
    let mut value = table.get_mut(first).ok_or(unknown)?;
    for word in words {
        value = match value {
            Value::Table(table) => {
                let unknown = format!("no \"{word}\" there; known keys: {}", known(table));
                table.get_mut(word).ok_or(unknown)?
            }
            Value::Array(items) => {
                let kinds: Vec<_> = items
                    .iter()
                    .map(|item| item.get("kind").and_then(Value::as_str).unwrap_or("?").to_owned())
                    .collect();
                let position = word.parse().ok().or_else(|| kinds.iter().position(|kind| kind == word));
                let unknown = format!("no \"{word}\" in that list; it has: {}", kinds.join(", "));
                position.and_then(|position: usize| items.get_mut(position)).ok_or(unknown)?
            }
            _ => return Err(format!("\"{word}\" asks for a part of a single value")),
        };
    }
    match value {
        Value::Float(number) => *number = level,
        #[allow(clippy::cast_possible_truncation)]
        Value::Integer(number) if level.fract() == 0.0 && level.abs() < 1e15 => *number = level as i64,
        Value::Integer(_) => return Err(format!("{level} is not a whole number, as this key asks")),
        _ => return Err("it is not a number".to_owned()),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(axes: &[(&str, &[f64])]) -> Scenario {
        let mut scenario =
            Scenario::parse(include_str!("../../../scenarios/paper.toml"), "paper.toml").expect("shipped");
        let axes = axes.iter().map(|(key, levels)| ((*key).to_owned(), levels.to_vec())).collect();
        scenario.sweep = Some(Sweep { trials: 10, methods: vec!["direct".to_owned()], axes });
        scenario
    }

    fn points(axes: &[(&str, &[f64])]) -> Result<Vec<Point>, ScenarioError> {
        let scenario = paper(axes);
        scenario.sweep.as_ref().expect("set above").points(&scenario, "x.toml")
    }

    #[test]
    fn levels_reach_floats_integers_and_lists() {
        let points = points(&[
            ("effect.contact_patch_wheelbase.sigma_m", &[0.0, 0.002]),
            ("noise.wheel_sigma_m_per_sqrt_m", &[0.25]),
            ("protocol.0.runs", &[7.0, 8.0, 9.0]),
        ])
        .expect("all keys exist");
        assert_eq!(points.len(), 6);
        let last = &points[5];
        assert_eq!(last.levels.iter().map(|(_, level)| *level).collect::<Vec<_>>(), [0.002, 0.25, 9.0]);
        assert_eq!(last.scenario.noise.wheel_sigma_m_per_sqrt_m, 0.25);
        assert_eq!(last.scenario.programs().iter().filter(|program| program.id.starts_with("straight")).count(), 9);
        let effects::Effect::ContactPatchWheelbase(patch) = &last.scenario.effects[2] else {
            panic!("third in the file")
        };
        assert_eq!(patch.sigma_m, 0.002);
    }

    #[test]
    fn without_axes_there_is_one_point_the_scenario_itself() {
        let points = points(&[]).expect("valid");
        assert_eq!(points.len(), 1);
        assert_eq!(points[0].scenario, paper(&[]));
    }

    #[test]
    fn axes_that_do_not_fit_are_refused_with_what_is_there() {
        let error = |axes: &[(&str, &[f64])]| points(axes).expect_err("no such axis").to_string();
        assert!(error(&[("noise.grid", &[1.0])]).contains("wheel_sigma_m_per_sqrt_m"));
        assert!(error(&[("effect.wheelbase.ratio", &[1.0])]).contains("wheel_mismatch"));
        assert!(error(&[("name", &[1.0])]).contains("not a number"));
        assert!(error(&[("protocol.0.runs", &[1.5])]).contains("whole number"));
        assert!(error(&[("protocol.9.runs", &[1.0])]).contains("straights"));
        assert!(error(&[("engine.kind.x", &[1.0])]).contains("single value"));
        assert!(error(&[("seed", &[1.0])]).contains("same at every point"));
        assert!(error(&[("sweep.trials", &[9.0])]).contains("same at every point"));
        let many = [1.0; 200];
        let axes: [(&str, &[f64]); 2] = [("noise.sensitivity_sigma", &many), ("placement.half_width_m", &many)];
        assert!(error(&axes).contains("40000 points"));
        assert!(error(&[("noise.sensitivity_sigma", &[])]).contains("no levels"));
        assert!(error(&[("noise.sensitivity_sigma", &[-1.0])]).contains("0 or more"));
    }
}
