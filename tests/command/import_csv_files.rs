//! `yair import csv` of several files: which has the wheels and which the poses, and how their times are
//! read.

use std::fs;
use std::path::Path;

use crate::import_csv::{ROBOT, Row, counts, direct, imported, log, pose, same, table};
use crate::support::{refusal, succeed, usage};

/// The robot's own twist by its nominal wheels, with a pose of its own that is off by 7 m.
fn odometry(row: &Row) -> String {
    format!("{},{},{},{},{},{}", row.t_s, row.x_m + 7.0, row.y_m, row.theta_rad, 0.3, 0.1)
}

fn refused(at: &Path, files: &[&str]) -> String {
    refusal(at, &[&["import", "csv"], files, &["--out", "new", "--force"], &ROBOT].concat())
}

fn read(at: &Path, file: &str) -> String {
    fs::read_to_string(at.join(file)).expect("read")
}

/// The first position of the truth that was written.
fn first_x_m(at: &Path) -> f64 {
    let truth = read(at, "new/truth.csv");
    truth.lines().nth(1).and_then(|row| row.split(',').nth(2)?.parse().ok()).expect("a position")
}

#[test]
fn the_poses_of_the_wheels_own_file_are_no_truth_beside_anothers() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    // A drive straight ahead, so that the constant twist is not far from it.
    let rows = log();
    table(&at.join("odom.csv"), "t,x,y,yaw,v,omega", &rows, odometry);
    table(&at.join("mocap.csv"), "t,x,y,yaw", &rows, pose);
    let with_twist = |row: &Row| format!("{},0.3,0.1", pose(row));
    table(&at.join("mocap_with_twist.csv"), "t,x,y,yaw,v,omega", &rows, with_twist);
    let units = ["--length-unit", "m", "--angle-unit", "rad"];

    // Poses alone are the truth, and it is said that the others are left out.
    for files in [["odom.csv", "mocap.csv"], ["mocap.csv", "odom.csv"]] {
        let took = imported(at, &files, &units);
        let remark = took["remarks"][0].as_str().expect("a remark");
        assert!(remark.contains("odom.csv: its own poses are left out"), "{remark}");
        assert_eq!(first_x_m(at), 0.0, "{files:?}");
    }

    // Two files that may each be either: nothing is written, and the flags of each reading are named.
    let message = refused(at, &["odom.csv", "mocap_with_twist.csv"]);
    for part in [
        "--wheels odom.csv --truth mocap_with_twist.csv",
        "--wheels mocap_with_twist.csv --truth odom.csv",
        "--wheels odom.csv --truth odom.csv --wheels mocap_with_twist.csv --truth mocap_with_twist.csv",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert!(!at.join("new/odometry.csv").exists() || first_x_m(at) == 0.0);
    for flags in [
        ["--wheels", "odom.csv", "--truth", "mocap_with_twist.csv"],
        ["--truth", "mocap_with_twist.csv", "--wheels", "odom.csv"],
    ] {
        let took = imported(at, &[], &[&flags[..], &units].concat());
        assert_eq!((first_x_m(at), took["files"][1]["left_out"].to_string()), (0.0, r#"["v","omega"]"#.to_owned()));
    }
    // With one flag the file without is the other.
    imported(at, &["odom.csv", "--truth", "mocap_with_twist.csv"], &units);
    assert_eq!(first_x_m(at), 0.0);
    imported(at, &["mocap_with_twist.csv", "--wheels", "odom.csv"], &units);
    assert_eq!(first_x_m(at), 0.0);
    let took = imported(at, &["--wheels", "odom.csv", "--truth", "odom.csv"], &units);
    assert_eq!((first_x_m(at), took["files"].as_array().map(Vec::len)), (7.0, Some(2)));

    // Beside both flags a file has no place, and one file of wheels has no two truths.
    let message = refused(at, &["mocap.csv", "--wheels", "odom.csv", "--truth", "mocap_with_twist.csv"]);
    assert!(message.contains("--wheels mocap.csv or --truth mocap.csv"), "{message}");
    fs::copy(at.join("mocap.csv"), at.join("again.csv")).expect("copied");
    table(&at.join("counts.csv"), "t,enc_l,enc_r", &rows, counts);
    let message = refused(at, &["counts.csv", "mocap.csv", "again.csv"]);
    assert!(message.contains("mocap.csv or again.csv") && message.contains("--truth FILE"), "{message}");
    let message = refused(at, &["--wheels", "mocap.csv", "--truth", "odom.csv"]);
    assert!(message.contains("mocap.csv:1") && message.contains("no columns of wheels"), "{message}");
    // A twist beside an instrument's poses is the instrument's where another file has wheels.
    let took = imported(at, &["counts.csv", "mocap_with_twist.csv"], &[]);
    assert!(took["remarks"][0].as_str().is_some_and(|remark| remark.contains("twists are left out")), "{took}");
}

#[test]
fn columns_of_files_without_a_header_are_named_for_each() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = direct(at);
    table(&at.join("counts.txt"), "", &rows, |row| format!("{},{},{}", row.right, row.left, row.t_s));
    table(&at.join("poses.txt"), "", &rows, pose);
    let files = ["--wheels", "counts.txt", "--truth", "poses.txt"];
    let message = refused(at, &files);
    assert!(message.contains("--map wheels:t=1,left=2,right=3"), "{message}");
    imported(at, &files, &["--map", "wheels:t=3,left=2,right=1,truth:t=1,x=2,y=3,theta=4"]);
    for file in ["odometry.csv", "truth.csv"] {
        assert_eq!(read(at, &format!("new/{file}")), read(at, &format!("direct/{file}")), "{file}");
    }
    // The prefix is for files that a flag names, and a wheel is none of the poses'.
    let message = refused(at, &["counts.txt", "poses.txt", "--map", "wheels:t=3,left=2,right=1"]);
    assert!(message.contains("say --wheels FILE"), "{message}");
    let typed = ["import", "csv", "counts.txt", "--out", "new", "--map", "truth:left=1"];
    assert!(usage(at, &typed).contains("left is never read of a file of --truth"));
}

#[test]
fn seconds_with_nanoseconds_and_dates_are_the_instants_that_they_say() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = direct(at);
    let rest = |row: &Row| format!("{},{},{},{},{}", row.left, row.right, row.x_m, row.y_m, row.theta_rad);
    let nanos = |row: &Row| 1_700_000_000_137_000_084_u64 + (row.t_s * 1e9).round() as u64;
    let split = |row: &Row| format!("{},{}", nanos(row) / 1_000_000_000, nanos(row) % 1_000_000_000);
    let cells = "enc_l,enc_r,x,y,theta";
    let same_tables = || {
        for file in ["odometry.csv", "truth.csv"] {
            assert_eq!(read(at, &format!("new/{file}")), read(at, &format!("direct/{file}")), "{file}");
        }
    };
    for names in ["sec,nanosec", "secs,nsecs", "header.stamp.sec,header.stamp.nanosec", "stamp_sec,stamp_nanosec"] {
        let row = |row: &Row| format!("{},{}", split(row), rest(row));
        table(&at.join("fields.csv"), &format!("{names},{cells}"), &rows, row);
        imported(at, &["fields.csv"], &[]);
        same_tables();
    }
    // Two columns of one instant, in seconds and in nanoseconds: no such pair.
    let both = |row: &Row| format!("{},{},{}", row.t_s, (row.t_s * 1e9).round(), rest(row));
    table(&at.join("both.csv"), &format!("time_s,time_ns,{cells}"), &rows, both);
    assert!(refused(at, &["both.csv"]).contains("column t may be time_s or time_ns"));
    imported(at, &["both.csv"], &["--map", "t=time_s"]);
    same_tables();

    for (between, end) in [("T", "Z"), (" ", "+00:00"), (" ", "")] {
        let dated = |row: &Row| {
            let micros = (row.t_s * 1e6).round() as u64;
            let (minutes, seconds) = (micros / 60_000_000, micros % 60_000_000);
            let clock = format!("12:{minutes:02}:{:02}.{:06}", seconds / 1_000_000, seconds % 1_000_000);
            format!("2024-03-01{between}{clock}{end},{}", rest(row))
        };
        table(&at.join("dated.csv"), &format!("time,{cells}"), &rows, dated);
        imported(at, &["dated.csv"], &[]);
        same_tables();
    }
    // A row that is no date.
    let text = read(at, "dated.csv").replacen("2024-03-01 12:00:00.050000", "yesterday", 1);
    fs::write(at.join("dated.csv"), text).expect("written");
    assert!(refused(at, &["dated.csv"]).contains("dated.csv:3: column time: \"yesterday\""));
}

#[test]
fn a_row_that_is_written_twice_is_left_out_and_a_coarse_clock_refused() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = direct(at);
    let cells = |row: &Row| format!("{},{},{},{}", counts(row), row.x_m, row.y_m, row.theta_rad);
    let doubled = |change: f64| {
        let mut doubled = rows.clone();
        doubled.insert(101, Row { left: rows[100].left + change, ..rows[100] });
        doubled
    };
    for (change, said) in [(0.0, "is left out"), (40.0, "has other values; the first is kept")] {
        table(&at.join("log.csv"), "t,enc_l,enc_r,x,y,theta", &doubled(change), cells);
        let took = imported(at, &["log.csv"], &[]);
        let remark = took["remarks"][0].as_str().expect("a remark");
        assert!(remark.starts_with("log.csv:103: ") && remark.contains(said), "{remark}");
        assert_eq!(read(at, "new/odometry.csv"), read(at, "direct/odometry.csv"));
        assert_eq!(read(at, "new/truth.csv"), read(at, "direct/truth.csv"));
    }
    // Of 1221 rows one may be doubled.
    let coarse: Vec<Row> = rows.iter().map(|row| Row { t_s: (row.t_s * 2.0).floor() / 2.0, ..*row }).collect();
    table(&at.join("coarse.csv"), "t,enc_l,enc_r,x,y,theta", &coarse, cells);
    assert!(refused(at, &["coarse.csv"]).contains("coarse.csv:3: column t: a second row at 0 s"));
}

#[test]
fn clocks_that_are_apart_are_brought_to_one_and_the_rows_stay() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = direct(at);
    table(&at.join("wheels.csv"), "t,enc_l,enc_r", &rows, counts);
    let late = |by_s: f64| {
        let late: Vec<Row> = rows.iter().map(|row| Row { t_s: row.t_s + by_s, ..*row }).collect();
        table(&at.join("mocap.csv"), "t,x,y,theta", &late, pose);
    };
    late(1000.0);
    let files = ["wheels.csv", "mocap.csv"];
    let message = refused(at, &files);
    assert!(
        message.contains("--pose-offset") && message.contains("1000.000") && message.contains("--sync"),
        "{message}"
    );
    imported(at, &files, &["--pose-offset", "1000"]);
    assert!(read(at, "new/dataset.toml").contains("[corrections]\ntruth_shift_s = -1000.0"));
    assert_eq!(read(at, "new/truth.csv").lines().nth(1), Some("run-01,1000,0,0,0"));
    same(at, "new", "direct");

    // The motion tells how far apart they are, also where they do not meet at all.
    for (by_s, start_s) in [(0.4, 0.0), (1000.4, 1000.0)] {
        late(by_s);
        let typed = [&["import", "csv", "wheels.csv", "mocap.csv", "--out", "new", "--force", "--sync"][..], &ROBOT];
        let shown = succeed(at, &typed.concat());
        assert!(shown.stderr.contains("--sync: "), "{}", shown.stderr);
        let toml = read(at, "new/dataset.toml");
        let shift = toml.split("truth_shift_s = ").nth(1).and_then(|rest| rest.lines().next()?.parse::<f64>().ok());
        // Rows are 50 ms apart; clocks that are taken to begin at once are within 0.4 s, and then found.
        let found_s = -shift.unwrap_or(-start_s);
        assert!((found_s - by_s).abs() < 0.03, "{by_s}: {toml} {}", shown.stderr);
    }
}
