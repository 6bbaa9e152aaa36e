//! What records show by themselves: cleared counters, descriptions of other robots, lengths of rows.
#![allow(clippy::print_stdout)] // every case with what was found

use dataset::{Dataset, WheelLog};
use diagnose::{Document, Options, Verdict, diagnose};

use crate::hidden_effects::{robot, simulated};
use crate::support::real_data::real_data;

fn diagnosed(dataset: &Dataset) -> Document {
    let document = diagnose(std::slice::from_ref(dataset), &Options::default()).expect("a diagnosis").document;
    for finding in &document.findings {
        println!("{} ({:.2}): {}", finding.names.join("|"), finding.probability, finding.sentence);
    }
    document
}

#[test]
fn a_counter_that_is_cleared_is_named_and_is_no_torn_byte() {
    for (persistent, probability) in [(false, 0.01), (true, 0.002)] {
        let scenario = robot(&format!(
            "[[effect]]\nkind = \"counter_reset\"\nprobability = {probability}\npersistent = {persistent}\n"
        ));
        let document = diagnosed(&simulated(&scenario, 9_200));
        let first = document.findings.first().expect("a finding");
        assert_eq!(first.names, ["counter_reset"], "{persistent}");
        assert_eq!(first.parameters["persistent"].value, f64::from(u8::from(persistent)));
        assert!(document.findings.iter().all(|finding| finding.names[0] != "torn_read"), "{persistent}");
        // Wheels and separation are within 2 % of nominal again, as the scenario has them.
        let drive = &document.calibration.methods[0].parameters;
        let off = drive["left_wheel_diameter_m"].value / scenario.robot.left_wheel_diameter_m - 1.0;
        assert!(off.abs() < 0.02, "{persistent}: {off}");
    }
}

/// The records of a robot whose description states other sizes.
fn described_otherwise(extra: &str, diameters: f64, separation: f64) -> Dataset {
    let mut dataset = simulated(&robot(extra), 9_210);
    dataset.robot.left_wheel_diameter_m *= diameters;
    dataset.robot.right_wheel_diameter_m *= diameters;
    dataset.robot.wheel_separation_m *= separation;
    dataset
}

#[test]
fn a_description_of_another_robot_is_a_finding() {
    let document = diagnosed(&described_otherwise("", 1.0 / 1.18, 1.0));
    assert!(document.verdict != Verdict::Consistent);
    let found = document.findings.iter().find(|finding| finding.names[0] == "wheel_scale").expect("wheels");
    // The scenario's own wheels are a few per mille off nominal.
    assert!((found.parameters["scale"].value / 1.18 - 1.0).abs() < 0.01, "{:?}", found.parameters);
    // Within a tenth of what is stated nothing is said.
    let near = diagnosed(&described_otherwise("", 1.0 / 1.05, 1.0 / 1.05));
    assert!(near.findings.is_empty(), "{:?}", near.findings);
}

#[test]
fn effects_beside_a_skid_steered_base_are_named_and_beside_another_robots_are_doubted() {
    let slip = "[[effect]]\nkind = \"slip_speed\"\nslip_s_m = 0.03\n";
    let slip_of = |document: &Document| {
        let found = document.findings.iter().find(|finding| finding.names[0] == "slip_speed");
        found.map(|finding| finding.names.clone()).expect("slip")
    };
    // Stated wheels 1.6 times as near to each other as they work: as of a robot that skids in turns.
    let skids = diagnosed(&described_otherwise(slip, 1.0, 1.0 / 1.6));
    let wheelbase = skids.findings.iter().find(|finding| finding.names[0] == "wheelbase").expect("it is said");
    assert!((wheelbase.parameters["ratio"].value / 1.6 - 1.0).abs() < 0.02, "{:?}", wheelbase.parameters);
    assert!(wheelbase.sentence.contains("skids"), "{}", wheelbase.sentence);
    assert_eq!(slip_of(&skids), ["slip_speed"]);
    // Wheels that are farther apart than they work are of no such robot.
    let narrow = diagnosed(&described_otherwise(slip, 1.0, 1.25));
    assert!(slip_of(&narrow).contains(&"unlisted".to_owned()));
}

/// Speeds in place of counts, row by row, and then rows of other lengths than they had.
fn of_speeds_with_wrong_stamps(mut dataset: Dataset) -> Dataset {
    let geometry = dataset.robot.geometry().expect("valid");
    let metres = dataset.robot.ticks_per_rev.map(|ticks| std::f64::consts::TAU / ticks).expect("ticks");
    for run in &mut dataset.runs {
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("counts") };
        let t_s = &run.odometry.t_s;
        let (mut v_mps, mut omega_radps) = (vec![0.0], vec![0.0]);
        for row in 1..t_s.len() {
            let speed = ticks.as_ref().map(|column| (column[row] - column[row - 1]) as f64 / (t_s[row] - t_s[row - 1]));
            let twist = geometry.twist(speed.zip_with(geometry.m_per_rad(), |counts_s, m| counts_s * metres * m));
            v_mps.push(twist.v_m_s);
            omega_radps.push(twist.omega_rad_s);
        }
        run.odometry.wheels = WheelLog::Twist { v_mps, omega_radps };
        // A third of a row, in no order that a motion has.
        let row_s = (t_s[t_s.len() - 1] - t_s[0]) / (t_s.len() - 1) as f64;
        let last = t_s.len() - 1;
        for (row, t_s) in run.odometry.t_s.iter_mut().enumerate().take(last).skip(1) {
            *t_s += row_s / 3.0 * (2.4 * row as f64 + 0.7 * (row as f64).powi(2)).sin();
        }
    }
    dataset
}

#[test]
fn stamps_that_err_beside_logged_speeds_have_a_negative_share() {
    let dataset = of_speeds_with_wrong_stamps(simulated(&robot(""), 9_220));
    let document = diagnosed(&dataset);
    let found = document.findings.iter().find(|finding| finding.names[0] == "interval_error").expect("it is found");
    let share = found.parameters["share"].value;
    // All of the irregularity is false, −1; which part of it the beat does not know is below a fifth.
    assert!((share + 1.0).abs() < 0.2, "{share}");
}

#[test]
fn a_khepera_has_rows_of_false_length_and_wheels_of_its_published_size() {
    let name = "a_khepera_has_rows_of_false_length_and_wheels_of_its_published_size";
    let Some(folder) = real_data(name, "khepera") else { return };
    let importer = dataset::import::importer("censi").expect("an importer");
    let imported = importer.read(&folder.join("l90.tuple")).expect("a log").remove(0);
    let document = diagnosed(&imported.dataset);
    let found = document.findings.iter().find(|finding| finding.names[0] == "interval_error").expect("it is named");
    // Its displacements by least squares, rows that are 20 ms too long or short set aside, give −0.95; half of
    // the displacements are left here, and 0.1 is a little more than a standard deviation of theirs.
    let share = found.parameters["share"].value;
    assert!((share + 0.95).abs() < 0.1, "{share}");
    // At one speed a loss per second is as good as smaller wheels: 23 mm of 41.
    assert!(document.findings.iter().all(|finding| finding.names[0] != "low_speed_truncation"));
    let drive = &document.calibration.methods[0].parameters;
    for (wheel, published_m) in [("left_wheel_diameter_m", 0.041_179_6), ("right_wheel_diameter_m", 0.041_440_8)] {
        let off = drive[wheel].value / published_m - 1.0;
        // Two of its standard deviations, and less than a twentieth of what the loss made of it.
        assert!(off.abs() < 0.02, "{wheel}: {off}");
    }
}
