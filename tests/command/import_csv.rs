//! `yair import csv`: however a log is written, its calibration is that of the same data as a dataset.

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{document, everything_in, refusal, succeed, usage};

/// A row of a log: what a robot of 153.0 and 152.7 mm wheels, 309 mm apart, counts and where it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub(crate) t_s: f64,
    pub(crate) left: f64,
    pub(crate) right: f64,
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) theta_rad: f64,
}

pub(crate) const WHEEL_M: f64 = 0.15;
pub(crate) const BASE_M: f64 = 0.3;
pub(crate) const TICKS: f64 = 4096.0;
pub(crate) const ROBOT: [&str; 6] = ["--wheel", "0.15", "--base", "0.3", "--ticks-per-rev", "4096"];

/// Rows of 50 ms along pieces of (speed, yaw rate, rows), in arcs; poses are rounded to tenths of a
/// millimetre, which is their noise.
pub(crate) fn drive(pieces: &[(f64, f64, usize)]) -> Vec<Row> {
    let row = |t: usize, [left_m, right_m]: [f64; 2], [x_m, y_m, theta_rad]: [f64; 3]| Row {
        t_s: t as f64 / 20.0,
        left: (left_m / (PI * 0.153) * TICKS).floor(),
        right: (right_m / (PI * 0.1527) * TICKS).floor(),
        x_m: (x_m * 1e4).round() / 1e4,
        y_m: (y_m * 1e4).round() / 1e4,
        theta_rad: (theta_rad * 1e4).round() / 1e4,
    };
    let (mut wheels, mut pose, mut rows) = ([0.0, 0.0], [0.0, 0.0, 0.0], Vec::new());
    rows.push(row(0, wheels, pose));
    for &(speed, yaw_rate, count) in pieces {
        for _ in 0..count {
            let (moved, turned) = (speed / 20.0, yaw_rate / 20.0);
            let chord = if turned == 0.0 { moved } else { moved * (turned / 2.0).sin() / (turned / 2.0) };
            let heading: f64 = pose[2] + turned / 2.0;
            pose = [pose[0] + chord * heading.cos(), pose[1] + chord * heading.sin(), pose[2] + turned];
            wheels = [wheels[0] + moved - turned * 0.309 / 2.0, wheels[1] + moved + turned * 0.309 / 2.0];
            rows.push(row(rows.len(), wheels, pose));
        }
    }
    rows
}

/// Straights, spins both ways and arcs, 61 s.
pub(crate) fn log() -> Vec<Row> {
    drive(&[(0.3, 0.0, 120), (0.0, 0.5, 260), (0.3, 0.0, 120), (0.0, -0.5, 260), (0.3, 0.3, 230), (0.3, -0.3, 230)])
}

/// Writes a table of the cells that `cells` makes of each row.
pub(crate) fn table(file: &Path, header: &str, rows: &[Row], cells: impl Fn(&Row) -> String) {
    let body: String = rows.iter().map(|row| cells(row) + "\n").collect();
    let header = if header.is_empty() { String::new() } else { format!("{header}\n") };
    fs::write(file, header + &body).expect("written");
}

/// The same data written as a dataset by hand.
pub(crate) fn dataset(dir: &Path, columns: &str, rows: &[(&str, Row)], odometry: impl Fn(&Row) -> String) {
    fs::create_dir(dir).expect("made");
    let mut ids: Vec<&str> = rows.iter().map(|(run, _)| *run).collect();
    ids.dedup();
    let runs: String = ids.iter().map(|id| format!("[[run]]\nid = \"{id}\"\n")).collect();
    let toml = format!(
        "format = 1\n[robot]\nleft_wheel_diameter_m = {WHEEL_M}\nright_wheel_diameter_m = {WHEEL_M}\n\
         wheel_separation_m = {BASE_M}\nticks_per_rev = {TICKS}\n{runs}"
    );
    fs::write(dir.join("dataset.toml"), toml).expect("written");
    let of = |header: &str, cells: &dyn Fn(&Row) -> String| {
        let body: String = rows.iter().map(|(run, row)| format!("{run},{}\n", cells(row))).collect();
        format!("{header}\n{body}")
    };
    fs::write(dir.join("odometry.csv"), of(&format!("run,t_s,{columns}"), &odometry)).expect("written");
    fs::write(dir.join("truth.csv"), of("run,t_s,x_m,y_m,theta_rad", &pose)).expect("written");
}

/// The rows of [`log`], and a dataset `direct` of their counts and poses.
pub(crate) fn direct(at: &Path) -> Vec<Row> {
    let rows = log();
    let of_run: Vec<(&str, Row)> = rows.iter().map(|row| ("run-01", *row)).collect();
    dataset(&at.join("direct"), "left_ticks,right_ticks", &of_run, counts);
    rows
}

pub(crate) fn counts(row: &Row) -> String {
    format!("{},{},{}", row.t_s, row.left, row.right)
}

pub(crate) fn pose(row: &Row) -> String {
    format!("{},{},{},{}", row.t_s, row.x_m, row.y_m, row.theta_rad)
}

/// Values of the calibration of a dataset.
fn calibrated(at: &Path, dataset: &str) -> Vec<f64> {
    let found = document(at, &["calibrate", dataset]);
    let parameters = &found["methods"][0]["parameters"];
    let value = |key: &str| parameters[key]["value"].as_f64().unwrap_or_else(|| panic!("{key}: {found}"));
    ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"].map(value).to_vec()
}

/// Both calibrate to the same: what differs is the last bit of numbers that were written in other units. One
/// unit of any quantity in another would differ by 2.5 times at least.
#[track_caller]
pub(crate) fn same(at: &Path, imported: &str, direct: &str) {
    let (found, expected) = (calibrated(at, imported), calibrated(at, direct));
    let close = found.iter().zip(&expected).all(|(found, expected)| (found / expected - 1.0).abs() < 1e-8);
    assert!(close, "{found:?} {expected:?}");
}

/// Imports and says what was taken.
#[track_caller]
pub(crate) fn imported(at: &Path, files: &[&str], flags: &[&str]) -> Value {
    let out = ["--out", "new", "--force"];
    document(at, &[&["import", "csv"], files, &out, &ROBOT, flags].concat())["took"].clone()
}

/// The unit of a quantity in the first file that has it.
pub(crate) fn unit(took: &Value, quantity: &str) -> String {
    let files = took["files"].as_array().expect("files");
    let columns = files.iter().flat_map(|file| file["columns"].as_array().expect("columns"));
    let column = columns.into_iter().find(|column| column["quantity"] == quantity);
    column.unwrap_or_else(|| panic!("{quantity}: {took}"))["unit"].as_str().expect("a unit").to_owned()
}

#[test]
fn counts_and_poses_in_one_file_calibrate_as_the_dataset_however_they_are_written() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = direct(at);

    let cells = |row: &Row| format!("{},{},{},{}", counts(row), row.x_m, row.y_m, row.theta_rad);
    table(&at.join("log.csv"), "t,ticks_left,ticks_right,x,y,theta", &rows, cells);
    imported(at, &["log.csv"], &[]);
    // The very same numbers.
    for file in ["odometry.csv", "truth.csv"] {
        let read = |dir: &str| fs::read_to_string(at.join(dir).join(file)).expect("read");
        assert_eq!(read("new"), read("direct"), "{file}");
    }
    same(at, "new", "direct");

    table(&at.join("bare.csv"), "", &rows, cells);
    let message = refusal(at, &[&["import", "csv", "bare.csv", "--out", "no"][..], &ROBOT].concat());
    assert!(message.contains("--map t=1,left=2,right=3,x=4,y=5,theta=6"), "{message}");
    imported(at, &["bare.csv"], &["--map", "t=1,left=2,right=3,x=4,y=5,theta=6"]);
    same(at, "new", "direct");

    // As a German spreadsheet has it.
    let german = |row: &Row| {
        let cells =
            format!("{};{};{};{};{};{}", row.t_s, row.left, row.right, row.x_m, row.y_m, row.theta_rad.to_degrees());
        cells.replace('.', ",")
    };
    table(&at.join("german.csv"), "Zeit [s];Encoder links;Encoder rechts;x [m];y [m];Winkel [°]", &rows, german);
    let took = imported(at, &["german.csv"], &[]);
    assert_eq!((&took["files"][0]["delimiter"], &took["files"][0]["decimal"]), (&"semicolon".into(), &"comma".into()));
    same(at, "new", "direct");

    // Dates in nanoseconds, wrapped headings.
    let dated = |row: &Row| {
        let stamp = 1_700_000_000_123_456_789_u64 + (row.t_s * 1e9).round() as u64;
        let theta = (row.theta_rad + PI).rem_euclid(TAU) - PI;
        format!("{stamp},{},{},{},{},{theta}", row.left, row.right, row.x_m, row.y_m)
    };
    table(&at.join("dated.csv"), "stamp,enc_l,enc_r,pos_x,pos_y,yaw", &rows, dated);
    let took = imported(at, &["dated.csv"], &[]);
    assert_eq!((unit(&took, "t"), unit(&took, "theta")), ("ns".to_owned(), "rad".to_owned()));
    let odometry = |dir: &str| fs::read_to_string(at.join(dir).join("odometry.csv")).expect("read");
    assert_eq!(odometry("new"), odometry("direct"));
    same(at, "new", "direct");

    // Millimetres, degrees and milliseconds that no name says; counts as pandas writes them.
    let small = |row: &Row| {
        let (t_ms, x_mm, y_mm) = (row.t_s * 1e3, row.x_m * 1e3, row.y_m * 1e3);
        format!("{t_ms}\t{:.1}\t{:.1}\t{x_mm}\t{y_mm}\t{}", row.left, row.right, row.theta_rad.to_degrees())
    };
    table(&at.join("small.csv"), "time\tlw\trw\tx\ty\theading", &rows, small);
    let took = imported(at, &["small.csv"], &[]);
    let units = ["t", "left", "x", "theta"].map(|quantity| unit(&took, quantity));
    assert_eq!(units, ["ms", "ticks", "mm", "deg"]);
    same(at, "new", "direct");
}

#[test]
fn speeds_of_wheels_and_twists_calibrate_as_the_dataset() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    // Angles a second over the interval that ends at each row.
    let mut rows = log();
    let counted = rows.clone();
    for (row, pair) in rows[1..].iter_mut().zip(counted.windows(2)) {
        let rate = |before: f64, after: f64| (after - before) * TAU / TICKS * 20.0;
        (row.left, row.right) = (rate(pair[0].left, pair[1].left), rate(pair[0].right, pair[1].right));
    }
    let of_run: Vec<(&str, Row)> = rows.iter().map(|row| ("run-01", *row)).collect();
    let speeds = |row: &Row| format!("{},{},{}", row.t_s, row.left * WHEEL_M / 2.0, row.right * WHEEL_M / 2.0);
    dataset(&at.join("direct"), "left_mps,right_mps", &of_run, speeds);

    // Milliseconds and degrees a second; the truth has a file and seconds of its own.
    let motors = |row: &Row| format!("{},{},{}", row.t_s * 1e3, row.left.to_degrees(), row.right.to_degrees());
    table(&at.join("motors.csv"), "ms,vel_l,vel_r", &rows, motors);
    table(&at.join("mocap.csv"), "time_s,x,y,yaw", &rows, pose);
    // Six times slower wheels, in turns a minute, are those of a robot that is stated wrongly: it is asked.
    let message = refusal(at, &[&["import", "csv", "motors.csv", "mocap.csv", "--out", "no"][..], &ROBOT].concat());
    assert!(message.contains("deg/s (poses reach 1.0") && message.contains("--wheel-unit deg/s or"), "{message}");
    let degrees = ["--wheel-unit", "deg/s"];
    let took = imported(at, &["motors.csv", "mocap.csv"], &degrees);
    assert_eq!((unit(&took, "t"), unit(&took, "left")), ("ms".to_owned(), "deg/s".to_owned()));
    assert_eq!((&took["rates"]["why"], &took["rates"]["confidence"]), (&"interval-end".into(), &"assumed".into()));
    same(at, "new", "direct");

    // A twist of the nominal robot is the same motion.
    let twist = |row: &Row| {
        let [left, right] = [row.left, row.right].map(|rate| rate * WHEEL_M / 2.0);
        format!(
            "{},{},{},{},{},{}",
            row.t_s,
            (left + right) / 2.0,
            (right - left) / BASE_M,
            row.x_m,
            row.y_m,
            row.theta_rad
        )
    };
    table(&at.join("twist.csv"), "time,v,omega,gt_x,gt_y,gt_theta", &rows, twist);
    imported(at, &["twist.csv"], &[]);
    same(at, "new", "direct");

    // Turns a minute, and quaternions.
    let turns = |row: &Row| {
        let [left, right] = [row.left, row.right].map(|rate| rate * 60.0 / TAU);
        let (half_sin, half_cos) = (row.theta_rad / 2.0).sin_cos();
        format!("{},{left},{right},{},{},0,0,{half_sin},{half_cos}", row.t_s, row.x_m, row.y_m)
    };
    table(&at.join("turns.csv"), "time,rpm_l,rpm_r,pose.x,pose.y,q.x,q.y,q.z,q.w", &rows, turns);
    imported(at, &["turns.csv"], &[]);
    same(at, "new", "direct");

    // Of a quaternion with a component that is none, or far from all rotations, there is no heading, as of an
    // empty cell: with qz = inf it was 135° for whatever was meant.
    let headings = |bad: &str| {
        let text = fs::read_to_string(at.join("turns.csv")).expect("read");
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let mut cells: Vec<&str> = lines[2].split(',').collect();
        cells[7] = bad;
        lines[2] = cells.join(",");
        fs::write(at.join("odd.csv"), lines.join("\n") + "\n").expect("written");
        imported(at, &["odd.csv"], &[]);
        let truth = fs::read_to_string(at.join("new/truth.csv")).expect("read");
        let theta = |row: &str| row.rsplit(',').next().is_some_and(|cell| !cell.is_empty());
        truth.lines().skip(1).map(theta).collect::<Vec<_>>()
    };
    let whole = headings("0");
    assert!(whole.iter().all(|has| *has), "{whole:?}");
    for bad in ["", "inf", "-inf", "nan", "1e200", "-1e154", "1e400", "3"] {
        let found = headings(bad);
        assert_eq!(found.iter().filter(|has| !**has).count(), 1, "{bad}: {found:?}");
        assert!(!found[1], "{bad}: {found:?}");
    }

    // Of the instant: each interval's mean is that of its ends.
    imported(at, &["motors.csv", "mocap.csv"], &[&degrees[..], &["--rates", "instantaneous"]].concat());
    let odometry = fs::read_to_string(at.join("new/odometry.csv")).expect("read");
    let third: Vec<f64> = odometry
        .lines()
        .nth(3)
        .expect("a row")
        .split(',')
        .skip(2)
        .map(|cell| cell.parse().expect("a number"))
        .collect();
    let mean = (rows[1].left + rows[2].left) / 2.0 * WHEEL_M / 2.0;
    assert!((third[0] - mean).abs() < 1e-12, "{third:?} {mean}");
}

#[test]
fn runs_come_from_a_column_from_files_and_from_standstills() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let (there, turn) = (log(), drive(&[(0.0, 0.5, 100), (0.2, 0.1, 300)]));
    let rows: Vec<(&str, Row)> =
        there.iter().map(|row| ("a", *row)).chain(turn.iter().map(|row| ("b", *row))).collect();
    dataset(&at.join("direct"), "left_ticks,right_ticks", &rows, counts);
    let cells = |row: &Row| format!("{},{},{},{}", counts(row), row.x_m, row.y_m, row.theta_rad);
    let with_run: String = rows.iter().map(|(run, row)| format!("{run},{}\n", cells(row))).collect();
    fs::write(at.join("runs.csv"), format!("trial,t,enc_l,enc_r,x,y,theta\n{with_run}")).expect("written");
    assert_eq!(imported(at, &["runs.csv"], &[])["runs_by"], "column trial");
    same(at, "new", "direct");

    for (name, rows) in [("a.csv", &there), ("b.csv", &turn)] {
        table(&at.join(name), "t,enc_l,enc_r,x,y,theta", rows, cells);
    }
    assert_eq!(imported(at, &["a.csv", "b.csv"], &[])["runs_by"], "a run a file");
    same(at, "new", "direct");

    // One log with a rest of 10 s in the middle.
    let rest = drive(&[(0.3, 0.0, 100), (0.0, 0.0, 200), (0.2, 0.4, 200)]);
    table(&at.join("rest.csv"), "t,enc_l,enc_r,x,y,theta", &rest, cells);
    let found = document(at, &[&["import", "csv", "rest.csv", "--out", "cut", "--cut", "5"][..], &ROBOT].concat());
    assert_eq!(found["datasets"][0]["runs"], 2);
    // The whole file twice: time restarts.
    let twice: String = ["t,enc_l,enc_r,x,y,theta\n".to_owned()]
        .into_iter()
        .chain([&there, &there].into_iter().flatten().map(|row| cells(row) + "\n"))
        .collect();
    fs::write(at.join("twice.csv"), twice).expect("written");
    let twice = [&["import", "csv", "twice.csv", "--out", "twice"][..], &ROBOT].concat();
    assert!(refusal(at, &twice).contains("--runs-by COLUMN, or --cut SECONDS"));
    let found = document(at, &[&twice[..], &["--cut", "30"]].concat());
    assert_eq!(found["datasets"][0]["runs"], 2);
}

#[test]
fn what_cannot_be_told_is_asked_for_and_nothing_is_written() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let rows = log();
    let cells = |row: &Row| format!("{},{},{},{}", counts(row), row.x_m, row.y_m, row.theta_rad);
    table(&at.join("log.csv"), "t,enc_l,enc_r,x,y,theta", &rows, cells);
    let before = everything_in(at);
    let refused =
        |files: &[&str], flags: &[&str]| refusal(at, &[&["import", "csv", "--out", "new"], files, flags].concat());

    let message = refused(&["log.csv"], &[]);
    let typed = "yair import csv --out new log.csv --wheel DIAMETER_M --base SEPARATION_M --ticks-per-rev COUNTS";
    assert!(message.contains(typed), "{message}");
    let message = refused(&["log.csv"], &["--wheel", "0.15", "--ticks-per-rev", "4096"]);
    assert!(message.ends_with("--ticks-per-rev 4096 --base SEPARATION_M"), "{message}");
    let message = refused(&["log.csv"], &[&ROBOT[..], &["--map", "left=encoder"]].concat());
    assert!(message.contains("no column \"encoder\"") && message.contains("t, enc_l, enc_r"), "{message}");
    // Wheels of millimetres are bad usage.
    assert!(
        usage(at, &["import", "csv", "log.csv", "--out", "new", "--wheel", "150"])
            .contains("metres are expected: 0.15")
    );

    // Two columns that are as likely, steps of 2 s or of 2 ms, headings of a robot that does not turn.
    let doubled = |row: &Row| format!("{},{}", cells(row), row.x_m);
    let ambiguous = |name: &str, header: &str, rows: &[Row], cells: &dyn Fn(&Row) -> String| {
        let file = at.join(name);
        table(&file, header, rows, cells);
        let message = refused(&[name], &ROBOT);
        fs::remove_file(file).expect("removed");
        message
    };
    let message = ambiguous("two.csv", "t,enc_l,enc_r,x,y,theta,pos_x", &rows, &doubled);
    assert!(message.contains("column x may be x or pos_x") && message.contains("--map x=pos_x"), "{message}");
    let message = ambiguous("own.csv", "t,enc_l,enc_r,odom_x,odom_y,odom_theta", &rows, &cells);
    assert!(message.contains("the robot's own odometry does not count"), "{message}");
    let straight = drive(&[(0.3, 0.0, 200)]);
    let message = ambiguous("straight.csv", "t,enc_l,enc_r,x,y,theta", &straight, &cells);
    assert!(message.contains("rad or deg") && message.contains("--angle-unit"), "{message}");
    let rates = |row: &Row| {
        format!("{},{},{},{},{},{}", row.t_s * 40.0, row.left / 1e3, row.right / 1e3, row.x_m, row.y_m, row.theta_rad)
    };
    let message = ambiguous("steps.csv", "t,v,omega,gt_x,gt_y,gt_theta", &rows, &rates);
    assert!(
        message.contains("s (rows 2 s apart) or ms (rows 0.002 s apart)") && message.contains("--time-unit"),
        "{message}"
    );
    assert_eq!(everything_in(at), before);
}

#[test]
fn people_see_what_was_taken_for_what() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let cells = |row: &Row| format!("{},{},{},{},7", counts(row), row.x_m, row.y_m, row.theta_rad);
    table(&at.join("log.csv"), "t,enc_l,enc_r,x,y,theta,battery", &log(), cells);
    let shown = succeed(at, &[&["import", "csv", "log.csv", "--out", "new"][..], &ROBOT].concat()).stdout;
    for part in [
        "log.csv: 1221 rows, header in line 1, delimiter comma",
        "enc_l",
        "left out: battery",
        "--length-unit",
        "poses reach 1.0",
    ] {
        assert!(shown.contains(part), "{part}: {shown}");
    }
    assert!(shown.ends_with("1 runs, 1221 odometry rows in new\n"), "{shown}");
}
