//! `yair export mcap`: a bag that `yair import ros2` reads back as the dataset that it was written of. That
//! others read it too is the business of `.ci/run interop`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{document, everything_in, refusal, succeed, usage};

/// A calibration file with noise.
const CALIBRATION: &str = "[[methods]]\nmethod = \"joint\"\nruns_used = 3\nconverged = true\n\
    [methods.noise]\nwheel_sigma_m_per_sqrt_m = 0.001\nturn_sigma_rad_per_sqrt_rad = 0.002\n\
    [methods.parameters]\nwheel_separation_m = { value = 0.306, sigma = 2e-4, ratio_to_nominal = 1.02 }\n";

fn robot() -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests", "evo", "robot"].iter().collect();
    path.display().to_string()
}

/// The numbers of a table, run by run.
fn numbers(folder: &Path, table: &str) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(folder.join(table)).expect("a table");
    let row = |line: &str| line.split(',').skip(1).map(|cell| cell.parse().expect("a number")).collect();
    text.lines().skip(1).map(row).collect()
}

#[test]
fn a_bag_imports_as_the_dataset_that_it_was_written_of() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let set = robot();
    fs::write(at.join("c.toml"), CALIBRATION).expect("written");
    let found = document(at, &["export", "mcap", &set, "--calibration", "c.toml", "--out", "set.mcap"]);
    assert_eq!((&found["format"], &found["out"], &found["frame"]), (&"mcap".into(), &"set.mcap".into(), &"map".into()));
    let topics: Vec<&str> =
        found["topics"].as_array().expect("topics").iter().filter_map(|of| of["topic"].as_str()).collect();
    let all = [
        "/truth",
        "/tf",
        "/path/truth",
        "/joint_states",
        "/odom/nominal",
        "/path/nominal",
        "/odom/joint",
        "/path/joint",
    ];
    assert_eq!(topics, all);
    let import = |more: &[&str]| {
        let robot = ["--cut", "5", "--wheel", "0.15", "--base", "0.3", "--out", "back", "--force"];
        succeed(at, &[&["import", "ros2", "set.mcap"], &robot[..], more].concat())
    };
    assert_eq!(import(&[]).stderr, "");
    let (ticks, angles) = (numbers(Path::new(&set), "odometry.csv"), numbers(&at.join("back"), "odometry.csv"));
    assert_eq!(ticks.len(), angles.len());
    let rad_per_tick = std::f64::consts::TAU / 4096.0;
    for (ticks, angles) in ticks.iter().zip(&angles) {
        // Stamps are whole nanoseconds.
        assert!((ticks[0] - angles[0]).abs() < 1e-9);
        assert_eq!([angles[1], angles[2]], [rad_per_tick * ticks[1], rad_per_tick * ticks[2]]);
    }
    let (written, read) = (numbers(Path::new(&set), "truth.csv"), numbers(&at.join("back"), "truth.csv"));
    assert_eq!(written.len(), read.len());
    for (written, read) in written.iter().zip(&read) {
        assert_eq!([written[1], written[2]], [read[1], read[2]]);
        // A heading within half a turn, through the half-angle and back.
        let turned: f64 = written[3] - read[3];
        assert!((turned - std::f64::consts::TAU * (turned / std::f64::consts::TAU).round()).abs() < 1e-14);
    }
    // The drift of the data is that of the dataset.
    let drift = |set: &str| document(at, &["evaluate", set])["calibrations"][0]["drift_percent"].as_f64();
    let [original, back] = [drift(&set), drift("back")].map(|drift| drift.expect("a drift"));
    assert!((original - back).abs() < 1e-9, "{original} {back}");
    // Twists of the calibrated path, whose turns are smaller by the wider separation.
    import(&["--wheels", "/odom/joint"]);
    let by_joint = drift("back").expect("a drift");
    assert!((by_joint - original).abs() > 0.1, "{by_joint} {original}");
    let direct =
        document(at, &["evaluate", &set, "--calibration", "c.toml"])["calibrations"][1]["drift_percent"].clone();
    // The instrument's place is fitted with all lengths free, to twists here and to counts there: a few
    // tenths of a millimetre over some metres.
    assert!((by_joint - direct.as_f64().expect("a drift")).abs() < 1e-3, "{by_joint} {direct}");
}

#[test]
fn one_run_is_one_run_and_what_cannot_be_written_is_refused() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let set = robot();
    let said = succeed(at, &["export", "mcap", &set, "--run", "free", "--out", "free.mcap"]).stdout;
    assert!(said.contains("1 runs in free.mcap, poses in frame map; the first is stamped 1 s"), "{said}");
    let refused = |arguments: &[&str], why: &str| {
        let before = everything_in(at);
        let message = refusal(at, &[&["export", "mcap"], arguments].concat());
        assert!(message.contains(why), "{message}");
        assert_eq!(everything_in(at), before, "{arguments:?} left something behind");
    };
    refused(&[&set, "--out", "free.mcap"], "free.mcap: already exists; nothing was written");
    refused(&[&set, "--out", "x.mcap", "--run", "z"], "it has no run \"z\"; it has square, free");
    refused(&["free.mcap", "--out", "x.mcap"], "free.mcap: is a file, where a folder belongs");
    refused(&[&set, "--out", "x.mcap", "--calibration", "absent.toml"], "absent.toml: ");
    assert!(usage(at, &["export", "mcap", &set]).contains("give --out FILE.mcap"));
    usage(at, &["export", "mcap", &set, "--out", "x.mcap", "--method", "joint"]);
}
