//! `yair import tum`: trajectories of an instrument with wheels or a trajectory of the robot's own.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::support::{document, everything_in, refusal, succeed, usage};

const ROBOT: [&str; 4] = ["--wheel", "0.15", "--base", "0.3"];

fn path(name: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests", "evo", name].iter().collect();
    path.display().to_string()
}

fn ape(found: &Value) -> f64 {
    let run = &found["calibrations"][0]["runs"][0];
    run["ape"]["translation_m"]["rmse"].as_f64().unwrap_or_else(|| panic!("{found}"))
}

#[test]
fn a_trajectory_of_the_robots_own_is_dead_reckoned_as_it_was() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let golden: Value = serde_json::from_str(&fs::read_to_string(path("golden.json")).expect("there")).expect("JSON");
    for name in ["square", "circle", "free"] {
        let files = [path(&format!("{name}.truth.tum")), path(&format!("{name}.odometry.tum"))];
        let imported = document(
            at,
            &[&["import", "tum", &files[0], "--odometry", &files[1], "--out", "set", "--force"], &ROBOT[..]].concat(),
        );
        assert_eq!(imported["format"], "tum");
        assert_eq!(imported["source"], files.join(" "));
        assert_eq!(imported["datasets"][0]["runs"], 1);
        // Both begin at the same pose. Digits of 1e-6 m and 1e-9 rad leave motion sideways that twists do not
        // have: 4e-7 m. Distances along arcs instead of chords were seen to miss by 9e-5 m, on the circle.
        let found = document(at, &["evaluate", "set"]);
        let evo = golden["paths"][name]["ape"]["none"]["translation_m"]["rmse"].as_f64().expect("a number");
        assert!((ape(&found) - evo).abs() < 2e-6, "{name}: {} {evo}", ape(&found));
    }
}

#[test]
fn wheels_come_from_a_table_as_import_csv_reads_it() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    // The second run of the dataset, as a table of the wheels and one of the poses.
    let table = |name: &str| fs::read_to_string(path(&format!("robot/{name}"))).expect("a table");
    let rows = |name: &str| -> Vec<String> {
        table(name).lines().filter_map(|line| line.strip_prefix("free,").map(str::to_owned)).collect()
    };
    fs::write(at.join("wheels.csv"), format!("t;enc_l;enc_r\n{}\n", rows("odometry.csv").join("\n").replace(',', ";")))
        .expect("written");
    let tum: String = rows("truth.csv")
        .iter()
        .map(|row| {
            let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("a number")).collect();
            let (sin, cos) = (0.5 * cells[3]).sin_cos();
            format!("{:e} {} {} 0 0 0 {sin} {cos}\n", cells[0], cells[1], cells[2])
        })
        .collect();
    fs::write(at.join("truth.tum"), format!("# t x y z qx qy qz qw\n{tum}")).expect("written");
    let import = ["import", "tum", "truth.tum", "--wheels", "wheels.csv", "--ticks-per-rev", "4096", "--out", "set"];
    let said = succeed(at, &[&import[..], &ROBOT].concat());
    assert!(
        said.stdout.contains("enc_l") && said.stdout.contains("1 runs, 63 odometry rows in set"),
        "{}",
        said.stdout
    );
    let original = document(at, &["evaluate", &path("robot")]);
    let of_free = &original["calibrations"][0]["runs"][1]["ape"]["translation_m"]["rmse"];
    // The same numbers, but for the rounding of quaternions.
    let found = document(at, &["evaluate", "set"]);
    assert!((ape(&found) - of_free.as_f64().expect("a number")).abs() < 1e-12, "{found}");
}

#[test]
fn what_is_not_enough_is_refused_and_nothing_is_written() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let (truth, odometry) = (path("free.truth.tum"), path("free.odometry.tum"));
    fs::write(at.join("poses.csv"), "t,x,y\n0,1,2\n1,2,3\n").expect("written");
    let refused = |arguments: &[&str], why: &str| {
        let before = everything_in(at);
        let message = refusal(at, &[&["import", "tum", &truth, "--out", "set"], arguments].concat());
        assert!(message.contains(why), "{message}");
        assert_eq!(everything_in(at), before, "{arguments:?} left something behind");
    };
    refused(
        &["--odometry", &odometry],
        "no log says the robot's own numbers; give --wheel DIAMETER_M --base SEPARATION_M",
    );
    refused(&["--wheels", "poses.csv"], "poses.csv:1: no columns of wheels, left and right or v and omega");
    refused(&["--odometry", "poses.csv", "--wheel", "1", "--base", "1"], "expected a TUM trajectory: 8 numbers a line");
    refused(&["--odometry", "absent.tum"], "absent.tum: ");
    let usages: [&[&str]; 3] = [
        &[],
        &["--odometry", &odometry, "--wheels", "poses.csv"],
        &["--odometry", &odometry, "--rates", "instantaneous"],
    ];
    for arguments in usages {
        usage(Path::new("."), &[&["import", "tum", &truth, "--out", "set"], arguments].concat());
    }
}
