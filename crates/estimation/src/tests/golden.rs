//! Every number of a pass, and what fits end at, against those that were found before: `pass.txt` and
//! `fits.txt` of `tests/golden/`.
//!
//! A change that moves a number shows here, whatever it moves. The tests beside this one say that numbers are
//! right: gradients against differences, a known robot given back.

use std::fmt::Write;

use dataset::LidarExtrinsics;

use super::*;
use crate::{FitSettings, LogDeadReckoning, NoiseComponent, NormalEquations, PathShape, Solution};

/// Rows at 50 Hz whose stamps jitter, of ticks of 3 mrad and with a gap, beside poses at 7 Hz with a gap of
/// their own, by an instrument beside the drive's centre that is late.
pub(super) fn dense() -> Dataset {
    let mut dataset = dataset_of(2, true);
    let rad_per_tick = 3e-3;
    dataset.robot.ticks_per_rev = Some(std::f64::consts::TAU / rad_per_tick);
    for (number, run) in (0_u32..).zip(&mut dataset.runs) {
        let off = |k: f64| (12.9898 * k + 78.233 * f64::from(number)).sin();
        let rates = |t_s: f64| {
            let is_driving = f64::from(u8::from(t_s % 5.0 > 0.7));
            let [ahead, turn] = [3.0 + 1.5 * (1.3 * t_s).sin(), 1.2 * (0.8 * t_s + f64::from(number)).sin()];
            Wheels { left: is_driving * (ahead - turn), right: is_driving * (ahead + turn) }
        };
        // A millisecond a step.
        let (mut pose, mut turned) = (Pose::new(0.1, 0.3, 0.4), Wheels::both(0.0_f64));
        let (mut t_s, mut ticks, mut truth) = (Vec::new(), Wheels::both(Vec::new()), Vec::new());
        for step in 0..14_000_u32 {
            let now_s = 1e-3 * f64::from(step);
            if step.is_multiple_of(20) && !(6_000..6_200).contains(&step) {
                t_s.push(now_s + 2e-3 * off(f64::from(step)));
                ticks = ticks.zip_with(turned, |mut all: Vec<i64>, rad| {
                    all.push((rad / rad_per_tick).floor() as i64);
                    all
                });
            }
            if step % 143 == 71 && !(9_000..10_500).contains(&step) {
                let seen = pose * BODY_FROM_SENSOR;
                let error = |k: f64| 1e-3 * off(f64::from(step) + 0.37 * k);
                let theta_rad = Some(seen.theta_rad + error(3.0));
                truth.push(TruthSample::new(now_s + 0.02, seen.x_m + error(1.0), seen.y_m + error(2.0), theta_rad));
            }
            let step_rad = rates(now_s).map(|rad_s| 1e-3 * rad_s);
            let travel_m = Wheels { left: 0.0811 * step_rad.left, right: 0.0797 * step_rad.right };
            pose = pose * Increment::from_travel(travel_m, 0.366).arc();
            turned = turned.zip_with(step_rad, |turned, step| turned + step);
        }
        run.odometry.t_s = t_s.into();
        run.odometry.wheels = WheelLog::Ticks(ticks);
        run.truth = truth;
    }
    dataset
}

/// One of the runs' poses ten times as far off as the others, which is an outlier.
fn with_outlier(mut dataset: Dataset) -> Dataset {
    let sample = &mut dataset.runs[0].truth[3];
    sample.x_m += 0.2;
    dataset
}

fn sets() -> Vec<(&'static str, Dataset)> {
    let beside_walls = |lidar: Option<LidarExtrinsics>| walls::log(lidar);
    vec![
        ("headings", with_outlier(dataset(true))),
        ("positions", dataset_of(3, false)),
        ("dense", dense()),
        ("counts", rounding::counted()),
        ("ellipses", correlated::stated(true, 0.6)),
        ("displacements", selection::displacement_dataset(&[12, 9, 7], 0.6, 5)),
        ("late instants", timing::driven(3, 5e-3)),
        ("partial", partial::dataset(partial::GYRO, partial::all)),
        ("counts beside tapes", partial::in_counts(partial::dataset(partial::NO_GYRO, partial::all), 0.02)),
        ("beside poses", partial_poses::beside_poses(true, 1.0)),
        ("lidar", beside_walls(Some(LidarExtrinsics { yaw_rad: Some(2.7) }))),
        ("lidar of unknown yaw", beside_walls(Some(LidarExtrinsics::default()))),
    ]
}

fn terms() -> Vec<Box<dyn ModelTerm>> {
    vec![Box::new(TravelTerm), Box::new(RunDistanceTerm { distance_m: 0.5 })]
}

/// What a pass gives at a model near the truth.
fn write_pass(text: &mut String, name: &str, dataset: &Dataset) -> std::fmt::Result {
    let sessions = [dataset.session()];
    let noise = Noise { timing_s2: if name == "late instants" { 1e-5 } else { 0.0 }, ..NOISE };
    let mut fit = ModelFit::from_parameters(MODEL, noise, &sessions);
    fit.solution.model.term_values = vec![0.004, -0.003, 0.001, 0.002];
    let options = PassOptions { noise_score: true, innovations: true, samples: true, ..PassOptions::default() };
    for thinning in [Thinning::NONE, Thinning { every_s: 2.0, phases: 2 }] {
        let selections = Selection::of(&fit.records, thinning, &MODEL);
        let headings = &fit.solution.free_headings;
        let found = pass(&fit.records, &selections, &fit.solution.model, &noise, headings, &mut terms(), options);
        let NormalEquations { information, gradient, chi_square, log_det, count, .. } =
            total(&found.runs).expect("runs");
        writeln!(text, "{name}: information {:?}", information.as_slice())?;
        writeln!(text, "{name}: gradient {:?} of {chi_square} {log_det} {count}", gradient.as_slice())?;
        writeln!(text, "{name}: noise {:?} timing {:?}", found.noise, found.timing.z())?;
        writeln!(text, "{name}: outliers {:?} {:?}", found.outliers, found.partial_outliers)?;
        writeln!(text, "{name}: mean {}", selections[0].mean_measurements(&fit.records))?;
        for phase in found.innovations.iter() {
            writeln!(text, "{name}: innovations {:?} {:?}", phase.len(), phase.iter().step_by(37).collect::<Vec<_>>())?;
        }
        for phase in &found.samples {
            writeln!(text, "{name}: samples {:?}", phase.iter().step_by(37).collect::<Vec<_>>())?;
        }
        writeln!(text, "{name}: headings {:?}", found.headings)?;
    }
    let model = fit.solution.model.clone();
    let ends = fit.dead_reckoned_measurements(&model, &mut terms());
    writeln!(text, "{name}: ends {:?}", ends.iter().step_by(23).collect::<Vec<_>>())?;
    writeln!(text, "{name}: of noise {:?}", fit.end_variances().iter().step_by(5).collect::<Vec<_>>())?;
    writeln!(text, "{name}: {:?}", PathShape::of(&fit.records.segments, &MODEL))?;
    let displacements = 0..fit.records.segments.len();
    writeln!(text, "{name}: composed {:?}", fit.mahalanobis_distance(displacements))?;
    let blocks = fit.in_blocks(&mut terms(), 3);
    let of_block = |of: &NormalEquations| (of.run, of.chi_square, of.log_det, of.count, of.gradient[0]);
    writeln!(text, "{name}: blocks {:?}", blocks.iter().map(of_block).collect::<Vec<_>>())?;
    let within_row: Vec<f64> = (0..fit.records.segments.len()).map(|of| fit.within_row_share(of, 2)).collect();
    writeln!(text, "{name}: rounding {} {within_row:?}", fit.depends_on_rounding())?;
    writeln!(text, "{name}: extent {} {:?}", fit.records.extent_m(), fit.records.times_between().next())?;
    let again = fit.resimulated(&mut terms(), 7);
    writeln!(text, "{name}: resimulated {:?}", again.solution.pass.runs.iter().map(of_block).collect::<Vec<_>>())?;
    let session = dataset.session();
    for run in session.runs.iter().take(1) {
        let measured_s = [1.03, 2.71];
        let Some(log) = LogDeadReckoning::of(run, &dataset.robot, &measured_s, 0.5) else { continue };
        let poses = log.poses(&fit.solution.model, &mut terms(), Pose::new(0.3, 0.2, 0.1));
        let measured: Vec<_> = poses.iter().filter(|pose| pose.offset.is_some()).collect();
        writeln!(text, "{name}: log {} {:?} {measured:?}", log.distance_m(), poses.last())?;
    }
    Ok(())
}

/// What fits end at.
fn write_fit(text: &mut String, name: &str, dataset: &Dataset) -> std::fmt::Result {
    for settings in [FitSettings::GEOMETRY_ONLY, FitSettings::CALIBRATION] {
        let fit = settings.fit(&[dataset.session()]).expect("a fit");
        write_solution(text, name, &fit, &mut [])?;
        writeln!(text, "{name}: fixed {} {:?} {:?}", fit.unobservable.len(), fit.thinning, fit.partial_outliers())?;
    }
    let fit = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    let mut term: Vec<Box<dyn ModelTerm>> = vec![Box::new(TravelTerm)];
    write_solution(text, name, &fit.extended(&mut term).expect("a fit"), &mut term)?;
    write_solution(text, name, &fit.refit_ungated().expect("a fit"), &mut [])?;
    write_solution(text, name, &fit.without_noise(NoiseComponent::Turn, &mut []).expect("a fit"), &mut [])
}

/// Values with standard deviations and correlations.
fn write_solution(
    text: &mut String,
    name: &str,
    fit: &ModelFit<'_>,
    terms: &mut [Box<dyn ModelTerm>],
) -> std::fmt::Result {
    let Solution { model, noise, converged, left_basin, .. } = &fit.solution;
    let covariance = fit.covariance(terms).expect("determined");
    let sigma = covariance.diagonal().map(f64::sqrt);
    let correlation = |(row, column): (usize, usize)| covariance[(row, column)] / (sigma[row] * sigma[column]);
    let pairs = (1..sigma.len()).flat_map(|row| (0..row).map(move |column| (row, column)));
    let pairs: Vec<f64> = pairs.map(correlation).filter(|of| of.is_finite()).collect();
    writeln!(text, "{name}: {:?} {model:?} {:?} {converged} {left_basin}", fit.columns, noise.variance.map(f64::sqrt))?;
    writeln!(text, "{name}: sigma {:?} correlations {pairs:?} {}", sigma.as_slice(), fit.correlation())
}

#[test]
fn regress_no_number_of_a_pass_moves() {
    let mut text = String::new();
    for (name, dataset) in sets() {
        write_pass(&mut text, name, &dataset).expect("written");
    }
    golden_numbers::assert_unmoved(&file("pass.txt"), &text);
}

#[test]
fn regress_no_number_of_a_fit_moves() {
    let mut text = String::new();
    for (name, dataset) in sets() {
        write_fit(&mut text, name, &dataset).expect("written");
    }
    golden_numbers::assert_unmoved(&file("fits.txt"), &text);
}

fn file(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}
