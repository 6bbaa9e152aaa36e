//! `yair import csv` of instruments beside a table of poses: gyroscopes, tapes, motion capture and joints;
//! units by their odds; protocols; and `yair import motions`.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use crate::import_csv::{
    BASE_M, ROBOT, Row, TICKS, WHEEL_M, counts, direct, drive, imported, log, pose, same, table, unit,
};
use crate::support::{document, refusal};

fn refused(at: &Path, files: &[&str], flags: &[&str]) -> String {
    refusal(at, &[&["import", "csv"], files, &["--out", "new", "--force"], flags].concat())
}

/// Yaw rates of a gyroscope at the rows, rad/s.
fn with_rates(rows: &[Row]) -> Vec<(Row, f64)> {
    let rate = |index: usize| {
        let (from, to) = (rows[index.saturating_sub(1)], rows[(index + 1).min(rows.len() - 1)]);
        (to.theta_rad - from.theta_rad) / (to.t_s - from.t_s)
    };
    rows.iter().enumerate().map(|(index, row)| (*row, rate(index))).collect()
}

fn gyro_table(file: &Path, header: &str, rows: &[(Row, f64)], scale: f64) {
    let body: String = rows.iter().map(|(row, rate)| format!("{},{}\n", counts(row), rate * scale)).collect();
    fs::write(file, format!("{header}\n{body}")).expect("written");
}

#[test]
fn a_gyroscope_or_a_tape_takes_the_place_of_poses() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = log();
    let rates = with_rates(&rows);
    // Degrees a second by the wheels' turns; by the user's word; and the same rates in radians a second.
    gyro_table(&at.join("deg.csv"), "t,enc_l,enc_r,gyro_z", &rates, 180.0 / PI);
    gyro_table(&at.join("named.csv"), "t,enc_l,enc_r,spin", &rates, 180.0 / PI);
    gyro_table(&at.join("rad.csv"), "t,enc_l,enc_r,angular_velocity_z", &rates, 1.0);
    let mut separations = Vec::new();
    for (file, flags, expected) in [
        ("deg.csv", &["--truth", "none"][..], "deg/s"),
        ("named.csv", &["--map", "gyro=spin[deg/s]"], "deg/s"),
        ("rad.csv", &[], "rad/s"),
    ] {
        let took = imported(at, &[file], flags);
        assert_eq!(unit(&took, "gyro"), expected);
        let remarks = took["remarks"].to_string();
        assert!(remarks.contains("no file has poses") && remarks.contains("a gyroscope alone"), "{remarks}");
        assert_eq!(remarks.contains("--map omega=angular_velocity_z"), file == "rad.csv", "{remarks}");
        assert!(at.join("new/gyro.csv").exists() && !at.join("new/truth.csv").exists());
        // A gyroscope whose scale is known tells the separation of the stated wheels.
        let manifest = fs::read_to_string(at.join("new/dataset.toml")).expect("read");
        fs::write(at.join("new/dataset.toml"), manifest + "\n[gyro]\nscale_sigma = 0.001\n").expect("written");
        let found = document(at, &["calibrate", "new", "--method", "joint", "--force"]);
        separations.push(found["methods"][0]["parameters"]["wheel_separation_m"]["value"].as_f64().expect("a value"));
    }
    // The stated wheels are 2 % short, and a gyroscope tells their ratio to the separation: 309 / 1.019.
    assert!(separations.iter().all(|base_m| (base_m - 0.3032).abs() < 0.001), "{separations:?}");

    // Against the wheels it is refused where nothing else measures, else left out.
    gyro_table(&at.join("down.csv"), "t,enc_l,enc_r,gyro_z", &rates, -1.0);
    assert!(refused(at, &["down.csv"], &ROBOT).contains("its z axis points down"));
    table(&at.join("mocap.csv"), "t,x,y,theta", &rows, pose);
    let took = imported(at, &["down.csv", "mocap.csv"], &[]);
    assert!(took["remarks"].to_string().contains("the gyroscope is left out"), "{took}");
    assert!(!at.join("new/gyro.csv").exists());
    table(&at.join("wheels.csv"), "t,enc_l,enc_r", &rows, counts);
    let message = refused(at, &["wheels.csv"], &ROBOT);
    assert!(message.contains("--truth FILE") && message.contains("--tape"), "{message}");

    // A push of 3 m by the wheels' true sizes, with a tape beside it.
    let push = drive(&[(0.0, 0.0, 20), (0.3, 0.0, 200), (0.0, 0.0, 20)]);
    table(&at.join("push.csv"), "t,enc_l,enc_r", &push, counts);
    let took = imported(at, &["push.csv"], &["--tape", "3.0"]);
    assert!(took["remarks"].to_string().contains("a tape alone"), "{took}");
    let distance = fs::read_to_string(at.join("new/distance.csv")).expect("distances");
    assert_eq!(distance.lines().nth(1), Some("run-01,0,12,3,0.002"));
    assert!(fs::read_to_string(at.join("new/dataset.toml")).expect("read").contains("protocol = \"straight\""));
    fs::write(at.join("tape.csv"), "run,t0,t1,metres\nrun-01,0.5,11.5,3.001\n").expect("written");
    imported(at, &["push.csv"], &["--tape", "tape.csv"]);
    let distance = fs::read_to_string(at.join("new/distance.csv")).expect("distances");
    assert_eq!(distance.lines().nth(1), Some("run-01,0.5,11.5,3.001,0.002"));
    let message = refused(at, &["push.csv", "--tape", "300"], &ROBOT);
    assert!(message.contains("the tape says 300 m") && message.contains("2.9"), "{message}");
    fs::write(at.join("tape.csv"), "run,t0,t1,metres\nrun-7,0.5,11.5,3.001\n").expect("written");
    let message = refused(at, &["push.csv", "--tape", "tape.csv"], &ROBOT);
    assert!(message.contains("tape.csv:2: no run \"run-7\"; the runs are: run-01"), "{message}");
}

#[test]
fn units_that_a_wrongly_stated_robot_may_pass_for_are_asked_with_their_odds() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = log();
    let rates: Vec<Row> = {
        let mut rates = rows.clone();
        for (row, pair) in rates[1..].iter_mut().zip(rows.windows(2)) {
            let rate = |before: f64, after: f64| (after - before) * 2.0 * PI / TICKS * 20.0;
            (row.left, row.right) = (rate(pair[0].left, pair[1].left), rate(pair[0].right, pair[1].right));
        }
        rates
    };
    let cells = |row: &Row| format!("{},{},{},{},{},{}", row.t_s, row.left, row.right, row.x_m, row.y_m, row.theta_rad);
    table(&at.join("rates.csv"), "t,vel_l,vel_r,x_m,y_m,theta", &rates, cells);
    assert_eq!(unit(&imported(at, &["rates.csv"], &[]), "left"), "rad/s");
    // Of wheels that are stated three times too large the same log may be in turns a minute.
    let message = refused(at, &["rates.csv"], &["--wheel", "0.45", "--base", "0.9"]);
    for part in ["may be rad/s (poses reach 0.3", "rpm (poses reach 3.", "--wheel-unit rad/s or --wheel-unit rpm"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    // Metres and millimetres are decided whatever is stated; centimetres are not, where it is stated wrongly.
    let small = |row: &Row| format!("{},{},{},{}", counts(row), row.x_m * 1e3, row.y_m * 1e3, row.theta_rad);
    table(&at.join("small.csv"), "t,enc_l,enc_r,x,y,theta", &rows, small);
    table(&at.join("named.csv"), "t,enc_l,enc_r,x_mm,y_mm,theta", &rows, small);
    let took = imported(at, &["small.csv"], &[]);
    assert_eq!((unit(&took, "x"), unit(&took, "left")), ("mm".to_owned(), "ticks".to_owned()));
    assert!(took["files"][0]["columns"].to_string().contains("odds"), "{took}");
    assert_eq!(took["remarks"].to_string(), "[]");
    let off = ["--ticks-per-rev", "2048", "--wheel", "0.15", "--base", "0.3"];
    let message = refused(at, &["small.csv"], &off);
    assert!(message.contains("mm (poses reach 0.5") && message.contains("add --length-unit mm or"), "{message}");
    // What is named is believed, and it is said how far off the robot is.
    let typed = [&["import", "csv", "named.csv", "--out", "new", "--force", "--angle-unit", "rad"][..], &off].concat();
    let took = document(at, &typed)["took"].clone();
    assert!(took["remarks"].to_string().contains("times as far") && unit(&took, "left") == "ticks", "{took}");
}

#[test]
fn wheels_that_are_logged_by_what_they_moved_since_the_row_before_are_summed() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = direct(at);
    let mut steps = rows.clone();
    for (row, pair) in steps[1..].iter_mut().zip(rows.windows(2)) {
        (row.left, row.right) = (pair[1].left - pair[0].left, pair[1].right - pair[0].right);
    }
    let write = |name: &str, scale: f64| {
        let cells = |row: &Row| {
            let [left, right] = [row.left, row.right].map(|step| step * scale);
            format!("{},{left},{right},{},{},{}", row.t_s * 1e3, row.x_m, row.y_m, row.theta_rad)
        };
        table(&at.join(name), "millis,dl,dr,x,y,theta", &steps, cells);
    };
    let map = ["--map", "left=dl,right=dr"];
    write("counts.csv", 1.0);
    // Whole numbers that are no counter's by how far the robot goes, and by the user's word.
    let took = imported(at, &["counts.csv"], &map);
    assert_eq!((unit(&took, "left"), unit(&took, "t")), ("ticks/row".to_owned(), "ms".to_owned()));
    same(at, "new", "direct");
    imported(at, &["counts.csv"], &[&map[..], &["--wheel-unit", "ticks/row"]].concat());
    same(at, "new", "direct");
    write("angles.csv", 2.0 * PI / TICKS);
    imported(at, &["angles.csv"], &[&map[..], &["--wheel-unit", "rad/row"]].concat());
    same(at, "new", "direct");
    write("metres.csv", PI * WHEEL_M / TICKS);
    imported(at, &["metres.csv"], &[&map[..], &["--wheel-unit", "m/row"]].concat());
    same(at, "new", "direct");
}

#[test]
fn motion_capture_and_joints_are_read_as_their_programs_write_them() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = direct(at);
    table(&at.join("wheels.csv"), "t,enc_l,enc_r", &rows, counts);
    // y is up, and what is left of x is -z.
    let motive = |row: &Row| {
        let (sin, cos) = (0.5 * row.theta_rad).sin_cos();
        format!("0,{},0,0,0,1,9,9,9,0,{sin},0,{cos},{},0.1,{}", row.t_s, row.x_m, -row.y_m)
    };
    let names = |of: &str| [of; 7].join(",");
    let header = format!(
        "Format Version,1.23,Take Name,t,Rotation Type,Quaternion,Length Units,Meters\n\n,Type,{0},{0}\n,Name,{1},{2}\n\
         ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\n\
         Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z,W,X,Y,Z",
        names("Rigid Body"),
        names("arena"),
        names("robot")
    );
    table(&at.join("take.csv"), &header, &rows, motive);
    let message = refused(at, &["wheels.csv", "take.csv"], &ROBOT);
    assert!(message.contains("--body arena or --body robot"), "{message}");
    let took = imported(at, &["wheels.csv", "take.csv"], &["--body", "robot"]);
    assert!(took["remarks"].to_string().contains("body robot, y is up"), "{took}");
    same(at, "new", "direct");

    // Joints by their names, though the table has two speeds too.
    let joints = |row: &Row| {
        let [left, right] = [row.left, row.right].map(|count| count * 2.0 * PI / TICKS);
        format!("{},wheel_right_joint,wheel_left_joint,{right},{left},0.1,0.2", row.t_s)
    };
    table(
        &at.join("joints.csv"),
        "time,name[0],name[1],position[0],position[1],velocity[0],velocity[1]",
        &rows,
        joints,
    );
    table(&at.join("mocap.csv"), "t,x,y,theta", &rows, pose);
    imported(at, &["joints.csv", "mocap.csv"], &[]);
    same(at, "new", "direct");
    // And by the user's word without them.
    let bare = fs::read_to_string(at.join("joints.csv")).expect("read").replace("name[", "title[");
    fs::write(at.join("joints.csv"), bare).expect("written");
    let flags = ["--map", "left=position[1],right=position[0]", "--wheel-unit", "rad"];
    imported(at, &["joints.csv", "mocap.csv"], &flags);
    same(at, "new", "direct");
}

#[test]
fn pairs_of_motions_calibrate_without_times() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = log();
    let (mut by_wheels, mut seen) = (String::new(), String::new());
    for pair in rows.windows(10).step_by(9) {
        let (from, to) = (pair[0], pair[9]);
        let m = |count: f64| count * PI * WHEEL_M / TICKS;
        let (left_m, right_m) = (m(to.left - from.left), m(to.right - from.right));
        let (distance_m, turn_rad) = ((left_m + right_m) / 2.0, (right_m - left_m) / BASE_M);
        let chord_m = if turn_rad == 0.0 { distance_m } else { distance_m * (turn_rad / 2.0).sin() / (turn_rad / 2.0) };
        let (sin, cos) = (turn_rad / 2.0).sin_cos();
        by_wheels += &format!("{} {} {turn_rad}\n", chord_m * cos, chord_m * sin);
        let (x_m, y_m, (sin, cos)) = (to.x_m - from.x_m, to.y_m - from.y_m, from.theta_rad.sin_cos());
        seen += &format!("{} {} {}\n", cos * x_m + sin * y_m, cos * y_m - sin * x_m, to.theta_rad - from.theta_rad);
    }
    fs::write(at.join("odometry.txt"), by_wheels).expect("written");
    fs::write(at.join("scans.txt"), seen).expect("written");
    let typed = ["import", "motions", "odometry.txt", "scans.txt", "--out", "new", "--wheel", "0.15", "--base", "0.3"];
    let found = document(at, &typed);
    assert!(found["took"]["remarks"].to_string().contains("a row is taken as 1 s"), "{found}");
    let found = document(at, &["calibrate", "new", "--method", "joint"]);
    let value = |key: &str| found["methods"][0]["parameters"][key]["value"].as_f64().expect("a value");
    // Counts are whole and poses rounded to 0.1 mm, over pieces of some centimetres each.
    assert!((value("left_wheel_diameter_m") - 0.153).abs() < 3e-4, "{found}");
    assert!((value("right_wheel_diameter_m") - 0.1527).abs() < 3e-4, "{found}");
    assert!((value("wheel_separation_m") - 0.309).abs() < 3e-3, "{found}");
}
