//! `yair correct`: corrected poses of every row, where they start, and what is refused.

use std::fs;
use std::path::Path;

use crate::support::{document, everything_in, refusal, succeed, usage};

/// A quarter of a turn on the spot and a metre ahead, on wheels of 1 m a turn and 1000 ticks, 1/π m apart.
fn quarter(at: &Path, name: &str, truth: &str) {
    let set = at.join(name);
    fs::create_dir_all(&set).expect("made");
    let toml = "format = 1\n[robot]\nleft_wheel_diameter_m = 0.3183098861837907\nright_wheel_diameter_m = 0.3183098861837907\n\
                wheel_separation_m = 0.3183098861837907\nticks_per_rev = 1000\n[[run]]\nid = \"a\"\n";
    fs::write(set.join("dataset.toml"), toml).expect("written");
    let odometry = "run,t_s,left_ticks,right_ticks\na,0,0,0\na,1,-250,250\na,2,750,1250\n";
    fs::write(set.join("odometry.csv"), odometry).expect("written");
    let (file, rows) = truth.split_once(':').expect("a file and its rows");
    fs::write(set.join(file), rows).expect("written");
}

const POSES: &str = "truth.csv:run,t_s,x_m,y_m,theta_rad\na,0,2,3,1.5707963267948966\na,2,1,3,3.141592653589793\n";
const DISPLACEMENTS: &str = "displacement.csv:run,t0_s,t1_s,dx_m,dy_m,dtheta_rad\na,0,2,0,1,1.5707963267948966\n";

fn rows(path: &Path, separator: char) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).expect("there");
    let number = |cell: &str| cell.parse::<f64>().expect("a number");
    text.lines()
        .filter(|line| !line.starts_with("t_s"))
        .map(|line| line.split(separator).map(number).collect())
        .collect()
}

/// A few roundings of lengths of metres.
#[track_caller]
fn near(found: &[Vec<f64>], expected: &[&[f64]]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        assert!(
            found.iter().zip(*expected).all(|(found, expected)| (found - expected).abs() < 1e-14),
            "{found:?} {expected:?}"
        );
    }
}

#[test]
fn poses_start_where_the_run_was_first_seen_and_follow_the_calibration() {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    quarter(at, "set", POSES);
    quarter(at, "blind", DISPLACEMENTS);
    // Wheels twice as large, and as far apart again: turns stay, distances are twice as long.
    let calibration = "[[methods]]\nmethod = \"twice\"\n[methods.parameters]\nleft_m_per_tick = 0.002\nright_m_per_tick = 0.002\n\
                       wheel_separation_m = 0.6366197723675814\n";
    fs::write(at.join("c.toml"), calibration).expect("written");
    let found = document(at, &["correct", "set", "--calibration", "c.toml", "--out", "out"]);
    assert_eq!(found["calibration"], "twice");
    let run = &found["datasets"][0]["runs"][0];
    assert_eq!((&run["run"], &run["rows"], &run["starts_at"]), (&"a".into(), &3.into(), &"truth".into()));
    assert!((run["length_m"].as_f64().expect("a length") - 2.0).abs() < 1e-14);
    assert_eq!((&run["csv"], &run["tum"]), (&"out/a.csv".into(), &"out/a.tum".into()));
    assert!(fs::read_to_string(at.join("out/a.csv")).expect("there").starts_with("t_s,x_m,y_m,theta_rad\n"));
    near(&rows(&at.join("out/a.csv"), ','), &[&[0.0, 2.0, 3.0, FRAC_PI_2], &[1.0, 2.0, 3.0, PI], &[2.0, 0.0, 3.0, PI]]);
    near(
        &rows(&at.join("out/a.tum"), ' '),
        &[
            &[0.0, 2.0, 3.0, 0.0, 0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2],
            &[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            &[2.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        ],
    );
    // Displacements say nothing of where the run starts; several datasets get folders of their own.
    let both = document(at, &["correct", "set", "blind", "--calibration", "c.toml", "--out", "both"]);
    let run = &both["datasets"][1]["runs"][0];
    assert_eq!(run["starts_at"], "identity");
    assert!(run["starts_at_identity_why"].as_str().expect("a reason").contains("no absolute truth"));
    near(
        &rows(&at.join("both/blind/a.csv"), ','),
        &[&[0.0, 0.0, 0.0, 0.0], &[1.0, 0.0, 0.0, FRAC_PI_2], &[2.0, 0.0, 2.0, FRAC_PI_2]],
    );
    assert_eq!(fs::read(at.join("both/set/a.csv")).expect("there"), fs::read(at.join("out/a.csv")).expect("there"));
    let said = succeed(at, &["correct", "set", "--calibration", "c.toml", "--out", "more"]).stdout;
    assert_eq!(said, "1 runs, 3 corrected poses in more\n");
}

#[test]
fn an_effect_that_goes_by_the_room_is_remarked_where_a_run_starts_nowhere() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let scenario = include_str!("../../scenarios/motion-capture.toml");
    let nap = "[[effect]]\nkind = \"carpet_nap\"\ndrift_x = 0.01\n\n[[protocol]]";
    fs::write(at.join("nap.toml"), scenario.replacen("[[protocol]]", nap, 1)).expect("written");
    fs::write(at.join("none.toml"), scenario).expect("written");
    succeed(at, &["simulate", "nap.toml", "--out", "set"]);
    let correct =
        |model: &str, out: &str| succeed(at, &["correct", "set", "--calibration", model, "--out", out]).stderr;
    assert_eq!(correct("nap.toml", "with-truth"), "");
    // Positions alone give no heading to start from.
    let truth = fs::read_to_string(at.join("set/truth.csv")).expect("there");
    let blind: Vec<String> = truth
        .lines()
        .enumerate()
        .map(|(number, line)| match line.rsplit_once(',') {
            Some((others, _)) if number > 0 => format!("{others},"),
            _ => line.to_owned(),
        })
        .collect();
    fs::write(at.join("set/truth.csv"), blind.join("\n") + "\n").expect("written");
    let remarks = correct("nap.toml", "without");
    assert!(remarks.lines().any(|line| line.contains("depend on heading and place in the room")), "{remarks}");
    assert_eq!(correct("none.toml", "others"), "");
}

#[test]
fn what_cannot_be_corrected_is_refused_and_nothing_is_written() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    quarter(at, "set", POSES);
    quarter(at, "other/set", POSES);
    let method =
        |name: &str| format!("[[methods]]\nmethod = \"{name}\"\n[methods.parameters]\nwheel_separation_m = 0.3\n");
    fs::write(at.join("c.toml"), method("one")).expect("written");
    fs::write(at.join("two.toml"), method("one") + &method("two")).expect("written");
    fs::create_dir(at.join("full")).expect("made");
    fs::write(at.join("full/mine"), "mine").expect("written");
    let refused = |arguments: &[&str], beginning: &str| {
        let before = everything_in(at);
        let message = refusal(at, arguments);
        assert!(message.starts_with(beginning), "{message}");
        assert_eq!(everything_in(at), before, "{arguments:?} left something behind");
    };
    let to =
        |calibration: &'static str, out: &'static str| ["correct", "set", "--calibration", calibration, "--out", out];
    refused(&to("two.toml", "new"), "two.toml: it holds 2 calibrations (one, two); give a file with one");
    refused(&to("absent.toml", "new"), "absent.toml: ");
    refused(&to("c.toml", "full"), "full: already exists and is not an empty folder; nothing was written");
    refused(&to("c.toml", "c.toml"), "c.toml: already exists");
    refused(
        &["correct", "set", "other/set", "--calibration", "c.toml", "--out", "new"],
        "other/set: two datasets have folders of this name",
    );
    usage(at, &["correct", "set", "--out", "new"]);
    usage(at, &["correct", "set", "--calibration", "c.toml"]);
    succeed(at, &[&to("c.toml", "full")[..], &["--force"]].concat());
    assert!(at.join("full/mine").is_file() && at.join("full/a.csv").is_file());
    // An id that leads out of the folder.
    let toml = fs::read_to_string(at.join("set/dataset.toml")).expect("there");
    fs::write(at.join("set/dataset.toml"), toml.replace("\"a\"", "\"../a\"")).expect("written");
    for file in ["odometry.csv", "truth.csv"] {
        let text = fs::read_to_string(at.join("set").join(file)).expect("there");
        fs::write(at.join("set").join(file), text.replace("\na,", "\n../a,")).expect("written");
    }
    refused(&to("c.toml", "new"), "set: run \"../a\": its id is no name of a file");
}
