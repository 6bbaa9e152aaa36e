//! Logs of other people's robots, with the command lines of docs/real-robots.md: each is right, or refused
//! with the reason. Robots, instruments, sources and right values: the README of `data/field`.

use std::path::Path;

use serde_json::Value;

use crate::support::real_data::real_data;
use crate::support::{Ended, run_in, succeed};

const KEYS: [&str; 3] = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];

/// Value and standard deviation of each length, millimetres; `None` of what is not determined.
fn calibrated(folder: &Path, sets: &[&str]) -> [Option<[f64; 2]>; 3] {
    let ended = succeed(folder, &[&["calibrate"], sets, &["--json", "--quiet"]].concat());
    let found: Value = serde_json::from_str(&ended.stdout).expect("a document");
    KEYS.map(|key| {
        let of = &found["methods"][0]["parameters"][key];
        Some([of["value"].as_f64()? * 1e3, of["sigma"].as_f64()? * 1e3])
    })
}

/// Within the range of the README, widened by two standard deviations that are at most five per cent.
#[track_caller]
fn within(found: Option<[f64; 2]>, range_mm: [f64; 2]) {
    let [value, sigma] = found.expect("determined");
    assert!(sigma < 0.05 * value, "{value} ± {sigma}");
    let [low, high] = [range_mm[0] - 2.0 * sigma, range_mm[1] + 2.0 * sigma];
    assert!((low..=high).contains(&value), "{value} ± {sigma} is not in {range_mm:?}");
}

/// Refused, with a message that has these words.
#[track_caller]
fn refused(ended: &Ended, words: &[&str]) {
    let has_words = words.iter().all(|word| ended.stderr.contains(word));
    assert!(ended.code == Some(1) && has_words, "{}", ended.stderr);
}

/// Imports the two tables of a robot as a dataset of the robot's name.
fn imported(data: &Path, folder: &Path, name: &str, truth: &str, robot: &[&str]) {
    let [wheels, truth] = ["wheels", truth].map(|of| data.join(format!("{name}_{of}.csv")).display().to_string());
    succeed(folder, &[&["import", "csv", &wheels, &truth, "--out", name, "--quiet"], robot].concat());
}

const KOBUKI: [&str; 8] = ["--wheel", "0.07", "--base", "0.23", "--ticks-per-rev", "2578.33", "--counter-bits", "16"];

#[test]
fn a_kobuki_under_motion_capture_whose_clock_is_late_is_right() {
    let Some(data) = real_data("field_logs", "field") else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    for name in ["turtlebot0", "turtlebot1", "turtlebot2", "turtlebot3"] {
        imported(&data, folder, name, "mocap", &KOBUKI);
        let [left, right, separation] = calibrated(folder, &[name]);
        within(left, [69.4, 70.1]);
        within(right, [69.4, 70.1]);
        // Runs that turn one way leave it open beside unequal wheels.
        if let Some(separation) = separation {
            within(Some(separation), [233.0, 235.0]);
        }
    }
    let all = calibrated(folder, &["turtlebot0", "turtlebot1", "turtlebot2", "turtlebot3"]);
    for (found, range_mm) in all.into_iter().zip([[69.4, 70.1], [69.4, 70.1], [233.0, 235.0]]) {
        within(found, range_mm);
    }
}

#[test]
fn a_robot_whose_right_encoder_counts_backwards_is_told_so_and_right_once_that_is_mended() {
    let Some(data) = real_data("field_logs", "field") else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    for name in ["mocapbot0", "mocapbot3"] {
        imported(&data, folder, name, "mocap", &["--wheel", "0.1524", "--base", "0.6", "--wheel-unit", "mm/s"]);
        let refused = run_in(folder, &["calibrate", name]);
        assert_eq!(refused.code, Some(1), "{}", refused.stdout);
        assert!(refused.stderr.contains("error: wheel_backwards: the right wheel"), "{}", refused.stderr);
        assert!(!refused.stderr.contains("names another"), "{}", refused.stderr);
        let manifest = folder.join(name).join("dataset.toml");
        let text = std::fs::read_to_string(&manifest).expect("written");
        let mended = text.replace("[robot]", "[corrections]\nreverse_right_wheel = true\n\n[robot]");
        std::fs::write(&manifest, mended).expect("written");
    }
    // Rates that reach the log in bursts up to half a second apart do not say what the wheels did: no number,
    // and what was driven instead of a cause.
    let refused = run_in(folder, &["calibrate", "mocapbot0"]);
    assert_eq!(refused.code, Some(1), "{}", refused.stdout);
    assert!(refused.stderr.contains("does not follow the wheels closely enough"), "{}", refused.stderr);
    assert!(!refused.stderr.contains("hardly turn"), "{}", refused.stderr);
    assert_eq!(calibrated(folder, &["mocapbot3"])[2], None, "it hardly turns");
}

#[test]
fn robots_that_skid_have_the_separation_by_which_they_turn_whatever_is_stated() {
    let Some(data) = real_data("field_logs", "field") else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let warthog = |base: &str, name: &str| {
        let robot = ["--wheel", "0.6", "--base", base, "--wheel-unit", "rad", "--length-unit", "m", "--force"];
        imported(&data, folder, name, "icp", &robot);
    };
    for name in ["warthog_660", "warthog_720"] {
        warthog("1.1652", name);
        let [left, right, separation] = calibrated(folder, &[name]);
        within(separation, [1700.0, 1870.0]);
        // On straights 587 to 596; turns in which it loses travel pull a wheel down by three per cent at
        // most.
        for wheel in [left, right] {
            within(wheel, [0.97 * 587.0, 596.0]);
        }
        let said = run_in(folder, &["calibrate", name]).stderr;
        assert!(said.contains("times the stated one") && said.contains("skids"), "{said}");
        // One minute tells of the loss in turns in one log, and not in the other.
        let loss = if name == "warthog_720" { "shortens the distance driven by " } else { "do not show by how much" };
        assert!(said.contains(loss), "{said}");
    }
    let [.., by_ruler] = calibrated(folder, &["warthog_720"]);
    let [by_ruler, sigma] = by_ruler.expect("determined");
    for base in ["0.6", "2.4", "3.5"] {
        warthog(base, "warthog_720");
        let [value, _] = calibrated(folder, &["warthog_720"])[2].expect("determined");
        assert!((value - by_ruler).abs() < 0.1 * sigma, "{value} from {base}, {by_ruler} ± {sigma}");
    }
    for base in ["0.393", "0.5", "0.7", "1.2"] {
        let text = std::fs::read_to_string(data.join("penn24/dataset.toml")).expect("there");
        let set = folder.join("penn24");
        std::fs::create_dir_all(&set).expect("made");
        for table in ["odometry.csv", "gyro.csv"] {
            std::fs::write(set.join(table), std::fs::read(data.join("penn24").join(table)).expect("there"))
                .expect("written");
        }
        let stated = text.replace("wheel_separation_m = 0.393", &format!("wheel_separation_m = {base}"));
        std::fs::write(set.join("dataset.toml"), stated).expect("written");
        within(calibrated(folder, &["penn24"])[2], [910.0, 940.0]);
    }
}

#[test]
fn pairs_of_relative_motions_without_times_are_right() {
    let Some(data) = real_data("field_logs", "field") else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let [odometry, scans] =
        ["odom", "scanmatched"].map(|of| data.join(format!("freiburg_{of}_motions.txt")).display().to_string());
    let robot = ["--wheel", "0.2", "--base", "0.4", "--out", "freiburg", "--quiet"];
    succeed(folder, &[&["import", "motions", &odometry, &scans], &robot[..]].concat());
    // As the README has them, to the digit that it states.
    for (found, stated_mm) in calibrated(folder, &["freiburg"]).into_iter().zip([200.4, 200.8, 390.5]) {
        within(found, [stated_mm - 0.1, stated_mm + 0.1]);
    }
}

/// Questions that people asked: what the README of each case says is right.
#[test]
fn questions_that_people_asked_are_answered() {
    let Some(data) = real_data("field_logs", "field") else { return };
    let cases = data.join("../../field-cases");
    if !cases.is_dir() {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let import = |name: &str, files: &[&str], robot: &[&str]| {
        let files: Vec<String> = files
            .iter()
            .map(
                |file| if file.starts_with("--") { (*file).to_owned() } else { cases.join(file).display().to_string() },
            )
            .collect();
        let files: Vec<&str> = files.iter().map(String::as_str).collect();
        run_in(folder, &[&["import", "csv"], &files[..], robot, &["--out", name]].concat())
    };
    const ROBOT: [&str; 4] = ["--wheel", ".16", "--base", ".4"];
    let ticks = |more: &[&'static str]| [&ROBOT[..], &["--ticks-per-rev", "2048"], more].concat();

    let own = ["own_odometry_as_truth/odom.csv", "own_odometry_as_truth/mocap.csv"];
    let ended = import("own", &own, &ROBOT);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    within(calibrated(folder, &["own"])[2], [430.0, 430.0]);
    let both = ["own_odometry_as_truth/odom.csv", "own_odometry_as_truth/mocap_with_twist.csv"];
    refused(&import("both", &both, &ROBOT), &["--wheels", "--truth"]);

    let seconds = ["sec_nanosec/wheels.csv", "sec_nanosec/truth.csv"];
    assert_eq!(import("seconds", &seconds, &ticks(&[])).code, Some(0));
    within(calibrated(folder, &["seconds"])[2], [400.0, 400.0]);

    let speeds = ["rad_s_read_as_rpm/wheels.csv", "rad_s_read_as_rpm/truth.csv"];
    let large = ["--wheel", ".3302", "--base", ".5708"];
    refused(&import("speeds", &speeds, &large), &["rpm", "rad/s"]);
    assert_eq!(
        import("speeds", &speeds, &[&large[..], &["--wheel-unit", "rad/s", "--length-unit", "m"]].concat()).code,
        Some(0)
    );
    assert!(run_in(folder, &["calibrate", "speeds"]).stderr.contains("0.500 times as large as stated"));

    let spin = ["short_spin/wheels.csv", "short_spin/truth.csv"];
    assert_eq!(import("spin", &spin, &ticks(&["--length-unit", "m"])).code, Some(0));
    let check = run_in(folder, &["check", "spin"]).stdout;
    assert!(!check.contains("ticks_per_turn") && check.contains("determined by these runs: none"), "{check}");

    let one_way = ["one_way_false/wheels.csv", "one_way_false/truth.csv"];
    assert_eq!(import("one-way", &one_way, &ticks(&[])).code, Some(0));
    assert!(!run_in(folder, &["check", "one-way"]).stdout.contains("one_way_turns"));

    let turned = ["turned_tag/wheels.csv", "turned_tag/truth.csv"];
    assert_eq!(import("turned", &turned, &ticks(&[])).code, Some(0));
    let drift = |arguments: &[&str]| {
        let found: Value = serde_json::from_str(&succeed(folder, arguments).stdout).expect("a document");
        found["calibrations"][0]["drift_percent"].as_f64().expect("a drift")
    };
    let nominal = drift(&["evaluate", "turned", "--json", "--quiet"]);
    assert!((0.1..0.35).contains(&nominal), "{nominal} %, about 0.2 is right");

    for mount in ["mountA", "mountB"] {
        let files = [format!("tag_remounted/{mount}_wheels.csv"), format!("tag_remounted/{mount}_truth.csv")];
        let robot = ["--wheel", ".07", "--base", ".23", "--ticks-per-rev", "2578"];
        assert_eq!(import(mount, &files.each_ref().map(String::as_str), &robot).code, Some(0));
    }
    let ended = succeed(folder, &["calibrate", "mountA", "mountB"]);
    // By 2.6 degrees, to the two hundredths that a log knows.
    let turned_by = ["2.58", "2.59", "2.60", "2.61", "2.62"];
    let is_said = turned_by.iter().any(|by| ended.stderr.contains(&format!("the instrument turned by {by}°")));
    assert!(is_said, "{}", ended.stderr);
    let [left, right, separation] = calibrated(folder, &["mountA", "mountB"]);
    within(left, [70.0, 70.0]);
    within(right, [69.7, 69.7]);
    within(separation, [234.0, 234.0]);

    let skid = folder.join("skid");
    std::fs::create_dir_all(&skid).expect("made");
    for file in ["dataset.toml", "odometry.csv", "gyro.csv"] {
        std::fs::write(skid.join(file), std::fs::read(cases.join("skid_factor_2.3").join(file)).expect("there"))
            .expect("written");
    }
    within(calibrated(folder, &["skid"])[2], [920.0, 920.0]);
    assert!(run_in(folder, &["calibrate", "skid"]).stderr.contains("skids"));
}
