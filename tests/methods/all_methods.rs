//! The bench of all methods (scenarios/methods.toml, docs/methods.md): everyone takes part, who sees
//! everything is unbiased, and the summary shows the sweep's numbers.

use crate::support::succeed;
use std::sync::LazyLock;

use serde_json::Value;

/// The scenario's path from any folder.
fn scenario() -> String {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/methods.toml").display().to_string()
}

/// The sweep's document and its printed summary, of one run.
static SWEEP: LazyLock<(Value, String)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["sweep", &scenario(), "--trials", "60", "--quiet", "--summary", "--out", "swept"];
    let shown = succeed(folder.path(), &arguments).stdout;
    let document = std::fs::read_to_string(folder.path().join("swept/sweep.json")).expect("written");
    (serde_json::from_str(&document).expect("JSON"), shown)
});

fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("{key} is no list in {value}"))
}

/// 18 biases within 4.5 of their standard errors, by 60 trials (Student, 59 degrees of freedom): a false
/// positive of 6e-4. Rejects `ivanjko` with the wheels of the whole log, where the instrument's last
/// measurement comes before the robot stands: 3.6 % of the wheelbase, 300 standard errors.
#[test]
fn every_method_takes_part_and_those_that_see_everything_are_unbiased_in_usual_conditions() {
    let usual = &list(&SWEEP.0, "points")[0];
    assert_eq!(usual["levels"]["case"], "usual");
    for method in calib::METHODS {
        assert!(list(usual, "drift").iter().any(|drift| drift["method"] == method.name()), "{}", method.name());
    }
    let mut compared = 0;
    for estimator in list(usual, "estimators") {
        let method = estimator["method"].as_str().expect("a name");
        if !["direct", "ivanjko", "linear", "censi", "segments", "augmented_kalman"].contains(&method) {
            continue;
        }
        let number = |key: &str| estimator[key].as_f64().expect("a number");
        let z = number("bias") / number("bias_mcse");
        assert!(z.abs() < 4.5, "{method} {}: {z}", estimator["parameter"]);
        compared += 1;
    }
    assert_eq!(compared, 18);
}

/// The digits before the error in brackets, as a number and with half of the last place.
fn cell(text: &str) -> (f64, f64) {
    let digits = text.split('(').next().expect("something").trim_end_matches('!');
    let places = digits.split_once('.').map_or(0, |(_, places)| places.len());
    let half = 0.5 * 10_f64.powi(-i32::try_from(places).expect("few"));
    (digits.parse().unwrap_or_else(|error| panic!("{text}: {error}")), half)
}

#[test]
fn the_summary_is_a_row_a_method_and_a_column_a_point_of_the_sweep() {
    let (found, shown) = &*SWEEP;
    assert!(shown.lines().all(|line| line.chars().count() <= 100), "{shown}");
    let points = list(found, "points");
    let mut compared = 0;
    for (title, parameter) in
        [("RMS drift", ""), ("RMSE of C_L", "left_m_per_tick"), ("RMSE of B", "wheel_separation_m")]
    {
        let table = shown.lines().skip_while(|line| !line.starts_with(title)).skip(4);
        for row in table.take_while(|line| !line.starts_with('─')) {
            let cells: Vec<&str> = row.split_whitespace().collect();
            assert_eq!(cells.len(), points.len() + 1, "{row}");
            for (text, point) in cells[1..].iter().zip(points) {
                let of = |entry: &&Value| {
                    entry["method"] == cells[0] && (parameter.is_empty() || entry["parameter"] == parameter)
                };
                let expected = if parameter.is_empty() {
                    let drift = list(point, "drift").iter().find(of).expect("a drift");
                    drift["rms_percent"].as_f64().expect("a number")
                } else {
                    let estimator = list(point, "estimators").iter().find(of).expect("an estimator");
                    let number = |key: &str| estimator[key].as_f64().expect("a number");
                    100.0 * number("rmse") / number("truth")
                };
                let (value, half) = cell(text);
                // Half of the last place, and a rounding of the product by 100.
                assert!((value - expected).abs() <= half * (1.0 + 1e-9), "{title}, {row}: {text} is not {expected}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 3 * calib::METHODS.len() * points.len());
}
