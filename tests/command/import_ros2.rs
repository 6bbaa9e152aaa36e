//! `yair import ros2`: bags by other writers (`tests/ros2/make_bags.py`), whole, damaged and cut off,
//! calibrate to the robot that drove them.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use yair::dataset::TruthSample;
use yair::kinematics::Wheels;
use yair::ros_bag::{RecordedGyro, RecordedRun, RecordedWheels, Recorder};

use crate::support::{document, everything_in, refusal, run_in, usage};

/// What the robot of the bags is in truth, metres: wheels left and right, and their distance.
const TRUE_M: [f64; 3] = [0.153, 0.1527, 0.309];
/// The nominal lengths are wrong by 3.0, 2.7 and 9.0 mm. What counts, poses of 0.1 mm and times of receipt
/// leave is at most 0.02 mm, in the wheelbase of every third row. Joints exchanged were seen to miss by 8 mm
/// and more.
const TOLERANCE_M: f64 = 0.5e-3;

pub(crate) const ROBOT: [&str; 4] = ["--wheel", "0.15", "--base", "0.3"];
/// Counts without a stamp in a type that nobody knows, and transforms.
const ENCODERS: [&str; 16] = [
    "--wheels",
    "/encoders",
    "--left-field",
    "left",
    "--right-field",
    "right",
    "--as",
    "ticks",
    "--ticks-per-rev",
    "4096",
    "--counter-bits",
    "16",
    "--truth",
    "/tf",
    "--truth-frames",
    "world,base_link",
];

pub(crate) fn bag(name: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests", "ros2", name].iter().collect();
    path.display().to_string()
}

/// The uncompressed file in a compressed one.
fn decompressed(name: &str) -> Vec<u8> {
    let file = fs::File::open(bag(name)).expect("a bag");
    let mut bytes = Vec::new();
    ruzstd::decoding::StreamingDecoder::new(file).expect("zstd").read_to_end(&mut bytes).expect("zstd");
    bytes
}

/// Imports, and gives the two tables and all warnings.
#[track_caller]
pub(crate) fn imported(at: &Path, bag: &str, flags: &[&str]) -> ([String; 2], String) {
    let arguments = [&["import", "ros2", bag, "--out", "new", "--force"], &ROBOT[..], flags].concat();
    let ended = run_in(at, &arguments);
    assert_eq!(ended.code, Some(0), "{arguments:?}: {}", ended.stderr);
    let table = |name: &str| fs::read_to_string(at.join("new").join(name)).expect("a table");
    (["odometry.csv", "truth.csv"].map(table), ended.stderr)
}

/// The dataset `new` calibrates to the robot.
#[track_caller]
pub(crate) fn calibrates(at: &Path) {
    let found = document(at, &["calibrate", "new"]);
    let parameters = &found["methods"][0]["parameters"];
    for (key, true_m) in ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"].iter().zip(TRUE_M) {
        let value_m = parameters[*key]["value"].as_f64().unwrap_or_else(|| panic!("{key}: {found}"));
        assert!((value_m - true_m).abs() < TOLERANCE_M, "{key}: {value_m} {true_m}");
    }
}

#[test]
fn every_compression_and_no_index_give_the_same_dataset() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let (expected, warnings) = imported(at, &bag("zstd.mcap"), &[]);
    assert_eq!(warnings, "");
    assert_eq!((expected[0].lines().count(), expected[1].lines().count()), (1 + 441, 1 + 221));
    calibrates(at);
    for name in ["plain.mcap", "unindexed.mcap"] {
        fs::write(at.join(name), decompressed(&format!("{name}.zstd"))).expect("written");
    }
    let others = [bag("lz4.mcap"), bag("plain.mcap.zstd"), "plain.mcap".to_owned(), "unindexed.mcap".to_owned()];
    for other in others {
        let found = imported(at, &other, &[]);
        assert!(found == (expected.clone(), String::new()), "{other}: {}", found.1);
    }
}

#[test]
fn bags_of_another_writer_with_counts_and_transforms_calibrate_too() {
    let temp = tempfile::tempdir().expect("a folder");
    for name in ["by_file", "by_message"] {
        let (_, warnings) = imported(temp.path(), &bag(name), &ENCODERS);
        assert!(warnings.contains("topic /encoders: no header stamps; the times of receipt are used"), "{warnings}");
        assert!(!warnings.contains("independent instrument"), "{warnings}");
        calibrates(temp.path());
    }
    // The bag's transforms of odometry are the same motion.
    let odometry = [&ENCODERS[..15], &["odom,base_link"]].concat();
    let (_, warnings) = imported(temp.path(), &bag("by_file"), &odometry);
    assert!(warnings.contains("calibration needs an independent instrument"), "{warnings}");
}

#[test]
fn wheels_on_two_topics_are_brought_to_the_left_ones_instants_and_calibrate() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let two = bag("two_topics.mcap");
    let listed = document(at, &["import", "ros2", &two, "--list"]);
    assert_eq!((&listed["wheels"], &listed["is_counted"]), (&"/left/encoder,/right/encoder".into(), &true.into()));
    let (tables, warnings) =
        imported(at, &two, &["--wheels", "/left/encoder,/right/encoder.data", "--ticks-per-rev", "4096"]);
    // The first of the left wheel's is 20 ms before the right one's first.
    assert!(
        warnings.contains("topic /left/encoder: 1 of 441 messages are without one of /right/encoder"),
        "{warnings}"
    );
    assert!(warnings.contains("no header stamps; the times of receipt are used"), "{warnings}");
    assert_eq!(tables[0].lines().count(), 1 + 440);
    calibrates(at);
    let refused = |wheels: &str, more: &[&str], why: &str| {
        let arguments = [&["import", "ros2", &two, "--out", "other", "--wheels", wheels], &ROBOT[..], more].concat();
        let message = refusal(at, &arguments);
        assert!(message.contains(why), "{message}");
    };
    refused("/left/encoder,/left/encoder", &[], "it is named for both wheels");
    refused("/left/encoder,/nope", &[], "--wheels /nope: the bag has no such topic; it has /left/encoder");
    refused("/left/encoder,/robot/pose", &[], "which number is the wheel's is not plain; say /robot/pose.PATH");
    refused("/left/encoder,/right/encoder", &["--as", "twist"], "a twist is of the robot, not of a wheel");
    refused("/left/encoder,/right/encoder", &[], "give --ticks-per-rev COUNTS");
}

#[test]
fn of_a_bag_that_is_cut_off_everything_before_the_cut_is_read() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let (whole, _) = imported(at, &bag("zstd.mcap"), &[]);
    let files = [
        ("zstd.mcap", fs::read(bag("zstd.mcap")).expect("a bag")),
        ("lz4.mcap", fs::read(bag("lz4.mcap")).expect("a bag")),
        ("plain.mcap", decompressed("plain.mcap.zstd")),
        ("unindexed.mcap", decompressed("unindexed.mcap.zstd")),
    ];
    for (name, bytes) in files {
        // The summary takes less than a third of any of them.
        let cut = bytes.len() * 3 / 5;
        fs::write(at.join(name), &bytes[..cut]).expect("written");
        let (found, warnings) = imported(at, name, &[]);
        assert!(
            warnings.contains(&format!("warning: {name}: byte ")) && warnings.contains("cut off"),
            "{name}: {warnings}"
        );
        let rows = found[0].lines().count();
        assert!((200..441).contains(&rows), "{name}: {rows}");
        assert!(whole[0].starts_with(&found[0]) && whole[1].starts_with(&found[1]), "{name}");
    }
}

#[test]
fn time_that_restarts_is_refused_or_cut_there() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let (whole, _) = imported(at, &bag("zstd.mcap"), &[]);
    fs::create_dir(at.join("twice")).expect("made");
    for name in ["twice/a_0.mcap", "twice/a_1.mcap"] {
        fs::copy(bag("zstd.mcap"), at.join(name)).expect("copied");
    }
    let message = refusal(at, &[&["import", "ros2", "twice", "--out", "other"], &ROBOT[..]].concat());
    assert!(message.contains("message 442: time runs backwards by 22.000 s"), "{message}");
    let (found, warnings) = imported(at, "twice", &["--cut", "2"]);
    assert!(warnings.contains("its 2 files were read as one bag"), "{warnings}");
    for (found, whole) in found.iter().zip(&whole) {
        let rows: Vec<&str> = whole.lines().skip(1).collect();
        let second = rows.join("\n").replace("run-01", "run-02");
        assert_eq!(*found, format!("{whole}{second}\n"));
    }
    calibrates(at);
}

#[test]
fn what_lies_behind_damage_is_read() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let (whole, _) = imported(at, &bag("zstd.mcap"), &[]);
    let good = fs::read(bag("zstd.mcap")).expect("a bag");
    let middle = good.len() / 3;
    // A byte inside a chunk; then zeros over several heads of records.
    for (count, said) in [(1, "is damaged and was left out"), (8000, "up to the next chunk at byte")] {
        let mut bad = good.clone();
        bad[middle..middle + count].iter_mut().for_each(|byte| *byte ^= if count == 1 { 0x55 } else { *byte });
        fs::write(at.join("bad.mcap"), &bad).expect("written");
        let (found, warnings) = imported(at, "bad.mcap", &[]);
        assert!(warnings.contains(said), "{warnings}");
        let (first, last) = (whole[0].lines().nth(1), whole[0].lines().last());
        assert_eq!((found[0].lines().nth(1), found[0].lines().last()), (first, last));
        assert!(found[0].lines().count() < whole[0].lines().count());
        assert!(found[0].lines().all(|line| whole[0].contains(line)));
        // Angles go on behind the gap.
        calibrates(at);
        // Cut there, two runs.
        imported(at, "bad.mcap", &["--cut", "0.3"]);
        let toml = fs::read_to_string(at.join("new/dataset.toml")).expect("a dataset");
        assert_eq!(toml.matches("[[run]]").count(), 2, "{toml}");
    }
}

#[test]
fn the_list_says_what_to_type() {
    let temp = tempfile::tempdir().expect("a folder");
    let listed = document(temp.path(), &["import", "ros2", &bag("lz4.mcap"), "--list"]);
    let topics = listed["topics"].as_array().expect("topics");
    assert_eq!(topics.len(), 2);
    assert_eq!((&topics[0]["topic"], &topics[0]["messages"]), (&"/joint_states".into(), &441.into()));
    assert_eq!((&topics[0]["may_be"], &topics[1]["may_be"]), (&"wheels".into(), &"truth".into()));
    let command = listed["command"].as_str().expect("a command");
    assert!(
        command.ends_with("--wheels /joint_states --truth /robot/pose --wheel DIAMETER_M --base SEPARATION_M"),
        "{command}"
    );
    let listed = document(temp.path(), &["import", "ros2", &bag("by_file"), "--list"]);
    let command = listed["command"].as_str().expect("a command");
    let flags = "--wheels /encoders --truth /tf --left-field left --right-field right --as WHICH --truth-frames world,base_link";
    assert!(command.contains(flags), "{command}");
    assert_eq!(everything_in(temp.path()), Vec::<PathBuf>::new());
}

#[test]
fn what_cannot_be_told_is_asked_for() {
    let temp = tempfile::tempdir().expect("a folder");
    let refused = |bag: &str, flags: &[&str], words: &[&str]| {
        let message = refusal(temp.path(), &[&["import", "ros2", bag, "--out", "new"], flags].concat());
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
    };
    let (joints, counts) = (bag("zstd.mcap"), bag("by_file"));
    refused(
        &joints,
        &[],
        &[
            "give --wheel DIAMETER_M --base SEPARATION_M, or --robot FILE with the robot's controllers.yaml, URDF or dataset.toml, like this: yair import ros2",
            "--out new",
        ],
    );
    refused(
        &joints,
        &["--wheels", "/nothing"],
        &["--wheels /nothing: the bag has no such topic; it has /joint_states, /robot/pose"],
    );
    refused(
        &joints,
        &["--left-joint", "a", "--right-joint", "wheel_right_joint"],
        &["no joint \"a\"; the joints are castor_joint"],
    );
    refused(&joints, &["--truth", "/joint_states", "--wheels", "/joint_states"], &["poses of an outside instrument"]);
    refused(&joints, &["--cut", "0.01", "--wheel", "0.15", "--base", "0.3"], &["no run is left"]);
    refused(&counts, &[], &["no topic has wheels of a known type", "--wheels TOPIC"]);
    refused(
        &counts,
        &["--wheels", "encoders", "--truth", "/tf"],
        &["--left-field PATH", "its numbers are left, right"],
    );
    let fields = &ENCODERS[..8];
    refused(&counts, fields, &["no topic has poses", "/tf", "--truth TOPIC"]);
    refused(
        &counts,
        &[fields, &["--truth", "/tf"]].concat(),
        &["--truth-frames PARENT,CHILD, one of odom,base_link world,base_link"],
    );
    let chained = [fields, &["--truth", "/tf", "--truth-frames", "odom,world"]].concat();
    refused(&counts, &chained, &["no transform from odom directly to world"]);
    refused(
        &counts,
        &ENCODERS[..8].iter().copied().chain(ENCODERS[12..].iter().copied()).collect::<Vec<_>>(),
        &["--ticks-per-rev COUNTS"],
    );
    let misnamed =
        [&["--wheels", "/encoders", "--left-field", "lefft", "--right-field", "right", "--as", "rad"], &ENCODERS[12..]]
            .concat();
    refused(&counts, &misnamed, &["message 1: no number at \"lefft\"; there are left, right"]);
    assert_eq!(everything_in(temp.path()), Vec::<PathBuf>::new());
    let wrong = usage(temp.path(), &["import", "ros2", &joints, "--out", "new", "--left-field", "a"]);
    assert!(wrong.contains("--right-field"), "{wrong}");
}

/// Our own recorder's bag: a robot that spins and drives for 20 s, its wheels 20 times a second, and a
/// gyroscope 100 times a second without those of 5 to 6 s.
fn bag_with_gyro(path: &Path, variance_rad2_s2: f64) {
    bag_of_gyro(path, variance_rad2_s2, true);
}

/// The same, with or without its poses.
fn bag_of_gyro(path: &Path, variance_rad2_s2: f64, has_truth: bool) {
    let yaw_rate = |t_s: f64| 0.5 * (0.4 * t_s).sin();
    let heading = |t_s: f64| 0.5 / 0.4 * (1.0 - (0.4 * t_s).cos());
    let rows_s: Vec<f64> = (0..=400).map(|row| 0.05 * f64::from(row)).collect();
    let truth: Vec<TruthSample> =
        rows_s.iter().map(|t_s| TruthSample::new(*t_s, 0.0, 0.0, Some(heading(*t_s)))).collect();
    // Wheels of 150 mm, 300 mm apart: half the separation over the radius, 2, is theirs to a heading.
    let turned: Vec<f64> = rows_s.iter().map(|t_s| 2.0 * heading(*t_s)).collect();
    let wheels = Wheels { left: turned.iter().map(|angle| -angle).collect(), right: turned };
    let instants = (0..=2000).map(|step| 0.01 * f64::from(step) + 0.003).filter(|t_s| !(5.0..6.0).contains(t_s));
    let gyro = RecordedGyro { yaw_rates_rad_s: instants.map(|t_s| (t_s, yaw_rate(t_s))).collect(), variance_rad2_s2 };
    let wheels = Some(RecordedWheels::Angles(wheels));
    let truth = if has_truth { &truth[..] } else { &[] };
    let run = RecordedRun { truth, rows_s: &rows_s, wheels, gyro: Some(gyro), paths: Vec::new() };
    let mut recorder = Recorder::default();
    recorder.push(&run).expect("few topics");
    fs::write(path, recorder.finish().0).expect("written");
}

/// One turn on the spot, at rest before and after.
#[test]
fn a_run_that_plainly_is_a_spin_gets_its_protocol() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let rows_s: Vec<f64> = (0..=300).map(|row| 0.05 * f64::from(row)).collect();
    let headings: Vec<f64> = rows_s.iter().map(|t_s| (0.5 * (t_s - 1.0)).clamp(0.0, std::f64::consts::TAU)).collect();
    let pose = |(t_s, heading): (&f64, &f64)| TruthSample::new(*t_s, 0.0, 0.0, Some(*heading));
    let truth: Vec<TruthSample> = rows_s.iter().zip(&headings).map(pose).collect();
    let right: Vec<f64> = headings.iter().map(|heading| 2.0 * heading).collect();
    let wheels = Some(RecordedWheels::Angles(Wheels { left: right.iter().map(|angle| -angle).collect(), right }));
    let run = RecordedRun { truth: &truth, rows_s: &rows_s, wheels, gyro: None, paths: Vec::new() };
    let mut recorder = Recorder::default();
    recorder.push(&run).expect("few topics");
    fs::write(at.join("spin.mcap"), recorder.finish().0).expect("written");
    imported(at, "spin.mcap", &[]);
    let manifest = fs::read_to_string(at.join("new/dataset.toml")).expect("a manifest");
    assert!(manifest.contains("protocol = \"spin\"\n"), "{manifest}");
}

#[test]
fn a_gyroscope_becomes_a_column_of_mean_rates_with_its_gaps() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    bag_with_gyro(&at.join("a.mcap"), 1e-6);
    let listed = document(at, &["import", "ros2", "a.mcap", "--list"]);
    assert_eq!((&listed["gyro"], &listed["topics"][0]["may_be"]), (&"/imu".into(), &"gyro".into()));
    let command = listed["command"].as_str().expect("a command");
    assert!(command.contains("--wheels /joint_states --truth /truth --gyro /imu --wheel"), "{command}");

    let arguments = [&["import", "ros2", "a.mcap", "--out", "new"], &ROBOT[..]].concat();
    let said = run_in(at, &arguments);
    let line = "gyro: /imu (sensor_msgs/msg/Imu), angular_velocity.z of imu_link, whose z is taken as up, radps, 1901 rows by header stamps (--gyro)";
    assert!(said.stdout.contains(line), "{}", said.stdout);
    let with_poses =
        "the gyro is in the column gyro_radps; calibrate, check and diagnose use the poses and leave it out";
    assert!(said.stdout.lines().any(|line| line == with_poses), "{}", said.stdout);
    assert!(said.stderr.contains("topic /imu: 23 of 400 rows of the odometry have no rates"), "{}", said.stderr);
    // It turned on the spot both ways, which is no protocol.
    let manifest = fs::read_to_string(at.join("new/dataset.toml")).expect("a manifest");
    assert!(!manifest.contains("protocol"), "{manifest}");
    let table = fs::read_to_string(at.join("new/odometry.csv")).expect("a table");
    assert!(table.starts_with("run,t_s,left_rad,right_rad,gyro_radps\n"), "{table}");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let mut empty = Vec::new();
    for pair in rows.windows(2) {
        let number = |row: &[&str], column: usize| row[column].parse::<f64>().expect("a number");
        let (from_s, to_s) = (number(&pair[0], 1), number(&pair[1], 1));
        if pair[1][4].is_empty() {
            empty.push(to_s);
            continue;
        }
        // The wheels turned twice the angle that the gyroscope saw. Its rate is not linear between messages:
        // 0.4² · 0.5 rad/s³ · (10 ms)² / 12 is 7e-7; the rate of the row's instant would be 5e-3 off.
        let turned = 0.5 * (number(&pair[1], 3) - number(&pair[0], 3)) / (to_s - from_s);
        assert!((number(&pair[1], 4) - turned).abs() < 1e-6, "{to_s}: {} {turned}", pair[1][4]);
    }
    // The first message is 3 ms late; then those intervals that reach into what is from 4.993 to 6.003 s.
    assert!(rows[0][4].is_empty() && empty.len() == 1 + 22, "{empty:?}");
    assert!(empty[0] < 0.06 && empty[1..].iter().all(|t_s| (4.99..6.06).contains(t_s)), "{empty:?}");
    assert_eq!(document(at, &["evaluate", "new"])["calibrations"][0]["runs"][0]["run"], "run-01");
}

#[test]
fn wheels_and_a_gyroscope_alone_are_a_dataset_and_wheels_alone_are_none() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    bag_with_gyro(&at.join("a.mcap"), 1e-6);
    let import = [&["import", "ros2", "a.mcap", "--out", "new", "--force"], &ROBOT[..]].concat();
    let without_truth = [&import[..], &["--truth", "none"]].concat();
    let done = run_in(at, &without_truth);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(!done.stdout.contains("leave it out") && done.stdout.contains("401 odometry rows, 0 truth rows"));
    assert!(!at.join("new/truth.csv").exists());
    assert!(fs::read_to_string(at.join("new/odometry.csv")).expect("a table").contains("gyro_radps"));
    assert_eq!(run_in(at, &["check", "new"]).code.map(|code| code < 2), Some(true));
    let found = document(at, &[&import[..], &["--gyro", "none"]].concat());
    assert!(found["took"]["gyro"].is_null() && found["datasets"][0]["truth_rows"] == 401, "{found}");
    assert!(!fs::read_to_string(at.join("new/odometry.csv")).expect("a table").contains("gyro_radps"));
    let message = refusal(at, &[&without_truth[..], &["--gyro", "none"]].concat());
    assert!(message.contains("neither poses, nor scans, nor a gyro are taken with the wheels"), "{message}");
    let message =
        refusal(at, &[&["import", "ros2", &bag("zstd.mcap"), "--out", "b", "--truth", "none"], &ROBOT[..]].concat());
    assert!(message.contains("nor a gyro") && message.contains("--gyro TOPIC"), "{message}");
    assert!(!at.join("b").exists());
    // Of a bag without poses the message and the list say what to type.
    bag_of_gyro(&at.join("b.mcap"), 1e-6, false);
    let message = refusal(at, &[&["import", "ros2", "b.mcap", "--out", "b"], &ROBOT[..]].concat());
    assert!(message.contains("or --truth none for the wheels and the gyro /imu alone"), "{message}");
    let command = document(at, &["import", "ros2", "b.mcap", "--list"])["command"].to_string();
    assert!(command.contains("--wheels /joint_states --truth none --gyro /imu --wheel"), "{command}");
    // One that measures no rate is all that there was.
    bag_with_gyro(&at.join("a.mcap"), -1.0);
    assert!(refusal(at, &without_truth).contains("its angular_velocity_covariance[0] is −1"));
}

#[test]
fn a_gyroscope_that_measures_no_rate_is_refused_by_name_or_left_out() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    bag_with_gyro(&at.join("a.mcap"), -1.0);
    let import = [&["import", "ros2", "a.mcap", "--out", "new"], &ROBOT[..]].concat();
    let why = "topic /imu: message 1: its angular_velocity_covariance[0] is −1";
    for (topic, why) in [("/imu", why), ("/truth", "expected sensor_msgs/msg/Imu"), ("/nope", "no such topic")] {
        let message = refusal(at, &[&import[..], &["--gyro", topic]].concat());
        assert!(message.contains(why), "{message}");
        assert!(!at.join("new").exists());
    }
    // Where nobody asked for it, the rest is imported.
    let found = document(at, &import);
    assert!(found["took"]["gyro"].is_null());
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains(why) && warnings.contains("the gyroscope was left out"), "{warnings}");
    assert!(!fs::read_to_string(at.join("new/odometry.csv")).expect("a table").contains("gyro"));
}

/// A bag as ROS 2 Humble records it: in SQLite, without definitions of its messages.
#[test]
fn a_bag_in_sqlite_gives_the_rows_that_are_in_it() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let whole = decompressed("humble.db3.zstd");
    fs::write(at.join("humble.db3"), &whole).expect("written");
    let (found, warnings) = imported(at, "humble.db3", &[]);
    assert_eq!((found[0].lines().count(), found[1].lines().count(), &warnings[..]), (1 + 221, 1 + 111, ""));
    calibrates(at);
    // Every second row of the other bags, to the last digit.
    let (every, _) = imported(at, &bag("zstd.mcap"), &[]);
    let odometry: Vec<&str> = every[0].lines().skip(1).step_by(2).collect();
    assert_eq!(found[0].lines().skip(1).collect::<Vec<_>>(), odometry);
    fs::create_dir(at.join("folder")).expect("made");
    fs::write(at.join("folder/humble_0.db3"), &whole).expect("written");
    assert_eq!(imported(at, "folder", &[]).0, found);
    // Pages lost: what is before them is read, and the loss is said.
    fs::write(at.join("cut.db3"), &whole[..whole.len() / 2]).expect("written");
    let ended = run_in(at, &["import", "ros2", "cut.db3", "--list"]);
    assert!(ended.code == Some(1) || ended.stderr.contains("everything before was read"), "{}", ended.stderr);
}

#[test]
fn what_is_no_bag_is_named() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let write = |name: &str, bytes: &[u8]| fs::write(at.join(name), bytes).expect("written");
    let sqlite = [&b"SQLite format 3\0"[..], &[7; 84]].concat();
    write("a.db3", &sqlite);
    write("b.mcap", &sqlite);
    write("c.bag", b"#ROSBAG V2.0\n");
    write("d.mcap", b"");
    write("e.mcap", b"t,left,right\n0,1,2\n");
    write("f.mcap.zstd", b"no zstd");
    write("g.mcap", &fs::read(bag("zstd.mcap")).expect("a bag")[..40]);
    fs::create_dir(at.join("folder")).expect("made");
    for (name, word) in [
        ("a.db3", "file is not a database"),
        ("b.mcap", "file is not a database"),
        ("c.bag", "a bag of ROS 1"),
        ("d.mcap", "an empty file"),
        ("e.mcap", "no MCAP file"),
        ("f.mcap.zstd", "no zstd"),
        ("g.mcap", "no message could be read"),
        ("folder", "no metadata.yaml"),
        ("nowhere", "no such file"),
    ] {
        let message = refusal(at, &["import", "ros2", name, "--out", "new"]);
        assert!(message.contains(word) && message.contains(name), "{name}: {message}");
    }
}
