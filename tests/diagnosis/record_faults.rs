//! What records show by themselves: cleared counters, descriptions of other robots, lengths of rows.
#![allow(clippy::print_stdout)] // every case with what was found

use dataset::{
    Dataset, Displacement, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
};
use diagnose::{Document, Options, Verdict, diagnose};
use kinematics::Increment;

use crate::hidden_effects::robot;
use crate::motion_capture::simulated;
use crate::support::real_data::real_data;
use plain_robot::PlainRobot;

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
        // Rows of zero are no clock of their own.
        assert!(document.findings.iter().all(|finding| finding.runs.is_none()), "{persistent}");
        // Wheels and separation are within 2 % of nominal again, as the scenario has them.
        let drive = &document.calibration.methods[0].parameters;
        let off = drive["left_wheel_diameter_m"].value.expect("a value") / scenario.robot.left_wheel_diameter_m - 1.0;
        assert!(off.abs() < 0.02, "{persistent}: {off}");
    }
}

/// Positions of a robot whose counters are swapped are those of one that drives backward with both counters
/// reversed; headings tell which it is. A second mistake is less likely than one.
#[test]
fn swapped_counters_are_two_reversed_ones_to_an_instrument_without_headings() {
    let poses = simulated(&robot("[[effect]]\nkind = \"swapped_wheels\"\nswapped = true\n"), 9_230);
    let mut positions = poses.clone();
    for sample in positions.runs.iter_mut().flat_map(|run| &mut run.truth) {
        *sample = TruthSample::new(sample.t_s, sample.x_m, sample.y_m, None);
    }
    let first = |dataset: &Dataset| diagnosed(dataset).findings.first().map(|found| found.names.clone());
    assert_eq!(first(&poses), Some(vec!["swapped_wheels".to_owned()]));
    assert_eq!(first(&positions), Some(vec!["swapped_wheels".to_owned(), "reversed_wheel".to_owned()]));
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
    // The scenario's own wheels are 1 % off nominal.
    assert!((found.parameters["scale"].value / 1.18 - 1.0).abs() < 0.02, "{:?}", found.parameters);
    // Within a tenth of what is stated nothing is said.
    let near = diagnosed(&described_otherwise("", 1.0 / 1.05, 1.0 / 1.05));
    assert!(near.findings.is_empty(), "{:?}", near.findings);
}

#[test]
fn effects_beside_a_skid_steered_base_are_named_and_beside_another_robots_are_doubted() {
    let lever = "[[effect]]\nkind = \"truth_lever_arm\"\nlever_x_m = 0.01\nlever_y_m = 0.005\n";
    let lever_of = |document: &Document| {
        let found = document.findings.iter().find(|finding| finding.names[0] == "truth_lever_arm");
        found.map(|finding| finding.names.clone()).expect("the lever arm")
    };
    // Stated wheels 1.6 times as near to each other as they work: as of a robot that skids in turns.
    let skids = diagnosed(&described_otherwise(lever, 1.0, 1.0 / 1.6));
    let wheelbase = skids.findings.iter().find(|finding| finding.names[0] == "wheelbase").expect("it is said");
    assert!((wheelbase.parameters["ratio"].value / 1.6 - 1.0).abs() < 0.02, "{:?}", wheelbase.parameters);
    assert!(wheelbase.sentence.contains("skids"), "{}", wheelbase.sentence);
    assert_eq!(lever_of(&skids), ["truth_lever_arm"]);
    // Wheels that are farther apart than they work are of no such robot.
    let narrow = diagnosed(&described_otherwise(lever, 1.0, 1.25));
    assert_eq!(lever_of(&narrow), ["truth_lever_arm", "unlisted"]);
}

/// Uniform draws in (0, 1): a multiplicative congruential generator (Park & Miller 1988).
struct Draws(u64);

impl Draws {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as f64 / 2_147_483_647.0
    }

    /// By the sum of twelve.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Speeds row by row of a log with gaps, beside displacements that last as long as the rows but for a share
/// of what these differ by. One row in a hundred is longer by far, in truth.
fn of_speeds(false_share: f64) -> Dataset {
    let robot = NominalRobot {
        left_wheel_diameter_m: 0.041,
        right_wheel_diameter_m: 0.041,
        wheel_separation_m: 0.09,
        ticks_per_rev: None,
        counter_bits: None,
    };
    let mut draws = Draws(11);
    let (mut t_s, mut v_mps, mut omega_radps, mut displacements) = (vec![0.0], vec![0.0], vec![0.0], Vec::new());
    for row in 0..1200_u32 {
        let (v_m_s, omega_rad_s) = (0.02 * f64::from(row % 5), 0.25 * (f64::from(row % 7) - 3.0));
        let long_s = if row % 100 == 50 { 0.2 } else { 0.0 };
        let jitter_s = if draws.uniform() < 0.5 { 0.014 } else { 0.0 } + 0.001 * draws.normal();
        let lasts_s = 0.79 + long_s + (1.0 - false_share) * jitter_s;
        let moved = Increment { distance_m: v_m_s * lasts_s, turn_rad: omega_rad_s * lasts_s }.arc();
        let t0_s = t_s[t_s.len() - 1];
        let t1_s = t0_s + 0.79 + long_s + jitter_s;
        displacements.push(Displacement {
            t0_s,
            t1_s,
            dx_m: moved.x_m + 5e-4 * draws.normal(),
            dy_m: moved.y_m + 5e-4 * draws.normal(),
            dtheta_rad: moved.theta_rad + 2e-3 * draws.normal(),
        });
        t_s.push(t1_s);
        v_mps.push(v_m_s);
        omega_radps.push(omega_rad_s);
    }
    let odometry = Odometry { t_s: t_s.into(), wheels: WheelLog::Twist { v_mps, omega_radps }, ..Odometry::default() };
    let info = RunInfo { id: "run-01".to_owned(), continuous: false, ..RunInfo::default() };
    Dataset {
        provenance: Provenance::default(),
        robot,
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: vec![Run { info, odometry, displacements, ..Run::default() }],
    }
}

#[test]
fn lengths_of_rows_that_err_beside_logged_speeds_have_a_negative_share() {
    let document = diagnosed(&of_speeds(1.0));
    let found = document.findings.first().expect("it is found");
    assert_eq!(found.names, ["interval_error"]);
    let (share, sigma) = (found.parameters["share"].value, found.parameters["share"].sigma.expect("fitted"));
    // Three standard deviations. Rejects long rows taken for false ones, which leave a fifth of the share.
    assert!((share + 1.0).abs() < 3.0 * sigma && sigma < 0.1, "{share} ± {sigma}");
    // Lengths that are true are none.
    let sound = diagnosed(&of_speeds(0.0));
    assert!(sound.findings.is_empty(), "{:?}", sound.findings);
}

#[test]
fn a_khepera_has_rows_of_false_length_and_wheels_of_its_published_size() {
    let name = "a_khepera_has_rows_of_false_length_and_wheels_of_its_published_size";
    let Some(folder) = real_data(name, "khepera") else { return };
    let importer = dataset::import::importer("censi").expect("an importer");
    let imported = importer.read(&folder.join("l90.tuple")).expect("a log").remove(0);
    let document = diagnosed(&imported.dataset);
    let found = document.findings.iter().find(|finding| finding.names[0] == "interval_error").expect("it is named");
    // Its displacements by least squares, rows that are 20 ms too long or short set aside, give −0.95; half
    // of the displacements are left here, and 0.1 is a little more than a standard deviation of theirs.
    let share = found.parameters["share"].value;
    assert!((share + 0.95).abs() < 0.1, "{share}");
    // At one speed a loss per second is as good as smaller wheels: 23 mm of 41.
    assert!(document.findings.iter().all(|finding| finding.names[0] != "low_speed_truncation"));
    let drive = &document.calibration.methods[0].parameters;
    for (wheel, published_m) in [("left_wheel_diameter_m", 0.041_179_6), ("right_wheel_diameter_m", 0.041_440_8)] {
        let off = drive[wheel].value.expect("a value") / published_m - 1.0;
        // Two of its standard deviations, and less than a twentieth of what the loss made of it.
        assert!(off.abs() < 0.02, "{wheel}: {off}");
    }
}

/// Most people write a log a run, with counters that begin at zero: wheels that stand between the runs keep
/// their angles all the same, and an eccentric wheel has one phase in all runs. Rejects a phase that begins
/// anew in each run, by which nothing of it is found.
#[test]
fn regress_an_eccentric_wheel_is_as_plain_where_counters_begin_anew() {
    let robot = PlainRobot { eccentricity: 3e-3, ..PlainRobot::ordinary(3510) };
    let (folder, _) = robot.written();
    let goes_on = dataset::read(folder.path()).expect("a dataset").dataset;
    let mut anew = goes_on.clone();
    for run in &mut anew.runs {
        let WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { panic!("counts") };
        for column in [&mut ticks.left, &mut ticks.right] {
            let first = column[0];
            column.iter_mut().for_each(|count| *count -= first);
        }
    }
    let written = tempfile::tempdir().expect("a folder");
    dataset::write(&anew, written.path(), dataset::Existing::Refuse).expect("written");
    let anew = dataset::read(written.path()).expect("a dataset").dataset;
    let z_of = |dataset: &Dataset| {
        let document = diagnosed(dataset);
        assert_eq!(document.findings[0].names, ["wheel_eccentricity"]);
        document.findings[0].z
    };
    let [goes_on, anew] = [&goes_on, &anew].map(z_of);
    println!("z {goes_on} where counters go on, {anew} where they begin anew");
    assert!(anew > 0.9 * goes_on, "{anew} of {goes_on}");
}
