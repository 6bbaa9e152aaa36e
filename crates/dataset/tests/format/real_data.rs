//! Importing what others measured. The logs are not part of this project: see the importers for where they
//! are.

use std::f64::consts::PI;
use std::path::Path;

use dataset::import::{Imported, importer};
use dataset::{Dataset, Existing, Protocol, RunInfo, WheelLog, read, write};

use crate::support::real_data;

fn import(format: &str, source: &Path) -> Vec<Imported> {
    importer(format).expect("a known format").read(source).expect("importable")
}

/// Writes, reads back and compares.
fn survives_the_disk(dataset: &Dataset) {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let dir = temp.path().join("set");
    write(dataset, &dir, Existing::Refuse).expect("written");
    assert_eq!(&read(&dir).expect("readable").dataset, dataset);
}

#[test]
fn optiodom_runs_are_what_their_folders_say() {
    let Some(folder) = real_data("optiodom_runs_are_what_their_folders_say", "optiodom") else { return };
    let mut runs = 0;
    for kind in ["square", "circular", "ivanjko"] {
        for session in import("optiodom", &folder.join("diff").join(kind)) {
            assert!(session.warnings.is_empty(), "{:?}", session.warnings);
            for run in &session.dataset.runs {
                check_label(kind, &run.info, &session.name);
                let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("ticks") };
                let turned_left = ticks.right.last() > ticks.left.last();
                if run.info.protocol != Some(Protocol::Straight) {
                    // The instrument saw the turn that the label says.
                    let theta_rad = run.truth.last().and_then(dataset::TruthSample::theta_rad).expect("a heading");
                    assert_eq!(theta_rad > 0.0, turned_left, "{} {}", session.name, run.info.id);
                }
                runs += 1;
            }
        }
    }
    // The published count of these sessions.
    assert_eq!(runs, 102);
}

#[track_caller]
fn check_label(kind: &str, info: &RunInfo, session: &str) {
    let settings = info.settings;
    let right = match (kind, info.protocol) {
        ("square", Some(Protocol::SquareCw | Protocol::SquareCcw)) => settings.side_m == Some(0.75),
        // Spirals of half turns from 0.375 m inwards, two or three times around.
        ("circular", Some(Protocol::CircleCw | Protocol::CircleCcw)) => {
            settings.radius_m.is_some_and(|radius_m| (0.28..0.33).contains(&radius_m))
        }
        ("ivanjko", Some(Protocol::Straight)) => settings.length_m == Some(1.5),
        ("ivanjko", Some(Protocol::Spin)) => settings.turn_rad.is_some_and(|turn_rad| turn_rad.abs() == PI),
        _ => false,
    };
    assert!(right, "{kind} {session} {info:?}");
}

#[test]
fn optiodom_sessions_come_in_order_and_survive_the_disk() {
    let Some(folder) = real_data("optiodom_sessions_come_in_order_and_survive_the_disk", "optiodom") else { return };
    let sessions = import("optiodom", &folder);
    let names: Vec<_> = sessions.iter().map(|session| session.name.as_str()).collect();
    // By path: circular, ivanjko, square; by session within.
    assert_eq!(names.len(), 14);
    assert_eq!((names[0], names[6], names[10]), ("250620202104", "250620201618", "230620202042"));
    let one = &import("optiodom", &folder.join("diff/ivanjko/250620201655"))[0];
    assert_eq!(one.dataset, sessions.iter().find(|session| session.name == one.name).expect("listed").dataset);
    assert_eq!(one.dataset.robot.wheel_separation_m, 0.205);
    assert_eq!(one.dataset.robot.left_wheel_diameter_m, 0.085);
    assert_eq!(one.dataset.robot.ticks_per_rev, Some(2796.8));
    assert_eq!(one.dataset.runs.len(), 9);
    survives_the_disk(&one.dataset);
}

#[test]
fn khepera_speeds_are_whole_counts() {
    let Some(folder) = real_data("khepera_speeds_are_whole_counts", "khepera") else { return };
    // One row at time 0 and one an object; the totals were summed by a script that shares nothing with the
    // importer.
    for (file, rows, left, right) in [("l90.tuple", 3296, -1399, 8959), ("lstraight.tuple", 4397, 4137, -2431)] {
        let imported = &import("censi", &folder.join(file))[0];
        assert_eq!(format!("{}.tuple", imported.name), file);
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
        let run = &imported.dataset.runs[0];
        assert_eq!((run.odometry.t_s.len(), run.displacements.len()), (rows, rows - 1));
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("ticks") };
        assert_eq!((ticks.left.last(), ticks.right.last()), (Some(&left), Some(&right)));
        assert_eq!(run.displacements.last().map(|step| step.t1_s), run.odometry.t_s.last().copied());
        survives_the_disk(&imported.dataset);
    }
}
