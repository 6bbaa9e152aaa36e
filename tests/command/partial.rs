//! A gyro, a tape measure and a mark on the floor, as a user calibrates with them.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{document, refusal, run_in, succeed};

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/gyro-and-tape.toml");

/// What the scenario hides: wheels 1 % larger, the right one smaller by 0.2 % and the left one larger as
/// much, a wheelbase 1.5 % wider.
fn truth(folder: &Path) -> [f64; 3] {
    let text = fs::read_to_string(folder.join("robot.truth.json")).expect("written");
    let truth: Value = serde_json::from_str(&text).expect("JSON");
    ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"]
        .map(|key| truth[key].as_f64().expect("a number"))
}

fn parameters(folder: &Path) -> [Value; 3] {
    let _ = fs::remove_file(folder.join("robot.toml"));
    let found = document(folder, &["calibrate", "robot", "--out", "robot.toml"]);
    ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"]
        .map(|key| found["methods"][0]["parameters"][key].clone())
}

fn determined(folder: &Path) -> [bool; 3] {
    let found = document(folder, &["check", "robot"]);
    ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"]
        .map(|key| found["determined"][key].as_bool().expect("a truth value"))
}

#[test]
fn gyro_tape_and_whole_turns_determine_a_robot_and_each_of_them_is_missed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeed(folder, &["simulate", SCENARIO, "--out", "robot"]);
    let truth = truth(folder);
    assert_eq!(determined(folder), [true; 3]);
    for (found, truth) in parameters(folder).iter().zip(truth) {
        let (value, sigma) = (found["value"].as_f64().expect("a value"), found["sigma"].as_f64().expect("a sigma"));
        // Four standard deviations: one draw in 16 000 is farther off. The wheelbase's is 0.012 % by the
        // sweep.
        assert!((value - truth).abs() < 4.0 * sigma, "{value} ± {sigma}, not {truth}");
        assert!(sigma < 3e-4 * truth, "{value} ± {sigma}");
    }

    // Without whole turns the gyro's scale is all that says how far the robot turns.
    fs::remove_file(folder.join("robot/revisit.csv")).expect("removed");
    assert_eq!(determined(folder), [true, true, false]);
    let [left, right, separation] = parameters(folder);
    assert!(left["value"].is_number() && right["value"].is_number());
    assert!(separation["value"].is_null(), "{separation}");
    let text = succeed(folder, &["calibrate", "robot", "--out", "again.toml"]).stdout;
    assert!(text.contains("the gyro's scale is not known"), "{text}");

    // A scale that is stated is the wheelbase's uncertainty. The simulated one is off by 1 %.
    let manifest = folder.join("robot/dataset.toml");
    let unstated = fs::read_to_string(&manifest).expect("written");
    fs::write(&manifest, unstated.replace("[gyro]", "[gyro]\nscale_sigma = 0.01")).expect("written");
    assert_eq!(determined(folder), [true; 3]);
    let [_, _, separation] = parameters(folder);
    let sigma = separation["sigma"].as_f64().expect("a sigma") / truth[2];
    assert!((sigma / 0.01 - 1.0).abs() < 0.05, "{sigma}");
    fs::write(&manifest, unstated).expect("written");

    // Without a tape nothing has a length.
    fs::remove_file(folder.join("robot/distance.csv")).expect("removed");
    let message = refusal(folder, &["calibrate", "robot", "--quiet", "--out", "none.toml"]);
    assert!(message.contains("determine no parameter by itself"), "{message}");
    let evaluated = run_in(folder, &["evaluate", "robot", "--calibration", "again.toml"]);
    assert!(evaluated.stdout.contains("no absolute truth"), "{} {}", evaluated.stdout, evaluated.stderr);
    // A gate on what is not known must not pass. The table comes before it.
    let gated = run_in(folder, &["evaluate", "robot", "--max-drift", "5", "--json"]);
    assert_eq!(gated.code, Some(1), "{}", gated.stderr);
    assert!(gated.stderr.contains("--max-drift: the drift of these runs is not known"), "{}", gated.stderr);
}

const BESIDE_POSES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/beside-poses.toml");

#[test]
fn a_gyro_tapes_and_marks_beside_poses_make_them_more_certain_and_each_tells_the_truth() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeed(folder, &["simulate", BESIDE_POSES, "--out", "robot"]);
    assert!(problems(folder).is_empty());
    let truth = truth(folder);
    let sigmas = || parameters(folder).each_ref().map(|found| found["sigma"].as_f64().expect("a sigma"));
    let all = sigmas();
    for (found, truth) in parameters(folder).iter().zip(truth) {
        let (value, sigma) = (found["value"].as_f64().expect("a value"), found["sigma"].as_f64().expect("a sigma"));
        // Four standard deviations: one draw in 16 000 is farther off.
        assert!((value - truth).abs() < 4.0 * sigma, "{value} ± {sigma}, not {truth}");
    }
    fs::remove_file(folder.join("robot/distance.csv")).expect("removed");
    let without_tape = sigmas();
    // A tape of 1 mm is several times as exact over 3 m as poses of 10 mm at 1 Hz.
    assert!(all[0] < 0.95 * without_tape[0], "{all:?} {without_tape:?}");
}

/// Problems of measurements that are not used.
fn problems(folder: &Path) -> Vec<Value> {
    let found = document(folder, &["check", "robot"]);
    let all = found["problems"].as_array().expect("problems").clone();
    all.into_iter().filter(|problem| problem["id"] == "unused_measurements").collect()
}

#[test]
fn measurements_beside_displacements_are_said_to_be_unused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let robot = folder.join("robot");
    fs::create_dir(&robot).expect("made");
    let manifest = "format = 1\n[robot]\nleft_wheel_diameter_m = 0.16\nright_wheel_diameter_m = 0.16\n\
                    wheel_separation_m = 0.363\n[[run]]\nid = \"a\"\n";
    fs::write(robot.join("dataset.toml"), manifest).expect("written");
    let rows: String = (0..=100).map(|row| format!("a,{0},{0},{0}\n", 0.1 * f64::from(row))).collect();
    fs::write(robot.join("odometry.csv"), format!("run,t_s,left_rad,right_rad\n{rows}")).expect("written");
    let displacement = "run,t0_s,t1_s,dx_m,dy_m,dtheta_rad\na,0,5,0.4,0,0\na,5,10,0.4,0,0\n";
    fs::write(robot.join("displacement.csv"), displacement).expect("written");
    assert!(problems(folder).is_empty());
    let table = "run,t0_s,t1_s,distance_m,sigma_m\na,0,10,0.8,0.002\n";
    fs::write(robot.join("distance.csv"), table).expect("written");
    let found = problems(folder);
    assert!(found.len() == 1 && found[0]["severity"] == "warning", "{found:?}");
}
