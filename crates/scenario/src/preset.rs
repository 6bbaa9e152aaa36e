//! Presets: `preset = "ideal-servo"` under `[robot]` stands for a whole table of values, so that a scenario
//! of one's own needs the robot's lengths and counts of a turn alone. What the scenario itself states comes
//! before the preset; what is read is the whole scenario, and is written as such.

use toml::{Table, Value};

use crate::robot::QUADRATURE_DECODING;

/// Presets by name, with their tables.
const PRESETS: [(&str, &str); 1] = [("ideal-servo", include_str!("preset/ideal_servo.toml"))];

/// A scenario whose robot has a preset, in full; `None` where it has none.
///
/// # Errors
/// What is wrong with the preset, or with what it needs.
pub(crate) fn expanded(text: &str) -> Result<Option<Table>, String> {
    // What is no TOML is told by who reads the scenario, with its line.
    let Ok(mut scenario) = toml::from_str::<Table>(text) else { return Ok(None) };
    let Some(Value::Table(robot)) = scenario.get_mut("robot") else { return Ok(None) };
    let Some(name) = robot.remove("preset") else { return Ok(None) };
    let known = || PRESETS.map(|(name, _)| format!("\"{name}\"")).join(", ");
    let preset = PRESETS.iter().find(|(known, _)| name.as_str() == Some(*known));
    let (_, preset) = preset.ok_or_else(|| format!("[robot]: preset = {name}; known are {}", known()))?;
    let mut preset: Table = toml::from_str(preset).map_err(|error| error.message().to_owned())?;

    if let Some(diameter) = robot.remove("wheel_diameter_m") {
        for key in ["left_wheel_diameter_m", "right_wheel_diameter_m"] {
            robot.entry(key).or_insert(diameter.clone());
        }
    }
    for key in ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"] {
        if !robot.contains_key(key) {
            return Err(format!("[robot]: a preset has no {key}; state wheel_diameter_m and wheel_separation_m"));
        }
    }
    let has_lines = robot.get("encoder").and_then(Value::as_table).is_some_and(|of| of.contains_key("lines_per_rev"));
    let counts = robot.remove("ticks_per_rev");
    let number = counts.as_ref().and_then(|of| of.as_float().or_else(|| of.as_integer().map(|of| of as f64)));
    match (number, has_lines) {
        (Some(counts), false) => {
            let gear = robot.get("encoder").and_then(|of| of.get("gear_ratio")?.as_float()).unwrap_or(1.0);
            let lines = Value::Float(counts / gear / QUADRATURE_DECODING);
            if let Some(Value::Table(robot)) = preset.get_mut("robot")
                && let Some(Value::Table(encoder)) = robot.get_mut("encoder")
            {
                encoder.insert("lines_per_rev".to_owned(), lines);
            }
        }
        (None, true) => {}
        (None, false) => return Err("[robot]: a preset has no ticks_per_rev, the counts of a wheel turn".to_owned()),
        (Some(_), true) => {
            return Err("[robot]: ticks_per_rev and encoder.lines_per_rev say the same; state one".to_owned());
        }
    }
    complete_instruments(&mut scenario, &preset);
    complete(&mut scenario, &preset);
    Ok(Some(scenario))
}

/// Adds what a table does not have. An engine of another kind has no keys of the preset's.
fn complete(table: &mut Table, preset: &Table) {
    for (key, value) in preset {
        match (table.get_mut(key), value) {
            (None, _) => {
                table.insert(key.clone(), value.clone());
            }
            (Some(Value::Table(own)), Value::Table(of))
                if own.get("kind").is_none_or(|kind| of.get("kind") == Some(kind)) =>
            {
                complete(own, of);
            }
            _ => {}
        }
    }
}

/// Completes each instrument by that of its kind in the preset. Protocols are stated in full.
fn complete_instruments(scenario: &mut Table, preset: &Table) {
    let key = "instrument";
    let (Some(Value::Array(own)), Some(Value::Array(of))) = (scenario.get_mut(key), preset.get(key)) else { return };
    for table in own.iter_mut().filter_map(Value::as_table_mut) {
        let same = of.iter().filter_map(Value::as_table).find(|of| of.get("kind") == table.get("kind"));
        if let Some(same) = same {
            complete(table, same);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::Scenario;

    /// Eight lines.
    fn text() -> String {
        "name = \"mine\"\nseed = 1\neffect = [{ kind = \"wheelbase\", ratio = 1.02 }]\n[robot]\npreset = \"ideal-servo\"\n\
         wheel_diameter_m = 0.15\nwheel_separation_m = 0.3\nticks_per_rev = 4096\n"
            .to_owned()
    }

    #[test]
    fn a_robot_needs_its_lengths_and_counts_and_is_written_in_full() {
        let scenario = Scenario::parse(&text(), "mine.toml").expect("a scenario");
        let nominal = scenario.robot.nominal();
        assert_eq!((nominal.left_wheel_diameter_m, nominal.right_wheel_diameter_m), (0.15, 0.15));
        assert_eq!((nominal.wheel_separation_m, nominal.ticks_per_rev), (0.3, Some(4096.0)));
        assert_eq!((scenario.instruments.len(), scenario.protocols.len(), scenario.effects.len()), (1, 3, 1));
        let full = scenario.to_toml().expect("TOML");
        assert!(!full.contains("preset"), "{full}");
        assert_eq!(Scenario::parse(&full, "full.toml").expect("in full"), scenario);
    }

    #[test]
    fn what_is_stated_comes_before_the_preset() {
        let own = text()
            + "[[instrument]]\nkind = \"motion_capture\"\nrate_hz = 100.0\n[[protocol]]\nkind = \"spins\"\nturn_rad = 3.0\nruns = 2\n\
               [engine]\nkind = \"stepping\"\nstep_s = 0.001\n[noise]\nsensitivity_sigma = 0.01\n[robot.motor]\nsupply_v = 12.0\n";
        let scenario = Scenario::parse(&own, "own.toml").expect("a scenario");
        let crate::Instrument::MotionCapture { rate_hz, sigma_xy_m, .. } = scenario.instruments[0] else {
            panic!("one")
        };
        assert_eq!((rate_hz, sigma_xy_m), (100.0, 0.0003));
        assert_eq!((scenario.protocols.len(), scenario.noise.sensitivity_sigma), (1, 0.01));
        assert_eq!((scenario.noise.wheel_sigma_m_per_sqrt_m, scenario.robot.motor.supply_v), (0.0005, 12.0));
        assert_eq!(scenario.engine, crate::Engine::Stepping { step_s: 0.001 });
        let wheels =
            text().replace("wheel_diameter_m = 0.15", "wheel_diameter_m = 0.15\nright_wheel_diameter_m = 0.16");
        let nominal = Scenario::parse(&wheels, "own.toml").expect("a scenario").robot.nominal();
        assert_eq!((nominal.left_wheel_diameter_m, nominal.right_wheel_diameter_m), (0.15, 0.16));
    }

    #[test]
    fn what_a_preset_cannot_know_is_asked_for() {
        for (old, new, expected) in [
            ("ideal-servo", "ideal", "mine.toml: [robot]: preset = \"ideal\"; known are \"ideal-servo\""),
            (
                "wheel_separation_m = 0.3\n",
                "",
                "mine.toml: [robot]: a preset has no wheel_separation_m; state wheel_diameter_m",
            ),
            (
                "ticks_per_rev = 4096\n",
                "",
                "mine.toml: [robot]: a preset has no ticks_per_rev, the counts of a wheel turn",
            ),
            (
                "ticks_per_rev = 4096\n",
                "ticks_per_rev = 4096\nencoder.lines_per_rev = 3\n",
                "mine.toml: [robot]: ticks_per_rev and encoder.lines_per_rev",
            ),
            ("ticks_per_rev = 4096\n", "ticks_per_rev = 4096\nspeed = 3\n", "mine.toml: unknown field `speed`"),
        ] {
            let why = Scenario::parse(&text().replace(old, new), "mine.toml").expect_err(new).to_string();
            assert!(why.starts_with(expected), "{why}");
        }
    }
}
