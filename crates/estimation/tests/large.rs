//! Fits of datasets on disk, in the memory of a part of them.

use dataset::{
    Blocks, Dataset, Existing, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
    write,
};
use estimation::{Column, FitSettings, Model, fit_large, is_large, many_rows, rows_and_measurements};
use kinematics::{Increment, Pose, Wheels};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const ROWS: usize = 2500;
const RUNS: usize = 3;
const M_PER_RAD: Wheels<f64> = Wheels { left: 0.0424, right: 0.04265 };
const SEPARATION_M: f64 = 0.2065;

/// Rows of 50 ms, every second one measured to half a millimetre and a milliradian.
fn run(number: usize) -> Run {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(number as u64);
    let mut normal = move |sigma: f64| -> f64 {
        let drawn: f64 = StandardNormal.sample(&mut random);
        sigma * drawn
    };
    let (mut pose, mut angle) = (Pose::IDENTITY, Wheels::both(0.0));
    let (mut t_s, mut angles, mut truth) = (Vec::new(), Wheels::both(Vec::new()), Vec::new());
    for row in 0..ROWS {
        let phase = (row / 100 + number) as f64;
        let turned = Wheels { left: 0.2 + 0.15 * (2.1 * phase).sin(), right: 0.2 + 0.15 * (3.3 * phase).cos() };
        t_s.push(0.05 * row as f64);
        angles.left.push(angle.left);
        angles.right.push(angle.right);
        if row % 2 == 0 {
            let (x_m, y_m) = (pose.x_m + normal(5e-4), pose.y_m + normal(5e-4));
            truth.push(TruthSample::new(t_s[row], x_m, y_m, Some(pose.theta_rad + normal(1e-3))));
        }
        angle = angle.zip_with(turned, |angle, turned| angle + turned);
        let rolled_m = M_PER_RAD.zip_with(turned, |m_per_rad, rad| m_per_rad * rad);
        let slid_m = rolled_m.map(|travel_m| travel_m + normal(4e-4 * travel_m.abs().sqrt()));
        pose = pose * Increment::from_travel(slid_m, SEPARATION_M).arc();
    }
    let info = RunInfo { id: format!("run-{number}"), continuous: true, ..RunInfo::default() };
    Run {
        info,
        odometry: Odometry { t_s: t_s.into(), wheels: WheelLog::Angles(angles), ..Odometry::default() },
        truth,
        ..Run::default()
    }
}

fn dataset() -> Dataset {
    Dataset {
        provenance: Provenance { name: Some("small".to_owned()), ..Provenance::default() },
        robot: NominalRobot {
            left_wheel_diameter_m: 0.085,
            right_wheel_diameter_m: 0.085,
            wheel_separation_m: 0.205,
            ticks_per_rev: None,
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: (0..RUNS).map(run).collect(),
    }
}

/// The blocks of the dataset in a folder of the test.
fn with_blocks<T>(test: &str, dataset: &Dataset, then: impl FnOnce(&mut [Blocks]) -> T) -> T {
    let folder = std::env::temp_dir().join(format!("yair-{test}-{}", std::process::id()));
    write(dataset, &folder, Existing::ReplaceDataset).expect("written");
    let mut blocks = [Blocks::open(&folder).expect("readable").expect("runs stand together")];
    let found = then(&mut blocks);
    std::fs::remove_dir_all(folder).expect("removed");
    found
}

#[test]
fn rows_and_measurements_are_counted_and_some_thousands_are_not_large() {
    with_blocks("counted", &dataset(), |blocks| {
        assert_eq!(rows_and_measurements(blocks), (RUNS * ROWS, RUNS * ROWS / 2));
        assert!(!many_rows(blocks) && !is_large(blocks));
    });
}

/// Subsamples of at most 65 536 measurements hold all of these.
#[test]
fn the_step_from_a_fit_of_everything_stays_there() {
    let dataset = dataset();
    let large = with_blocks("step", &dataset, |blocks| {
        fit_large(FitSettings::GEOMETRY_ONLY, blocks, |_, warning| panic!("{warning}")).expect("a fit")
    });
    let whole = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    assert_eq!((large.one_step.measurements, large.one_step.passes), (RUNS * ROWS / 2, 1));
    assert_eq!(large.names, ["small"]);
    assert!(large.fit.solution.converged && large.fit.unobservable.is_empty());
    let values = |Model { m_per_rad, separation_m, .. }: &Model| [m_per_rad.left, m_per_rad.right, *separation_m];
    let covariance = |fit: &estimation::ModelFit<'_>| {
        let (_, covariance) = fit.solution.information(&fit.columns).expect("runs").solve().expect("determined");
        covariance
    };
    let (of_large, of_whole) = (covariance(&large.fit), covariance(&whole));
    let pairs = values(&large.fit.solution.model).into_iter().zip(values(&whole.solution.model)).enumerate();
    for (column, (one, other)) in pairs {
        let sigma = of_whole[(column, column)].sqrt();
        // Subsamples begin and end at blocks, and each loses the motion from its last measurement on: of
        // thousands, a few.
        assert!(((one / other).ln() / sigma).abs() < 0.1, "{:?}: {one} {other} ± {sigma}", Column::GEOMETRY[column]);
        assert!((of_large[(column, column)].sqrt() / sigma - 1.0).abs() < 0.02, "{of_large} {of_whole}");
    }
    // Truth within four sigmas: one of 5000 seeds would be farther off.
    let truth = [M_PER_RAD.left, M_PER_RAD.right, SEPARATION_M];
    for (column, (found, truth)) in values(&large.fit.solution.model).into_iter().zip(truth).enumerate() {
        assert!((found / truth - 1.0).abs() < 4.0 * of_large[(column, column)].sqrt(), "{found} {truth}");
    }
}
