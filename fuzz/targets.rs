//! What is fuzzed: each target makes an input of its corpus, reads it, and holds what it was promised.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rand::{Rng, RngExt};
use rand_xoshiro::Xoshiro256PlusPlus;
use yair::bench::{self, SweepResult};
use yair::blind_benchmark::DiagnosisBaseline;
use yair::calib::CalibrationReport;
use yair::command::{Watch, call};
use yair::dataset::import::csv::{MotionOptions, Options as CsvOptions, RobotGiven};
use yair::dataset::{Dataset, Existing, RunByRun};
use yair::diagnose::ExtendedModel;
use yair::export::format::EXPORTERS;
use yair::export::{self, CalibratedRobot};
use yair::kinematics::Wheels;
use yair::robot_files::{Robot, put, put_in_urdf};
use yair::scenario::Scenario;

use crate::corpus::{self, Sample};
use crate::{bag, odd_datasets, text};

/// Something that reads.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    pub(crate) corpus: fn() -> Vec<Sample>,
    /// Makes an input in the folder and reads it: whether it was accepted. A panic is a finding.
    pub(crate) run: fn(&[Sample], &mut Xoshiro256PlusPlus, &Path) -> bool,
    /// What an execution costs, in those of a text file.
    pub(crate) cost: u64,
}

pub(crate) const TARGETS: &[Target] = &[
    Target { name: "dataset", corpus: corpus::datasets, run: read_dataset, cost: 1 },
    Target { name: "csv", corpus: corpus::tables, run: read_table, cost: 1 },
    Target { name: "motion-capture", corpus: corpus::captures, run: read_capture, cost: 1 },
    Target { name: "motions", corpus: corpus::motions, run: read_motions, cost: 1 },
    Target { name: "tum", corpus: corpus::trajectories, run: read_trajectories, cost: 1 },
    Target {
        name: "optiodom",
        corpus: corpus::optiodom,
        run: |all, random, at| import("optiodom", all, random, at),
        cost: 1,
    },
    Target { name: "censi", corpus: corpus::tuples, run: |all, random, at| import("censi", all, random, at), cost: 1 },
    Target { name: "mcap-and-cdr", corpus: corpus::bags, run: read_bag, cost: 2 },
    Target { name: "db3", corpus: corpus::bags_in_sqlite, run: read_bag_in_sqlite, cost: 1 },
    Target { name: "ros1", corpus: corpus::bags_of_ros1, run: read_bag_of_ros1, cost: 1 },
    Target { name: "bag-metadata", corpus: corpus::metadata, run: read_metadata, cost: 1 },
    Target { name: "robot-files", corpus: corpus::robot_files, run: read_robot_file, cost: 1 },
    Target { name: "scenario", corpus: corpus::scenarios, run: read_scenario, cost: 1 },
    Target { name: "calibration", corpus: corpus::calibrations, run: read_calibration, cost: 1 },
    Target { name: "extended", corpus: corpus::extended, run: read_extended, cost: 1 },
    Target { name: "sweep-state", corpus: corpus::states, run: read_states, cost: 2 },
    Target { name: "kept-sessions", corpus: corpus::kept_sessions, run: read_kept, cost: 4 },
    Target { name: "accuracy-baseline", corpus: corpus::accuracy_baselines, run: read_accuracy, cost: 1 },
    Target { name: "diagnosis-baseline", corpus: corpus::diagnosis_baselines, run: read_diagnosis, cost: 1 },
    Target { name: "calibrators", corpus: corpus::none, run: odd_datasets::calibrated, cost: 4 },
    Target { name: "diagnosis", corpus: corpus::none, run: odd_datasets::diagnosed, cost: 20 },
];

fn pick<'l, T>(list: &'l [T], random: &mut impl Rng) -> &'l T {
    &list[random.random_range(0..list.len())]
}

/// A sample of which one file is mutated, or left out, or takes the place of another; in the folder.
fn placed(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> PathBuf {
    let sample = pick(all, random);
    let (chosen, other) = (random.random_range(0..sample.len()), random.random_range(0..sample.len()));
    let (_, elsewhere) = pick(&pick(all, random)[..], random);
    let (is_gone, is_exchanged) = (random.random_bool(0.02), random.random_bool(0.02));
    for (number, (name, bytes)) in sample.iter().enumerate() {
        // Most tables of a dataset are optional: with few, one that is mutated is reached.
        let is_optional = sample.len() > 4 && !["dataset.toml", "odometry.csv", "truth.csv"].contains(&&name[..]);
        if number != chosen && is_optional && random.random_bool(0.7) {
            continue;
        }
        let bytes = match number == chosen {
            true if is_gone => continue,
            true if is_exchanged => sample[other].1.clone(),
            true => text::mutated(bytes, elsewhere, random),
            false => bytes.clone(),
        };
        let path = at.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, bytes).expect("written");
    }
    at.join(&sample[chosen].0)
}

/// No message is without words. What a terminal may not have of them is escaped where they are printed.
fn refused(error: &dyn std::error::Error) -> bool {
    assert!(error.to_string().len() > 10, "{error}");
    false
}

/// What was read can be written, and reads back equal.
fn round_trip(dataset: &Dataset, at: &Path) -> bool {
    let out = at.join("again");
    dataset::write(dataset, &out, Existing::Refuse).expect("what was read can be written");
    let again = dataset::read(&out).expect("what was written can be read").dataset;
    assert_eq!(&again, dataset, "it reads back otherwise");
    true
}

fn read_dataset(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    placed(all, random, at);
    let whole = dataset::read(at);
    // Run by run the same is read, or refused.
    let by_run =
        RunByRun::open(at).and_then(|runs| runs.map(|run| run.map(|run| run.dataset)).collect::<Result<Vec<_>, _>>());
    match (whole, by_run) {
        (Err(error), _) => refused(&error),
        (Ok(loaded), by_run) => {
            let by_run = by_run.expect("run by run as at once");
            let runs: Vec<_> = by_run.iter().flat_map(|dataset| &dataset.runs).collect();
            assert_eq!(runs, loaded.dataset.runs.iter().collect::<Vec<_>>(), "run by run it is another dataset");
            round_trip(&loaded.dataset, at)
        }
    }
}

fn robot() -> RobotGiven {
    RobotGiven {
        wheel_diameter_m: Some(Wheels { left: 0.15, right: 0.15 }),
        wheel_separation_m: Some(0.3),
        ticks_per_rev: Some(4096.0),
        counter_bits: None,
    }
}

fn read_table(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let file = placed(all, random, at);
    match dataset::import::csv::read(&[file], &CsvOptions { robot: robot(), ..CsvOptions::default() }) {
        Err(error) => refused(&error),
        Ok(found) => round_trip(&found.imported.dataset, at),
    }
}

fn read_capture(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    placed(all, random, at);
    let files = ["wheels.csv", "take.csv"].map(|name| at.join(name));
    match dataset::import::csv::read(&files, &CsvOptions { robot: robot(), ..CsvOptions::default() }) {
        Err(error) => refused(&error),
        Ok(found) => round_trip(&found.imported.dataset, at),
    }
}

fn read_motions(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    placed(all, random, at);
    let options =
        MotionOptions { robot: robot(), period_s: 1.0, length_unit: dataset::Unit::M, angle_unit: dataset::Unit::Rad };
    match dataset::import::csv::read_motions(&at.join("odometry.txt"), &at.join("scans.txt"), &options) {
        Err(error) => refused(&error),
        Ok(found) => match dataset::check_writable(&found.imported.dataset) {
            // Angles of wheels that add up to more than a double holds.
            Err(error) => refused(&error),
            Ok(()) => round_trip(&found.imported.dataset, at),
        },
    }
}

fn read_trajectories(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    placed(all, random, at);
    let [truth, wheels] = ["truth.txt", "wheels.txt"].map(|name| at.join(name).display().to_string());
    let out = at.join("out").display().to_string();
    let arguments =
        ["yair", "import", "tum", &truth, "--odometry", &wheels, "--out", &out, "--wheel", "0.15", "--base", "0.3"];
    let done = call(arguments, &Arc::new(Watch::default()));
    assert!(done.exit_code < 2, "{:?}", done.failure);
    if done.exit_code == 0 {
        dataset::read(Path::new(&out)).expect("what was imported can be read");
    }
    done.exit_code == 0
}

fn import(format: &str, all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let file = placed(all, random, at);
    let source = if format == "optiodom" { at.to_owned() } else { file };
    match dataset::import::importer(format).expect("a format").read(&source) {
        Err(error) => refused(&error),
        Ok(sessions) => sessions.iter().enumerate().all(|(number, session)| {
            let folder = at.join(number.to_string());
            fs::create_dir_all(&folder).expect("made");
            // The writer refuses counts that no counter reaches; the sums of a log may.
            match dataset::check_writable(&session.dataset) {
                Err(error) if error.to_string().contains("a count beyond") => refused(&error),
                _ => round_trip(&session.dataset, &folder),
            }
        }),
    }
}

fn bag_in(at: &Path) -> bool {
    bag_with(at, &ros_bag::Options { robot: robot(), ..Default::default() })
}

fn bag_with(at: &Path, options: &ros_bag::Options) -> bool {
    let listed = ros_bag::list(at, &[]);
    match ros_bag::import(at, options) {
        Err(error) => refused(&error),
        Ok(found) => {
            listed.expect("what is imported can be listed");
            let folder = at.parent().expect("a folder");
            round_trip(&found.dataset, folder)
        }
    }
}

fn read_bag(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let (_, bytes) = &pick(all, random)[0];
    let path = at.join("a.mcap");
    fs::write(&path, bag::mutated(bytes, random)).expect("written");
    bag_in(&path)
}

fn read_bag_in_sqlite(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let (_, bytes) = &pick(all, random)[0];
    let path = at.join("a.db3");
    fs::write(&path, crate::sqlite::mutated(bytes, random)).expect("written");
    bag_in(&path)
}

fn read_bag_of_ros1(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let (name, bytes) = &pick(all, random)[0];
    let path = at.join("a.bag");
    fs::write(&path, crate::ros1::mutated(bytes, random)).expect("written");
    // Poses by a chain of transforms: of a marker on the base, or of a map that is corrected.
    let parent = *pick(&["mocap", "map"], random);
    let chain = name.starts_with("transforms").then(|| (parent.to_owned(), "base_link".to_owned()));
    let truth = chain.is_some().then(|| "/tf".to_owned());
    bag_with(&path, &ros_bag::Options { truth, truth_frames: chain, robot: robot(), ..Default::default() })
}

fn read_metadata(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    placed(all, random, at);
    // What is asked is which files are opened.
    fs::write(at.join("a.mcap"), include_bytes!("../tests/ros2/two_topics.mcap")).expect("written");
    match ros_bag::list(at, &[]) {
        Err(error) => refused(&error),
        Ok(_) => true,
    }
}

fn read_scenario(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    match Scenario::read(&placed(all, random, at)) {
        Err(error) => refused(&error),
        Ok(scenario) => {
            let toml = scenario.to_toml().expect("it has a form");
            let values: toml::Value = toml::from_str(&toml).expect("it is TOML");
            assert!(numbers(&values).iter().all(|number| !number.is_nan()), "a number that is none: {toml}");
            let again = Scenario::parse(&toml, "again").expect("it reads back");
            assert_eq!(again, scenario);
            true
        }
    }
}

/// The numbers of a TOML document; names and notes may say what they like.
fn numbers(value: &toml::Value) -> Vec<f64> {
    match value {
        toml::Value::Float(number) => vec![*number],
        toml::Value::Array(values) => values.iter().flat_map(numbers).collect(),
        toml::Value::Table(table) => table.values().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}

/// A robot's own file: what is read has lengths of a robot, and put back in it changes nothing that is said.
fn read_robot_file(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let path = placed(all, random, at);
    let Ok(text) = fs::read_to_string(&path) else { return false };
    let file = path.display().to_string();
    let robot = match Robot::read(&file, &text, None) {
        Err(error) => return refused(&error),
        Ok(robot) => robot,
    };
    let wheels_m = robot.wheel_diameter_m.iter().flat_map(|wheels_m| [wheels_m.left, wheels_m.right]);
    assert!(wheels_m.chain(robot.wheel_separation_m).all(|length_m| length_m > 0.0 && length_m < 10.0), "{robot:?}");
    for fragment in ROBOT_FRAGMENTS {
        match put(&file, &text, fragment, None) {
            Err(error) => assert!(!error.to_string().is_empty()),
            Ok(edited) => {
                let again = put(&file, &edited.text, fragment, None).expect("it has the places");
                assert_eq!(again.text, edited.text);
            }
        }
    }
    if let Ok(edited) = put_in_urdf(&text, Wheels { left: 0.101, right: 0.102 }, 0.4) {
        let back = Robot::read(&file, &edited.text, None).expect("a URDF");
        assert!((back.wheel_separation_m.expect("joints") - 0.4).abs() < 1e-6, "{back:?}");
    }
    true
}

/// What is put into files: parameters of a controller, and defines.
const ROBOT_FRAGMENTS: [&str; 2] = [
    "a:\n  ros__parameters:\n    wheel_separation: 0.41\n    wheel_radius: 0.1\n    left_wheel_radius_multiplier: 1.01\n",
    "#define WHEEL_DIAMETER 0.06\n#define LR_WHEELS_DISTANCE 0.2\n#define COUNTS_PER_REV1 990\n#define COUNTS_PER_REV2 991\n",
];

fn read_calibration(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    match CalibrationReport::read(&placed(all, random, at)) {
        Err(error) => refused(&error),
        Ok(report) => {
            let nominal = odd_datasets::nominal();
            for calibration in report.calibrations() {
                let geometry = calibration.geometry(&nominal, nominal.geometry().expect("a drive"));
                assert!(geometry.is_none_or(|geometry| geometry.wheel_separation_m().is_finite()));
                let (latency_s, sensor) = (calibration.latency_s(), calibration.body_from_sensor());
                assert!([latency_s, sensor.x_m, sensor.y_m, sensor.theta_rad].iter().all(|value| value.is_finite()));
                let _ = calibration.implausible_for(&nominal);
            }
            let mut printed = report.to_toml().expect("it has a form");
            for method in &report.methods {
                let Ok(robot) = CalibratedRobot::of_method("c.toml", method, Some(&nominal)) else { continue };
                for format in EXPORTERS {
                    printed += &(format.render)(&robot, &export::Options::default()).unwrap_or_default();
                }
            }
            are_numbers(&printed, at);
            true
        }
    }
}

/// No number in what was printed is none, unless a text of the files in the folder says so.
fn are_numbers(printed: &str, at: &Path) {
    let of = |text: &str| {
        let mut words = text.split(|letter: char| !letter.is_alphanumeric());
        words.find(|word| ["NaN", "nan", "inf"].contains(word)).map(str::to_owned)
    };
    if let Some(word) = of(printed) {
        let said = |path: &PathBuf| fs::read(path).is_ok_and(|bytes| of(&String::from_utf8_lossy(&bytes)).is_some());
        assert!(corpus::files(at).iter().any(said), "{word} in {printed}");
    }
}

fn read_extended(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let scenario = match Scenario::read(&placed(all, random, at)) {
        Err(error) => return refused(&error),
        Ok(scenario) => scenario,
    };
    match ExtendedModel::of(&scenario) {
        Err(error) => refused(&error),
        Ok(model) => {
            let _ = model.check(&odd_datasets::nominal());
            true
        }
    }
}

fn read_states(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    placed(all, random, at);
    let [one, two, out] = ["1", "2", "out"].map(|name| at.join(name).display().to_string());
    let done = call(["yair", "merge", &one, &two, "--out", &out], &Arc::new(Watch::default()));
    assert!(done.exit_code < 2, "{:?}", done.failure);
    if let Some(document) = &done.document {
        let result: SweepResult = serde_json::from_str(document).expect("a merged result is one");
        assert_eq!(serde_json::to_string_pretty(&result).expect("JSON"), *document);
        for file in ["sweep.csv", "report.html"] {
            are_numbers(&fs::read_to_string(Path::new(&out).join(file)).expect("written"), &at.join("1"));
        }
    }
    done.exit_code == 0
}

/// One of the kept sessions is mutated; it is believed, or found anew from its dataset.
fn read_kept(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let sample = &all[0];
    let kept: Vec<usize> = (0..sample.len()).filter(|file| sample[*file].0.starts_with("kept/")).collect();
    let (chosen, other) = (*pick(&kept, random), *pick(&kept, random));
    for (number, (name, bytes)) in sample.iter().enumerate() {
        let mutated = (number == chosen).then(|| text::mutated(bytes, &sample[other].1, random));
        let path = at.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, mutated.as_ref().unwrap_or(bytes)).expect("written");
    }
    let [sets, out, html, csv] =
        ["sets", "kept", "page.html", "table.csv"].map(|name| at.join(name).display().to_string());
    let arguments = ["yair", "fleet", &sets, "--calibrate-only", "--out", &out, "--html", &html, "--csv", &csv];
    // What the folder holds is looked at before it is found anew.
    let folder = at.join("kept/sessions");
    let before = fs::read(folder.join(sample[chosen].0.rsplit('/').next().expect("a name"))).expect("there");
    let done = call(arguments, &Arc::new(Watch::default()));
    assert_eq!(done.exit_code, 0, "{:?}", done.failure);
    fs::write(at.join("before"), before).expect("written");
    let document = done.document.expect("a document");
    for printed in [&document, &fs::read_to_string(html).expect("a page"), &fs::read_to_string(csv).expect("a table")] {
        are_numbers(printed, at);
    }
    let document: serde_json::Value = serde_json::from_str(&document).expect("JSON");
    for change in
        document["robots"].as_array().expect("robots").iter().flat_map(|of| of["changes"].as_array()).flatten()
    {
        assert!(change.as_object().expect("a change").values().all(|value| !value.is_null()), "{change}");
    }
    done.remarks.iter().any(|remark| remark.starts_with("0 datasets computed"))
}

/// Of a baseline that is read every comparison has a z, or has moved.
fn read_accuracy(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let sound: SweepResult = serde_json::from_slice(&all[0][0].1).expect("a result");
    let path = placed(all, random, at);
    match bench::read_baseline(&path).and_then(|baseline| bench::compare(&sound, &baseline, "baseline.json")) {
        Err(error) => refused(&error),
        Ok(check) => {
            let is_none = |number: &&bench::Comparison| !number.z.is_finite();
            assert_eq!(check.changed.iter().filter(is_none).count(), check.moved.iter().filter(is_none).count());
            assert!(check.changed.iter().all(|number| !number.z.is_nan()));
            assert!(check.changed.iter().all(|number| number.was.is_finite() && number.is.is_finite()));
            true
        }
    }
}

/// Of a baseline that is read every p-value is one.
fn read_diagnosis(all: &[Sample], random: &mut Xoshiro256PlusPlus, at: &Path) -> bool {
    let sound: DiagnosisBaseline = serde_json::from_slice(&all[0][0].1).expect("a baseline");
    match DiagnosisBaseline::read(&placed(all, random, at)) {
        Err(error) => refused(&error),
        Ok(baseline) => {
            let check = baseline.check(&sound);
            assert_eq!(check.guarded.len(), sound.guards.len());
            assert!(check.guarded.iter().all(|guarded| (0.0..=1.0).contains(&guarded.p_value)), "{check:?}");
            assert!((1e-7..1.0).contains(&check.level), "{check:?}");
            true
        }
    }
}
