//! The report of a diagnosis: what it says is what was found, its links lead somewhere, and its residuals
//! show the effect before the extension and not after.

use std::path::Path;

use crate::support::succeed;
use serde_json::Value;

/// Chance of a covariate's binned means along the robot, if they are the same in all bins: under the
/// calibrated and the extended model.
fn chances(residuals: &Value, covariate: &str, component: &str) -> (f64, f64) {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let against = list(&residuals["against"]);
    let own = against.iter().find(|against| against["covariate"] == covariate).expect("a covariate that varies");
    let own = list(&own["components"]).into_iter().find(|own| own["component"] == component).expect("a component");
    let chance = |of: &str| own[of]["varies_p_value"].as_f64().expect("a chance");
    (chance("before"), chance("after"))
}

#[test]
fn a_report_shows_what_was_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motion-capture.toml");
    succeed(dir, &["simulate", &scenario.display().to_string(), "--out", "robot"]);
    succeed(dir, &["diagnose", "robot", "--out", "diagnosis"]);
    let out = dir.join("diagnosis");
    let report = std::fs::read_to_string(out.join("report.md")).expect("a report");
    // The right wheel is hidden 0.3 % eccentric.
    let verdict = report.lines().nth(2).expect("a verdict");
    assert!(verdict.contains("the right wheel's radius varies by 0.30"), "{verdict}");
    for heading in
        ["What was found", "Residuals", "Checks of the residuals", "Alternatives", "Next experiment", "Calibration"]
    {
        assert!(report.contains(&format!("\n## {heading}\n")), "{heading}");
    }
    // The page for a browser says the same first, and loads nothing.
    let page = std::fs::read_to_string(out.join("report.html")).expect("a page");
    let (first_screen, below) = page.split_once("<nav").expect("a first screen");
    let first_screen = first_screen.split_once("<header").expect("a header").1;
    for part in [
        "not round or not centred",
        "radius varies by 0.30",
        "± ",
        "makes no measurable difference to the drift",
        "Circles with a radius of",
    ] {
        assert!(first_screen.contains(part), "no {part}: {first_screen}");
    }
    for part in ["id=\"path\"", "yair correct robot --calibration diagnosis", "right_wheel_diameter_m", "square_cw_000"]
    {
        assert!(below.contains(part), "no {part}");
    }
    // The bound of the project for this demonstration.
    assert!(page.len() < 1_000_000 && !page.contains("src=\"http"), "{} bytes", page.len());
    let folder_of_machine = dir.display().to_string();
    assert!(!page.contains(&folder_of_machine), "it names a folder that the user did not type");
    let links = report.split("](").skip(1).map(|rest| rest.split(')').next().expect("a target"));
    for link in links {
        assert!(out.join(link).is_file(), "{link} leads nowhere");
    }
    let text = std::fs::read_to_string(out.join("residuals.json")).expect("residuals");
    let residuals: Value = serde_json::from_str(&text).expect("JSON");
    // z = 23 is spread over twelve bins and three components; what the extended model leaves passes at 1e-3.
    // The left wheel never shows: at 1e-3 each.
    let (before, after) = chances(&residuals, "right_wheel_phase", "along");
    assert!(before < 1e-6 && after > 1e-3, "{before} {after}");
    let (before, after) = chances(&residuals, "left_wheel_phase", "along");
    assert!(before > 1e-3 && after > 1e-3, "{before} {after}");
}

/// What is found without a name is written, driven by the command, and found again.
#[test]
fn a_term_of_no_name_goes_from_the_command_to_the_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path();
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motion-capture.toml"));
    let mut scenario: toml::Table = text.expect("the shipped scenario").parse().expect("TOML");
    let term = "channel = \"along\"\ncovariates = [\"|omega|\"]\ncoefficient = 0.004\nkind = \"term\"";
    let term: toml::Table = term.parse().expect("TOML");
    let effects = scenario["effect"].as_array_mut().expect("effects");
    // The calibration's three stay.
    effects.truncate(3);
    effects.push(term.into());
    std::fs::write(dir.join("hidden.toml"), scenario.to_string()).expect("written");
    succeed(dir, &["simulate", "hidden.toml", "--out", "robot"]);
    succeed(dir, &["diagnose", "robot", "--out", "first"]);
    succeed(dir, &["simulate", "first/extended.toml", "--out", "again"]);
    succeed(dir, &["diagnose", "again", "--out", "second"]);
    for out in ["first", "second"] {
        let text = std::fs::read_to_string(dir.join(out).join("findings.json")).expect("findings");
        let found: Value = serde_json::from_str(&text).expect("JSON");
        let term = &found["findings"][0]["unlisted_term"];
        assert_eq!(found["verdict"], "unlisted", "{out}: {}", found["sentence"]);
        assert_eq!((&term["channel"], &term["covariates"]), (&"along".into(), &vec!["|omega|"].into()), "{out}");
    }
}
