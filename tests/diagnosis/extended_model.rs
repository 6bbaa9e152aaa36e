//! Extended models in dead reckoning: what a diagnosis found makes logs drift less that it has not seen.
#![allow(clippy::print_stdout)] // every case with its drift

use calib::{AugmentedCalibration, CalibrationDrift, RunDrift, evaluate_runs};
use dataset::Dataset;
use diagnose::{ExtendedModel, ExtendedModelError, Options, diagnose};
use estimation::FitSettings;
use scenario::Scenario;

use crate::hidden_effects::{robot, simulated};

/// Effects that no geometry follows on these paths.
const LARGE: [(&str, &str); 3] = [
    ("turn_rate_wheelbase", "beta_s = 0.05"),
    ("wheel_eccentricity", "right_amplitude = 0.03\nright_phase_rad = 1.0"),
    ("carpet_nap", "drift_x = 0.01\ndrift_y = 0.005"),
];

/// A robot with an effect, and wheels of half the noise that the shipped one has: what is left of an effect
/// shows beside it.
fn quiet_robot(id: &str, sizes: &str) -> Scenario {
    let mut scenario = robot(&format!("[[effect]]\nkind = \"{id}\"\n{sizes}\n"));
    scenario.noise.wheel_sigma_m_per_sqrt_m *= 0.5;
    scenario
}

fn extended(dataset: &Dataset) -> Scenario {
    let found = diagnose(std::slice::from_ref(dataset), &Options::default()).expect("a diagnosis");
    let text = found.extended.expect("a scenario").to_toml().expect("has a text");
    Scenario::parse(&text, "extended.toml").expect("a scenario")
}

fn runs(dataset: &Dataset, model: &ExtendedModel) -> Vec<RunDrift> {
    let (records, _) = model.undone(dataset).expect("undone");
    evaluate_runs(&records.session(), Some(&model.calibration), false, &mut 0.0)
}

fn drift_percent(runs: Vec<RunDrift>) -> f64 {
    CalibrationDrift::of_runs(None, runs).drift_percent.expect("poses")
}

fn model(scenario: &Scenario) -> ExtendedModel {
    ExtendedModel::of(scenario).expect("a model")
}

/// The drift of the same draws without the effect, under the true geometry.
fn drift_of_noise(seed: u64) -> f64 {
    let mut scenario = quiet_robot("slip_speed", "slip_s_m = 0.0");
    scenario.effects.retain(|effect| effect.id() != "slip_speed");
    drift_percent(runs(&simulated(&scenario, seed), &model(&scenario)))
}

/// What is left is the noise of the wheels: by its own draws 1.0 to 1.1 times that of the robot without the
/// effect, as estimates are off by few σ. A third of the smallest effect left in would be 1.5 times it. The
/// geometry of the same diagnosis leaves the effect, 2.5 to 80 times the noise.
#[test]
fn an_extended_model_drifts_on_fresh_runs_as_the_noise_does_and_its_geometry_alone_far_more() {
    let noise_percent = drift_of_noise(72);
    for (id, sizes) in LARGE {
        let hidden = quiet_robot(id, sizes);
        let found = extended(&simulated(&hidden, 71));
        assert!(found.effects.iter().any(|effect| effect.id() == id), "{id}: {:?}", found.effects);
        let (model, fresh) = (model(&found), simulated(&hidden, 72));
        let extended_percent = drift_percent(runs(&fresh, &model));
        let geometry = AugmentedCalibration::from(model.calibration.calibration.clone());
        let geometry_percent = drift_percent(evaluate_runs(&fresh.session(), Some(&geometry), false, &mut 0.0));
        let nominal_percent = drift_percent(evaluate_runs(&fresh.session(), None, false, &mut 0.0));
        println!(
            "{id}: nominal {nominal_percent:.3} %, geometry {geometry_percent:.3} %, extended {extended_percent:.3} %, noise {noise_percent:.3} %"
        );
        assert!(extended_percent < 1.3 * noise_percent, "{id}");
        assert!(geometry_percent > 2.0 * extended_percent && nominal_percent > extended_percent, "{id}");
    }
}

/// Through the file's text and back, evaluation on the diagnosed runs is the dead reckoning of the diagnosis,
/// whose first measurement is at the log's first row and whose last one is within the log. Only sums are
/// in another order: a run of 2000 intervals rounds to 1e-12 m. Rejects a held value that is lost (the width
/// of a backlash moves ends by 1e-5 m) and terms that forget what the wheels did between two measurements.
#[test]
fn evaluation_on_the_diagnosed_runs_is_the_dead_reckoning_of_the_diagnosis() {
    let others = [
        ("backlash", "left_gap_m = 0.001\nright_gap_m = 0.001"),
        ("castor_kick", "kick_rad = 0.05\ndecay_m = 0.07"),
        ("term", "channel = \"yaw\"\ncovariates = [\"v\", \"x\"]\ncoefficient = 0.02"),
    ];
    for (id, sizes) in LARGE.into_iter().chain(others) {
        let dataset = simulated(&quiet_robot(id, sizes), 73);
        let sessions = [dataset.session()];
        let found = diagnose(std::slice::from_ref(&dataset), &Options::default()).expect("a diagnosis");
        assert!(!found.found.terms().is_empty(), "{id}");
        let fit = FitSettings::GEOMETRY_ONLY.fit(&sessions).expect("fits");
        let ends = fit.dead_reckoned(&found.found.model, &mut found.found.terms());
        let text = found.extended.expect("a scenario").to_toml().expect("has a text");
        let evaluated = runs(&dataset, &model(&Scenario::parse(&text, "extended.toml").expect("a scenario")));
        assert_eq!(ends.len(), evaluated.len(), "{id}");
        let off_m =
            ends.iter().zip(&evaluated).map(|(end, run)| (end.position_m - run.final_position_m.expect("poses")).abs());
        let off_m = off_m.fold(0.0, f64::max);
        println!("{id}: ends differ by {off_m:.1e} m");
        assert!(off_m < 1e-9, "{id}: {off_m}");
    }
}

/// Seen to reject: records that are not changed drift by 100 times as much.
#[test]
fn faults_of_the_records_are_undone_before_dead_reckoning() {
    let noise_percent = drift_of_noise(75);
    for (id, sizes) in [("swapped_wheels", "swapped = true"), ("wrong_counts_per_turn", "factor = 4.0")] {
        let hidden = quiet_robot(id, sizes);
        let found = model(&extended(&simulated(&hidden, 74)));
        assert!(found.changes_records(), "{id}");
        let fresh = simulated(&hidden, 75);
        let (_, remarks) = found.undone(&fresh).expect("undone");
        assert!(remarks.len() == 1 && remarks[0].contains(id), "{id}: {remarks:?}");
        let percent = drift_percent(runs(&fresh, &found));
        println!("{id}: {percent:.3} %, noise {noise_percent:.3} %");
        assert!(percent < 1.3 * noise_percent, "{id}: {percent}");
    }
    // Nothing measured says by which factor these records are wrong.
    let mut blind = simulated(&quiet_robot("wrong_counts_per_turn", "factor = 4.0"), 75);
    blind.runs.iter_mut().for_each(|run| run.truth.clear());
    let found = model(&quiet_robot("wrong_counts_per_turn", "factor = 4.0"));
    assert!(matches!(found.undone(&blind), Err(ExtendedModelError::NotUndone { .. })));
}

/// A scenario that somebody wrote is the model of its own robot, without any estimate; the bound is that of
/// the first test. Seen to reject sine and cosine exchanged.
#[test]
fn a_scenario_without_estimates_is_the_model_of_its_robot() {
    let noise_percent = drift_of_noise(76);
    let cycle = ("encoder_cycle", "cycles = 2\nleft_amplitude_rad = 0.05\nleft_phase_rad = 0.7");
    for (id, sizes) in LARGE.into_iter().chain([cycle]) {
        let scenario = quiet_robot(id, sizes);
        let percent = drift_percent(runs(&simulated(&scenario, 76), &model(&scenario)));
        println!("{id}: {percent:.3} %, noise {noise_percent:.3} %");
        assert!(percent < 1.3 * noise_percent, "{id}: {percent}");
    }
    let scatters = quiet_robot("contact_patch_wheelbase", "sigma_m = 0.001");
    let remarks = model(&scatters).remarks;
    assert!(remarks.len() == 1 && remarks[0].contains("contact_patch_wheelbase"), "{remarks:?}");
}
