//! `--robot` and `export --into`: what a robot's own files say of it, and calibrated values back in them.

use std::fs;
use std::path::Path;

use crate::export::CALIBRATION;
use crate::import_ros2::{bag, calibrates};
use crate::support::{document, refusal, run_in, succeed, usage};

/// The lengths of a dataset's robot: wheels left and right, and their distance.
fn robot_of(set: &Path) -> [f64; 3] {
    let text = fs::read_to_string(set.join("dataset.toml")).expect("a dataset");
    let robot: toml::Table =
        toml::from_str::<toml::Table>(&text).expect("TOML")["robot"].as_table().expect("one").clone();
    ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"]
        .map(|key| robot[key].as_float().expect("a length"))
}

/// Every format that says lengths: the file's name, further flags, and how far off it may be.
const FORMATS: [(&str, &str, &[&str], f64); 11] = [
    ("c", "odometry.h", &["--ticks-per-rev", "10000"], 1e-9),
    ("clearpath", "robot.yaml", &[], 1e-9),
    ("create3", "control.yaml", &[], 1e-9),
    // Counts of a turn are whole: half a count of 9900.
    ("linorobot2", "lino_base_config.h", &[], 1.1e-5),
    // Micrometres.
    ("mm", "table.txt", &[], 1e-6),
    ("roadrunner", "TankDrive.java", &["--ticks-per-rev", "10000"], 1e-9),
    ("ros2-yaml", "controllers.yaml", &[], 1e-9),
    ("turtlebot3", "burger.yaml", &[], 1e-9),
    ("urdf", "robot.urdf", &[], 1e-9),
    ("wpilib", "DriveCalibration.java", &[], 1e-9),
    ("ros2-yaml", "no_ending", &[], 1e-9),
];

#[test]
fn every_export_is_read_back_as_the_robot() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    for (format, file, flags, tolerance_m) in FORMATS {
        succeed(at, &["export", format, "c.toml", "--out", file]);
        let import = ["import", "ros2", &bag("zstd.mcap"), "--out", "set", "--force", "--robot", file];
        let ended = succeed(at, &[&import, flags].concat());
        assert!(
            ended.stdout.starts_with("robot: wheels ") && ended.stdout.contains(file),
            "{format}: {}",
            ended.stdout
        );
        // Formats with one radius have the geometric mean.
        let mean_m = (0.202_f64 * 0.198).sqrt();
        let wheels_m = if ["roadrunner", "turtlebot3"].contains(&format) { [mean_m; 2] } else { [0.202, 0.198] };
        for (found_m, expected_m) in robot_of(&at.join("set")).into_iter().zip([wheels_m[0], wheels_m[1], 0.408]) {
            assert!((found_m - expected_m).abs() < tolerance_m, "{format}: {found_m} {expected_m}");
        }
    }
    // A covariance says no length.
    succeed(at, &["export", "robot-localization", "c.toml", "--out", "ekf.yaml"]);
    let why = refusal(at, &["import", "ros2", &bag("zstd.mcap"), "--out", "new", "--robot", "ekf.yaml"]);
    assert!(
        why.starts_with("ekf.yaml: it has no wheel_separation and no wheel_radius (its nodes: ekf_filter_node)"),
        "{why}"
    );
}

#[test]
fn a_bag_with_the_robots_description_needs_no_numbers() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let described = bag("described.mcap");
    let import = ["import", "ros2", &described, "--out", "new", "--force"];
    let ended = succeed(at, &import);
    let robot = "robot: wheels 150.000 mm, 300.000 mm apart, joints wheel_left_joint and wheel_right_joint, by /robot_description of the bag (URDF) (--robot)\n";
    assert!(ended.stdout.starts_with(robot) && ended.stderr.is_empty(), "{} {}", ended.stdout, ended.stderr);
    assert_eq!(robot_of(&at.join("new")), [0.15, 0.15, 0.3]);
    calibrates(at);
    // The command that --list prints needs them neither, and that of a bag without one does.
    assert!(!succeed(at, &["import", "ros2", &described, "--list"]).stdout.contains("--wheel "));
    assert!(succeed(at, &["import", "ros2", &bag("zstd.mcap"), "--list"]).stdout.contains("--wheel DIAMETER_M"));
    // Flags and files come first; a file that says twice the radius is remarked.
    succeed(at, &[&import[..], &["--wheel", "0.16"]].concat());
    assert_eq!(robot_of(&at.join("new")), [0.16, 0.16, 0.3]);
    let yaml = fs::read_to_string(bag("controllers.yaml")).expect("there");
    fs::write(at.join("a.yaml"), yaml.replace("wheel_radius: 0.075", "wheel_radius: 0.15")).expect("written");
    let said = succeed(at, &[&import[..], &["--robot", "a.yaml"]].concat()).stderr;
    let twice = "warning: the wheels' diameter is 300.0 mm by --robot and 150.0 mm by /robot_description of the bag";
    assert!(said.contains(twice) && said.contains("is the radius a diameter?"), "{said}");
    // One that says the same is not.
    assert_eq!(succeed(at, &[&import[..], &["--robot", &bag("controllers.yaml")]].concat()).stderr, "");
    assert_eq!(robot_of(&at.join("new")), [0.15, 0.15, 0.3]);
}

#[test]
fn every_importer_takes_the_robots_file() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let yaml = bag("controllers.yaml");
    let rows = |columns: &str, row: fn(usize) -> String| {
        std::iter::once(columns.to_owned()).chain((0..40).map(row)).collect::<Vec<_>>().join("\n") + "\n"
    };
    let drive = |k: usize| (0.05 * k as f64, 0.02 * k as f64);
    let table = rows("t [s],left [rad],right [rad],x [m],y [m],theta [rad]", |k| {
        let k = k as f64;
        format!("{:.2},{:.4},{:.4},{:.4},0,0", 0.05 * k, 0.27 * k, 0.27 * k, 0.02 * k)
    });
    fs::write(at.join("log.csv"), table).expect("written");
    let tum: String = (0..40).map(drive).map(|(t_s, x_m)| format!("{t_s:.2} {x_m:.4} 0 0 0 0 0 1\n")).collect();
    fs::write(at.join("truth.tum"), &tum).expect("written");
    fs::write(at.join("odom.tum"), &tum).expect("written");
    let motions = "0.1 0 0.1\n0.1 0 0\n0.1 0.01 0.2\n";
    fs::write(at.join("odometry.txt"), motions).expect("written");
    fs::write(at.join("scans.txt"), motions).expect("written");
    for import in [
        &["csv", "log.csv"][..],
        &["tum", "truth.tum", "--odometry", "odom.tum"],
        &["motions", "odometry.txt", "scans.txt"],
    ] {
        let without = [&["import"], import, &["--out", "set", "--force"]].concat();
        let why = refusal(at, &without);
        assert!(
            why.contains(
                ", or --robot FILE with the robot's controllers.yaml, URDF or dataset.toml, like this: yair import"
            ),
            "{why}"
        );
        succeed(at, &[&without[..], &["--robot", &yaml]].concat());
        assert_eq!(robot_of(&at.join("set")), [0.15, 0.15, 0.3], "{import:?}");
    }
}

#[test]
fn values_are_put_into_the_robots_own_file_and_nothing_else_changes() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    let before = fs::read_to_string(bag("controllers.yaml")).expect("there").replace('\n', "\r\n");
    fs::write(at.join("own.yaml"), &before).expect("written");
    let into = ["export", "ros2-yaml", "c.toml", "--into", "own.yaml"];
    let dry = succeed(at, &[&into[..], &["--dry-run"]].concat());
    assert!(dry.stdout.starts_with("--- own.yaml\n+++ own.yaml\n@@ -16,3 +16,3 @@\n"), "{}", dry.stdout);
    assert_eq!(fs::read_to_string(at.join("own.yaml")).expect("there"), before);
    let ended = succeed(at, &into);
    assert_eq!((ended.stdout, &ended.stderr[..]), (dry.stdout, ""));
    let after = fs::read_to_string(at.join("own.yaml")).expect("there");
    // The bytes around the five values that changed are the same; the factors are of the file's own lengths.
    let mut expected = before.clone();
    for (old, new) in [
        ("separation_multiplier: 1.0 ", "separation_multiplier: 1.36 "),
        ("left_wheel_radius_multiplier: 1.0 ", "left_wheel_radius_multiplier: 1.346666667 "),
        ("right_wheel_radius_multiplier: 1.0 ", "right_wheel_radius_multiplier: 1.32 "),
        (
            "pose_covariance_diagonal: [0.001, 0.001, 1000000.0, 1000000.0, 1000000.0, 0.01]",
            "pose_covariance_diagonal: [5.00e-7, 4.00e-6, 1000000.0, 1000000.0, 1000000.0, 1.20e-5]",
        ),
        (
            "twist_covariance_diagonal: [0.001, 0.001, 1000000.0, 1000000.0, 1000000.0, 0.01]",
            "twist_covariance_diagonal: [6.25e-6, 6.25e-6, 1000000.0, 1000000.0, 1000000.0, 1.50e-4]",
        ),
    ] {
        assert!(expected.contains(old), "{old}");
        expected = expected.replacen(old, new, 1);
    }
    assert_eq!(after, expected);
    let again = document(at, &into);
    assert_eq!((&again["into"], &again["diff"], &again["text"]), (&"own.yaml".into(), &"".into(), &().into()));
    assert_eq!(succeed(at, &into).stdout, "own.yaml: has these values already; nothing to change\n");
    // What it says now is the calibration.
    succeed(at, &["import", "ros2", &bag("zstd.mcap"), "--out", "set", "--robot", "own.yaml"]);
    for (found_m, expected_m) in robot_of(&at.join("set")).into_iter().zip([0.202, 0.198, 0.408]) {
        assert!((found_m - expected_m).abs() < 1e-9, "{found_m} {expected_m}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_and_permissions_stay() {
    use std::os::unix::fs::PermissionsExt;
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    fs::create_dir(at.join("src")).expect("made");
    fs::copy(bag("robot.urdf"), at.join("src/robot.urdf")).expect("copied");
    fs::set_permissions(at.join("src/robot.urdf"), fs::Permissions::from_mode(0o640)).expect("set");
    std::os::unix::fs::symlink("src/robot.urdf", at.join("robot.urdf")).expect("a link");
    succeed(at, &["export", "urdf", "c.toml", "--into", "robot.urdf"]);
    assert!(at.join("robot.urdf").symlink_metadata().expect("there").is_symlink());
    let target = at.join("src/robot.urdf");
    assert_eq!(target.metadata().expect("there").permissions().mode() & 0o777, 0o640);
    let text = fs::read_to_string(&target).expect("there");
    assert!(text.contains("radius=\"0.101\"") && text.contains("xyz=\"0 -0.204 0.075\""), "{text}");
}

#[test]
fn what_is_no_file_of_such_a_robot_is_refused_with_what_to_do() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let write = |name: &str, text: &str| fs::write(at.join(name), text).expect("written");
    write("c.toml", CALIBRATION);
    write("x.urdf", "<robot><xacro:macro name=\"wheel\"/></robot>");
    write("mecanum.yaml", "base:\n  ros__parameters:\n    kinematics.wheels_radius: 0.1\n");
    write("mm.yaml", "base:\n  ros__parameters:\n    wheel_radius: 75.0\n    wheel_separation: 300.0\n");
    write(
        "ackermann.yaml",
        "base:\n  ros__parameters:\n    type: a/AckermannSteeringController\n    wheel_radius: 0.2\n",
    );
    write(
        "two.yaml",
        "a:\n  wheel_radius: 0.1\n  wheel_separation: 0.3\nb:\n  wheel_radius: 0.2\n  wheel_separation: 0.3\n",
    );
    for (file, expected) in [
        ("x.urdf", "x.urdf: it is a xacro, whose values ROS computes; write them out: xacro FILE > robot.urdf"),
        ("mecanum.yaml", "mecanum.yaml: base is a mecanum_drive_controller; yair calibrates differential drives"),
        ("ackermann.yaml", "ackermann.yaml: base is a a/AckermannSteeringController; yair calibrates"),
        ("mm.yaml", "mm.yaml: wheel diameter: 150 m is no robot's; metres are expected: 0.15 for millimetres"),
        ("two.yaml", "two.yaml: it has the wheels of a, b; choose one by --controller NAME"),
    ] {
        let why = refusal(at, &["import", "ros2", &bag("zstd.mcap"), "--out", "new", "--robot", file]);
        assert!(why.starts_with(expected), "{why}");
        assert!(!at.join("new").exists());
        if file.ends_with("yaml") && file != "mm.yaml" {
            let before = fs::read(at.join(file)).expect("there");
            let why = refusal(at, &["export", "ros2-yaml", "c.toml", "--into", file]);
            assert!(why.starts_with(expected), "{why}");
            assert_eq!(fs::read(at.join(file)).expect("there"), before);
        }
    }
    let chosen = ["import", "ros2", &bag("zstd.mcap"), "--out", "new", "--robot", "two.yaml", "--controller", "b"];
    succeed(at, &chosen);
    assert_eq!(robot_of(&at.join("new")), [0.4, 0.4, 0.3]);
    let own = refusal(at, &["export", "c", "c.toml", "--into", "two.yaml"]);
    assert!(
        own.starts_with("c is a file of its own, and is put into no other; give --out FILE. --into takes clearpath,"),
        "{own}"
    );
    let tum = run_in(at, &["export", "tum", "new", "--into", "two.yaml"]);
    assert_eq!(tum.code, Some(2), "{}", tum.stderr);
    assert!(usage(at, &["export", "mm", "c.toml", "--into", "a", "--out", "b"]).contains("cannot be used with"));
}
