//! Bundles of `yair check --bundle`: each has the problems of its log, and no name, path or date of it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use miniz_oxide::inflate::decompress_to_vec;
use rayon::prelude::*;
use serde_json::Value;

use crate::good_log::{Log, driven, good};
use crate::support::real_data::real_data;
use crate::support::{document, refusal, run_in, succeed};
use crate::{misdeclared, spoiled_files};

const MAX_BYTES: usize = 200_000;

/// What no bundle has: names that are planted in each log, its runs' ids, its folder, dates since 1970, and
/// where the map begins.
const FORBIDDEN: [&str; 11] = [
    "Graz",
    "cart-7",
    "2026-",
    "ftp://",
    "00_straight",
    "08_square",
    "operator",
    "plant-log",
    ",1757913",
    ",53012",
    ",52145",
];

const PLANTED: &str = "name = \"Graz\"\nnotes = \"Graz, hall 3\"\nsource = \"ftp://graz.example/plant-log\"\n\
                       recorded = \"2026-03-04T05:06:07Z\"\n";

/// Seconds since 1970, as tables have them.
const EPOCH_S: f64 = 1_757_913_000.0;

fn write(log: &Log, folder: &Path) {
    log.write(folder, PLANTED);
    let manifest = folder.join("dataset.toml");
    let text = fs::read_to_string(&manifest).expect("written");
    let text = text.replacen("[robot]\n", "[robot]\nid = \"cart-7\"\n", 1);
    fs::write(manifest, text.replace("protocol =", "operator_7 = 3.5\nprotocol =")).expect("written");
}

/// The files of a zip whose local headers have the sizes.
fn unzipped(mut zip: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    while zip.starts_with(b"PK\x03\x04") {
        let number = |at: usize, bytes: usize| {
            zip[at..at + bytes].iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte))
        };
        let (packed, name) = (number(18, 4), number(26, 2));
        let content = decompress_to_vec(&zip[30 + name..30 + name + packed]).expect("deflated");
        files.push((String::from_utf8(zip[30..30 + name].to_vec()).expect("a name"), content));
        zip = &zip[30 + name + packed..];
    }
    files
}

/// A zip of files that are not packed.
fn stored(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let (mut zip, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in files {
        let size = (content.len() as u32).to_le_bytes();
        let header =
            [&[20, 0, 0, 0, 0, 0, 0, 0, 33, 0][..], &crc32fast::hash(content).to_le_bytes(), &size, &size].concat();
        let header = [&header[..], &(name.len() as u16).to_le_bytes(), &[0, 0]].concat();
        let offset = (zip.len() as u32).to_le_bytes();
        zip.extend([b"PK\x03\x04", &header[..], name.as_bytes(), content].concat());
        directory.extend([b"PK\x01\x02\x14\x00", &header[..], &[0; 10], &offset, name.as_bytes()].concat());
    }
    let count = (files.len() as u16).to_le_bytes();
    let ends = [directory.len() as u32, zip.len() as u32].map(u32::to_le_bytes);
    [&zip[..], &directory, b"PK\x05\x06\0\0\0\0", &count, &count, &ends[0], &ends[1], &[0, 0]].concat()
}

/// The ids of a log's problems, where its bundle has the same and nothing that is forbidden.
#[track_caller]
fn bundled(folder: &Path, sets: &[&str], forbidden: &[&str]) -> BTreeSet<String> {
    let ended = run_in(folder, &[&["check"], sets, &["--bundle", "case.zip", "--json", "--quiet"]].concat());
    let found: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{sets:?}: {}", ended.stderr));
    assert_eq!(ended.stderr, "", "{sets:?}");
    let id = |problem: &Value| problem["id"].as_str().expect("an id").to_owned();
    let problems: BTreeSet<String> = found["problems"].as_array().expect("a list").iter().map(id).collect();
    let zip = fs::read(folder.join("case.zip")).expect("written");
    assert!(zip.len() <= MAX_BYTES && found["bundle"]["bytes"] == zip.len(), "{sets:?}: {} bytes", zip.len());
    for (name, content) in unzipped(&zip) {
        let text = String::from_utf8(content).expect("text");
        let kept = forbidden.iter().find(|word| text.contains(**word) || name.contains(**word));
        let line = kept.and_then(|word| text.lines().find(|line| line.contains(*word)));
        assert!(kept.is_none(), "{sets:?}: {name} has {kept:?}: {line:?} {problems:?}");
    }
    let replayed = document(folder, &["replay-case", "case.zip"]);
    for of in ["recorded", "found"] {
        let ids: BTreeSet<String> = replayed["cases"][0][of].as_object().expect("by id").keys().cloned().collect();
        assert_eq!(ids, problems, "{sets:?}: {of}");
    }
    fs::remove_file(folder.join("case.zip")).expect("removed");
    problems
}

/// As [`bundled`], of a log with names.
fn problems_of(log: &Log) -> BTreeSet<String> {
    let temp = tempfile::tempdir().expect("a temporary folder");
    write(log, &temp.path().join("plant-log"));
    bundled(temp.path(), &["plant-log"], &FORBIDDEN)
}

#[test]
fn misdeclared_logs_have_their_problems_in_bundles() {
    let far_away = |log: Log| log.truths(|_, seen| (seen[0], seen[1]) = (seen[0] + 530_123.25, seen[1] + 521_456.5));
    let since_1970 = |log: Log| log.rows(|t_s, _| *t_s += EPOCH_S).truths(|t_s, _| *t_s += EPOCH_S);
    let with_dates = misdeclared::logs(6100, |log| since_1970(far_away(log)));
    // A clock that has been fast since 1970 is a year ahead: without the date its rate is another problem.
    let is_of_rate = |name: &str| ["truth's clock fast", "truth's clock slow"].contains(&name);
    let of_rates = misdeclared::logs(6101, far_away).into_iter().filter(|(name, _)| is_of_rate(name));
    let logs: Vec<_> = with_dates.into_iter().filter(|(name, _)| !is_of_rate(name)).chain(of_rates).collect();
    assert_eq!(logs.len(), 38);
    let with_problems = logs.par_iter().filter(|(_, log)| !problems_of(log).is_empty()).count();
    assert!(with_problems > 20, "{with_problems} of {}", logs.len());
}

#[test]
fn rows_that_no_robot_makes_are_in_bundles() {
    let spoiled = |spoil: fn(&mut Log)| {
        let mut log = good(6200);
        spoil(&mut log);
        log
    };
    let logs = [
        ("counter_spike", spoiled(|log| log.odometry[2000].2[0] = 4e9)),
        ("truth_outlier", spoiled(|log| log.truth[100].2[0] = 1e300)),
        ("truth_outlier", spoiled(|log| log.truth[100].2[0] = 50.0)),
        ("nothing_moves", good(6201).rows(|_, wheels| *wheels = [7.0, 9.0])),
        ("truth_is_odometry", good(6202).with_own_truth()),
        ("not_determined", good(6203).only("straight")),
        ("not_determined", good(6204).only("spin")),
        ("wheels_exchanged", Log { positions: true, ..good(6205) }.rows(|_, wheels| wheels.swap(0, 1))),
    ];
    for (id, log) in logs {
        assert!(problems_of(&log).contains(id), "{id}");
    }
    let temp = tempfile::tempdir().expect("a temporary folder");
    write(&good(6206), &temp.path().join("both/Graz"));
    write(&driven([0.163, 0.1625, 0.320], 6207), &temp.path().join("both/cart-7"));
    assert!(bundled(temp.path(), &["both"], &FORBIDDEN).contains("several_robots"));
}

#[test]
fn a_file_that_cannot_be_read_has_no_bundle_and_others_have_one() {
    let mut refused = 0;
    for (name, spoil) in spoiled_files::ways() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        write(&good(6300), &temp.path().join("plant-log"));
        spoil(&temp.path().join("plant-log"));
        if run_in(temp.path(), &["check", "plant-log", "--json"]).stdout.contains("\"problems\"") {
            let ended = run_in(temp.path(), &["check", "plant-log", "--bundle", "case.zip", "--quiet"]);
            assert!(temp.path().join("case.zip").exists(), "{name}: {}", ended.stderr);
            succeed(temp.path(), &["replay-case", "case.zip"]);
        } else {
            let why = refusal(temp.path(), &["check", "plant-log", "--bundle", "case.zip"]);
            assert!(why.contains("no bundle is written of a log that cannot be read"), "{name}: {why}");
            assert!(!temp.path().join("case.zip").exists(), "{name}");
            refused += 1;
        }
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn a_large_log_is_thinned_until_it_is_small() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let many = good(6400).repeated(4);
    write(&many.clone().rows(|_, wheels| wheels.swap(0, 1)), &temp.path().join("plant-log"));
    assert!(bundled(temp.path(), &["plant-log"], &FORBIDDEN).contains("wheels_exchanged"));
    let ended = run_in(temp.path(), &["check", "plant-log", "--bundle", "case.zip"]);
    let said = ended.stdout.lines().find_map(|line| line.strip_prefix("bundle: ")).expect("said");
    let kept: usize = said.split(' ').next().and_then(|number| number.parse().ok()).expect("a number");
    assert!(kept > 0 && kept < many.runs.len() && said.contains(" of 40 runs"), "{said}");
    let why = refusal(temp.path(), &["check", "plant-log", "--bundle", "case.zip"]);
    assert!(why.contains("already exists"), "{why}");
}

#[test]
fn field_cases_have_their_problems_in_bundles() {
    let Some(data) = real_data("field_cases_have_their_problems_in_bundles", "field") else { return };
    let cases = data.join("../../field-cases");
    let temp = tempfile::tempdir().expect("a temporary folder");
    let folder = temp.path();
    let robot = |wheel, base, ticks| ["--wheel", wheel, "--base", base, "--ticks-per-rev", ticks];
    let small = robot(".16", ".4", "2048");
    let kobuki = robot(".07", ".23", "2578");
    let [speeds, mocapbot] = [[".3302", ".5708", "rad/s"], [".1524", ".6", "mm/s"]]
        .map(|[wheel, base, unit]| ["--wheel", wheel, "--base", base, "--wheel-unit", unit]);
    let mut logs = vec![
        (cases.join("own_odometry_as_truth"), ["odom.csv", "mocap.csv"], &small[..4]),
        (cases.join("rad_s_read_as_rpm"), ["wheels.csv", "truth.csv"], &speeds),
        (cases.join("tag_remounted"), ["mountA_wheels.csv", "mountA_truth.csv"], &kobuki),
        (cases.join("tag_remounted"), ["mountB_wheels.csv", "mountB_truth.csv"], &kobuki),
        (data.clone(), ["turtlebot0_wheels.csv", "turtlebot0_mocap.csv"], &kobuki),
        (data.clone(), ["mocapbot0_wheels.csv", "mocapbot0_mocap.csv"], &mocapbot),
        (data.clone(), ["mocapbot3_wheels.csv", "mocapbot3_mocap.csv"], &mocapbot),
    ];
    let of_small =
        ["noisy_speeds_bias", "one_way_false", "resolution_doubles", "sec_nanosec", "short_spin", "turned_tag"];
    logs.extend(of_small.map(|name| (cases.join(name), ["wheels.csv", "truth.csv"], &small[..])));
    let mut imported = Vec::new();
    for (number, (from, files, robot)) in logs.iter().enumerate().filter(|(_, (from, ..))| from.is_dir()) {
        let [wheels, truth] = files.map(|file| from.join(file).display().to_string());
        let name = format!("plant-log-{number}");
        let units = ["--length-unit", "m", "--out", &name, "--force"];
        succeed(folder, &[&["import", "csv", &wheels, &truth], *robot, &units].concat());
        bundled(folder, &[&name], &["plant-log", "_wheels", "mocap", "turtle"]);
        imported.push(name);
    }
    assert!(imported.len() == logs.len() || !cases.is_dir(), "{imported:?}");
    let both: Vec<&str> = imported.iter().take(2).map(String::as_str).collect();
    bundled(folder, &both, &["plant-log", "_wheels"]);
    for read_alone in [cases.join("skid_factor_2.3"), data.join("penn24")].iter().filter(|set| set.is_dir()) {
        bundled(folder, &[&read_alone.display().to_string()], &["skid_", "penn"]);
    }
}

/// Makes the bundles of the repository anew; those that were there are to be removed before.
#[test]
#[ignore = "writes tests/cases"]
fn make_cases() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let temp = tempfile::tempdir().expect("a temporary folder");
    let mut spike = good(6603).only("square_cw");
    spike.odometry[700].2[0] = 4e9;
    for (name, log) in [
        ("wheels_exchanged", good(6600).only("square_cw").rows(|_, wheels| wheels.swap(0, 1))),
        ("clock_offset", good(6601).only("square_ccw").truths(|t_s, _| *t_s += 3.0)),
        ("not_determined", good(6602).only("straight")),
        ("counter_spike", spike),
    ] {
        write(&log, &temp.path().join(name));
        let bundle = cases.join(format!("{name}.zip")).display().to_string();
        let ended = run_in(temp.path(), &["check", name, "--bundle", &bundle, "--quiet"]);
        assert!(Path::new(&bundle).is_file(), "{}", ended.stderr);
    }
}

/// The bundles of the repository, one a problem, by its name.
#[test]
fn the_folder_of_cases_replays() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let replayed = document(&cases, &["replay-case", "."]);
    let list = replayed["cases"].as_array().expect("a list");
    assert!(list.len() >= 3 && replayed["ok"] == true, "{replayed}");
    for case in list {
        let name = Path::new(case["case"].as_str().expect("a path"))
            .file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        assert!(case["found"].get(&name).is_some(), "{case}");
    }
}

#[test]
fn other_problems_and_files_that_are_no_bundles_are_refused() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    write(&good(6500), &at.join("good"));
    write(&good(6500).rows(|_, wheels| wheels.swap(0, 1)), &at.join("exchanged"));
    let mut contents = ["good", "exchanged"].map(|name| {
        run_in(at, &["check", name, "--bundle", &format!("{name}.zip"), "--quiet"]);
        unzipped(&fs::read(at.join(format!("{name}.zip"))).expect("written"))
    });
    // What another program has packed is read too.
    fs::write(at.join("again.zip"), stored(&contents[1])).expect("written");
    succeed(at, &["replay-case", "again.zip"]);
    // The record of one and the tables of the other.
    contents[0][0] = contents[1][0].clone();
    fs::write(at.join("mixed.zip"), stored(&contents[0])).expect("written");
    let ended = run_in(at, &["replay-case", "mixed.zip"]);
    assert!(ended.code == Some(1) && ended.stdout.contains("OTHER PROBLEMS"), "{}", ended.stdout);
    assert!(ended.stderr.is_empty(), "{}", ended.stderr);
    contents[0].remove(0);
    fs::write(at.join("no-case.zip"), stored(&contents[0])).expect("written");
    contents[1][1].0 = "session-1/../../outside.toml".to_owned();
    fs::write(at.join("outside.zip"), stored(&contents[1])).expect("written");
    fs::write(at.join("text.zip"), "run,t_s").expect("written");
    fs::create_dir(at.join("empty")).expect("made");
    for (file, why) in [
        ("no-case.zip", "it has no case.toml"),
        ("outside.zip", "files that a bundle does not have"),
        ("text.zip", "it is no zip file"),
        ("empty", "has no bundle"),
        ("missing.zip", "missing.zip"),
    ] {
        let message = refusal(at, &["replay-case", file]);
        assert!(message.contains(why), "{file}: {message}");
    }
}
