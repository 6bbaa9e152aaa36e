//! What functions of fits say of a few robots, against what they said before: the files of `tests/golden/`.
//! What is said of numbers that are none.

use std::fmt::Write;

use dataset::{Dataset, Run, TruthSample, WheelLog};
use estimation::{Model, ModelFit, Noise};
use kinematics::Wheels;

use crate::candidates::candidate::{Candidate, mean_terms};
use crate::candidates::physical::is_physical;
use crate::checks::residual_tests::{check, residual_persistence};
use crate::checks::residuals::residuals;
use crate::checks::run_to_run::differs_from_run_to_run;
use crate::checks::turn_to_turn::differs_from_turn_to_turn;
use crate::findings::detectability::detectability;
use crate::findings::geometry_deviations::{keeps_wheels, remaining_deviations};
use crate::findings::lack_of_fit::lack_of_fit;
use crate::fits::augmented_model::{AugmentedModel, cost, count, left_out_cost};
use crate::fits::fit_cache::FitCache;
use crate::fits::model_comparison::{form_error_statistic, log_bayes_factor, margin_over_units};
use crate::fits::null_distribution::NullDistribution;
use crate::fits::profile::fit_variant;
use crate::fits::scan::scan;
use crate::fits::wald::{cluster_robust_test, p_value_over, tests_of};
use crate::gain::extended_scenario::SamplingStatistics;
use crate::gain::gain_by_level;
use crate::records::part_of_runs::part_of_runs;
use crate::records::record_faults::sessions;
use crate::search::selection::{search, search_ungated};
use crate::search::sparse_terms::SparseSearch;
use crate::settings::LEVELS;
use crate::small_robot::{assert_unmoved, effect, fitted, session, with_effects};
use crate::{Options, diagnose};

/// A robot whose right wheel seems larger in every other run, so that runs differ.
fn differing() -> Dataset {
    let mut dataset = session(0, 0.1);
    for run in dataset.runs.iter_mut().step_by(3) {
        let WheelLog::Angles(angles) = &mut run.odometry.wheels else { panic!("angles are logged") };
        angles.right.iter_mut().for_each(|rad| *rad *= 1.004);
    }
    dataset
}

/// So few ticks that their rounding shows: two centimetres each.
const COARSE: f64 = 25.0;

/// A robot with so many ticks in a turn of a wheel.
fn ticking(ticks_per_rev: f64) -> Dataset {
    let mut dataset = session(0, 0.1);
    dataset.robot.ticks_per_rev = Some(ticks_per_rev);
    for run in &mut dataset.runs {
        let WheelLog::Angles(angles) = &run.odometry.wheels else { panic!("angles are logged") };
        let ticks = angles
            .as_ref()
            .map(|of| of.iter().map(|rad| (rad * ticks_per_rev / std::f64::consts::TAU).floor() as i64).collect());
        run.odometry.wheels = WheelLog::Ticks(ticks);
    }
    dataset
}

/// What is asked of a base fit and of models with effects.
fn asked(datasets: &[Dataset]) -> String {
    let mut text = String::new();
    let mut line = |name: &str, what: &dyn std::fmt::Debug| writeln!(text, "{name}: {what:?}").expect("written");
    let base = fitted(datasets);
    let alone = AugmentedModel::base(&base);
    let of_latency = with_effects(&base, &["truth_latency"]);
    let model = with_effects(&base, &["slip_speed", "truth_latency"]);
    line("costs", &[cost(&base, count(&base)), cost(&model.fit, count(&base) + 3.0)]);
    let equations = &model.fit.solution.pass.runs[0];
    line("left out", &[left_out_cost(equations, equations.count + 2.0), left_out_cost(equations, 1.0)]);
    line("runs differ", &[differs_from_run_to_run(&alone), differs_from_run_to_run(&model)]);
    line("turns differ", &[differs_from_turn_to_turn(&alone), differs_from_turn_to_turn(&model)]);
    line("margins", &[margin_over_units(10.0, &model, &alone), margin_over_units(1000.0, &of_latency, &model)]);
    line("Bayes", &[log_bayes_factor(&base, &model), log_bayes_factor(&base, &of_latency)]);
    line("form", &[form_error_statistic(&model), form_error_statistic(&of_latency)]);
    line("tests", &tests_of(&model, &[vec![0.0], vec![0.01]]));
    line("over runs", &[0.9, 0.05, 1e-6].map(|level| [0, 1].map(|of| cluster_robust_test(&model, of, level))));
    let inflation = FitCache::of(&base).inflation_of(&of_latency, &model.candidates[0]);
    line("deflated", &p_value_over(&model, 0, inflation));
    line("wheels", &[keeps_wheels(&base, &model.fit), keeps_wheels(&model.fit, &base)]);
    line("deviations", &remaining_deviations(&base, &model));
    line("possible", &[is_physical(&model, 0), is_physical(&model, 1)]);
    line("next", &[0, 1, 2].map(|component| residual_persistence(&alone, component)));
    let checked = check(&model);
    let correlation = (checked.correlation.coefficient, checked.correlation.sigmas);
    line("checks", &(checked.checks, correlation, checked.outliers, checked.autocorrelated));
    line("lack of fit", &lack_of_fit(&base, &of_latency, &[0]));
    // Profiles of residuals are long, and those of one robot go through what makes all.
    if datasets.len() == 1 && datasets[0].robot.ticks_per_rev.is_none() {
        line("residuals", &residuals(&base, &model));
    }
    let names: Vec<String> = (0..datasets.len()).map(|number| number.to_string()).collect();
    line("gain", &gain_by_level(&alone, &model, &names));
    line("gain of latency", &gain_by_level(&of_latency, &model, &names));
    let sampling = SamplingStatistics::of(datasets, &model);
    line("sampling", &[sampling.speed_m_s, sampling.between_rows_s, sampling.between_measurements_s]);
    let others = [effect("slip_speed"), effect("backlash"), effect("castor_drag"), effect("wheel_eccentricity")];
    for scored in scan(&of_latency.fit, &of_latency.candidates, &others) {
        line("scan", &scored);
    }
    line("detectability", &detectability(&of_latency, &others, &mut FitCache::of(&base)));
    text
}

#[test]
fn regress_no_number_of_a_model_moves() {
    for (name, datasets) in [
        ("two sessions", vec![session(0, 0.1), session(1, 0.1)]),
        ("differing", vec![differing()]),
        ("coarse", vec![ticking(COARSE)]),
    ] {
        assert_unmoved(&format!("{}.txt", name.replace(' ', "_")), &asked(&datasets));
    }
}

#[test]
fn regress_no_number_of_a_gain_of_few_runs_moves() {
    let mut text = String::new();
    // Fewer than six runs are cut into blocks.
    for runs in [1, 2, 5, 6] {
        let mut dataset = session(0, 0.1);
        dataset.runs.truncate(runs);
        let datasets = [dataset];
        let base = fitted(&datasets);
        let (alone, model) = (AugmentedModel::base(&base), with_effects(&base, &["slip_speed"]));
        writeln!(text, "{runs}: {:?}", gain_by_level(&alone, &model, &["a".to_owned()])).expect("written");
    }
    assert_unmoved("few_runs.txt", &text);
}

#[test]
fn regress_no_number_of_coarse_encoders_moves() {
    let datasets = [ticking(COARSE)];
    let base = fitted(&datasets);
    let alone = AugmentedModel::base(&base);
    let null = NullDistribution::of(&alone).expect("the rounding of counts shows");
    let parts = [effect("slip_speed"), effect("castor_drag")];
    let inflation = null.inflation(&[&parts[..1], &parts[..]]);
    // No test is made stricter than by formula, and a part for itself is inflated as among others.
    let mut known = FitCache::of(&base);
    assert!(inflation.iter().all(|of| *of >= 1.0) && known.inflation_of(&alone, &parts[0]) == inflation[0]);
    // One that is known already, and one that is not, in their order.
    let castor = known.inflation_of_each(&alone, &[parts[1].clone(), parts[0].clone()]);
    assert_eq!(castor, [null.inflation(&[&parts[1..]])[0], inflation[0]]);
    assert_unmoved("null_distribution.txt", &format!("{inflation:?}\n"));
    assert!(NullDistribution::of(&AugmentedModel::base(&fitted(&[ticking(1e6)]))).is_none());
}

#[test]
fn regress_no_number_of_a_variant_that_is_fitted_moves() {
    let datasets = [session(0, 0.1)];
    let base = fitted(&datasets);
    let mut text = String::new();
    // Of each effect with a variant that may be anything, one in the middle of what is tried.
    let all = mean_terms(&[]);
    let of_grids = all.chunk_by(|a, b| a.id() == b.id()).filter(|variants| !variants[0].grid().is_empty());
    for variants in of_grids.take(3) {
        let candidate = variants[variants.len() / 2].clone();
        let none = AugmentedModel::base(&base);
        let Some(mut model) = crate::fits::augmented_model::refit(&base, &none, vec![candidate]) else { continue };
        let extra_sigma = fit_variant(&base, &mut model, 0);
        let held: Vec<(&str, f64)> = model.candidates[0].fixed();
        writeln!(text, "{} {held:?} {extra_sigma:?} {:?}", variants[0].id(), model.estimates(0).as_slice())
            .expect("written");
    }
    // What has no such variant is not known less well for one.
    assert_eq!(fit_variant(&base, &mut with_effects(&base, &["truth_latency"]), 0), [0.0]);
    assert_unmoved("variants.txt", &text);
}

#[test]
fn a_part_of_runs_is_a_third_at_the_most_and_six_of_them_at_the_least() {
    // So many runs with so many poses each; 16384 poses are a part.
    let part = |runs: usize, poses: usize| {
        let mut dataset = session(0, 0.0);
        let mut run = dataset.runs[0].clone();
        // A row beside each pose.
        let t_s: Vec<f64> = (0..=poses).map(|k| 20.0 * k as f64 / poses as f64).collect();
        run.truth = t_s.iter().map(|t_s| TruthSample::new(*t_s, 0.0, 0.0, Some(0.0))).collect();
        run.odometry.wheels = WheelLog::Angles(Wheels::both(t_s.clone()));
        run.odometry.t_s = t_s.into();
        dataset.runs = vec![run; runs];
        let datasets = [dataset];
        let noise = Noise { variance: [1e-6; 4], timing_s2: 0.0 };
        let model = Model::of(&datasets[0].robot.geometry().expect("a drive"), 0);
        let base = ModelFit::from_parameters(model, noise, &sessions(&datasets));
        part_of_runs(&datasets, &base).map(|part| part.iter().map(|session| session.runs.len()).sum::<usize>())
    };
    // Of 24 runs of 2500 poses 0.273 are taken: 6.55 runs. Rejects a part of all runs, and of none.
    assert!(part(24, 2500).is_some_and(|runs| (5..=8).contains(&runs)), "{:?}", part(24, 2500));
    // 48000 poses are less than three parts, and of 20 runs 5.46 would be taken.
    assert_eq!((part(24, 2000), part(20, 3000)), (None, None));
}

type Edit = fn(&mut Run, usize, f64);

fn angles(run: &mut Run) -> &mut Wheels<Vec<f64>> {
    let WheelLog::Angles(angles) = &mut run.odometry.wheels else { panic!("angles are logged") };
    angles
}

/// A log with a value in place of a column: no reader lets one in, and nothing is said of it.
#[test]
fn a_log_of_numbers_that_are_none_has_no_diagnosis() {
    let columns: [(&str, Edit); 5] = [
        ("x_m", |run, row, value| run.truth[row].x_m = value),
        ("y_m", |run, row, value| run.truth[row].y_m = value),
        ("theta_rad", |run, row, value| {
            let TruthSample { t_s, x_m, y_m, .. } = run.truth[row];
            run.truth[row] = TruthSample::new(t_s, x_m, y_m, Some(value));
        }),
        ("left", |run, row, value| angles(run).left[row] = value),
        ("right", |run, row, value| angles(run).right[row] = value),
    ];
    let said = |edit: Edit, value: f64| {
        let mut dataset = session(0, 0.0);
        for run in &mut dataset.runs {
            // Signs by turns, so that differences overflow too.
            (1..run.truth.len()).for_each(|row| edit(run, row, if row % 2 == 1 { value } else { -value }));
        }
        diagnose(&[dataset], &Options::default()).map(|found| found.document.sentence)
    };
    assert!(said(|_, _, _| {}, 0.0).is_ok(), "the sound log");
    let mut diagnosed = Vec::new();
    for (name, edit) in columns {
        for value in [f64::NAN, f64::INFINITY, 1e200] {
            // A heading that is NaN is one that was not measured, and of any size it is one modulo a turn.
            if let Some(sentence) = said(edit, value).ok().filter(|_| name != "theta_rad" || value.is_infinite()) {
                diagnosed.push(format!("{name} = {value:e}: {sentence}"));
            }
        }
    }
    assert!(diagnosed.is_empty(), "{diagnosed:#?}");
}

/// A robot whose wheels turn by two centimetres on the spot as they reverse, once in a run.
fn with_backlash() -> Dataset {
    let mut dataset = session(0, 0.0);
    for run in &mut dataset.runs {
        let WheelLog::Angles(angles) = &mut run.odometry.wheels else { panic!("angles are logged") };
        for side in [&mut angles.left, &mut angles.right] {
            let lost_rad = (0.02 / 0.08_f64).copysign(side[120] - side[110]);
            side[101..].iter_mut().for_each(|rad| *rad += lost_rad);
        }
    }
    dataset
}

#[test]
fn regress_no_number_of_an_ungated_search_moves() {
    let datasets = [with_backlash()];
    let base = fitted(&datasets);
    let open = base.refit_ungated().expect("all poses are taken");
    let catalogue: Vec<Candidate> = ["backlash", "truth_latency", "slip_speed"].map(effect).to_vec();
    // Nothing was found among the measurements that the gate leaves.
    let found = search(FitCache::of(&base), &[], LEVELS.scan_level);
    let bold = search(FitCache::of(&open), &catalogue, LEVELS.scan_level);
    let bold = (bold.model.candidates, bold.tests, bold.refusals);
    let ungated = search_ungated(&found, &catalogue);
    let all = ungated.map(|of| (of.model.candidates, of.tests, of.refusals));
    let alone = AugmentedModel::base(&base);
    let term = SparseSearch::beside(1.0, &base, &alone);
    let best = term.as_ref().and_then(|of| of.best_prediction(1.0)).map(|of| (of.p_value, of.trials, of.certain));
    let outliers = base.solution.pass.outliers.len();
    assert_unmoved("ungated.txt", &format!("{outliers} outliers\n{bold:#?}\n{all:#?}\n{best:?}\n"));
}
