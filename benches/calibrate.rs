//! Calibration and diagnosis of long logs: an hour of counts a hundred times a second and measurements ten
//! times a second, calibrated by each method that takes any path, and diagnosed with a slip and an eccentric
//! wheel in it.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dataset::Dataset;
use motion_programs::Schedule;
use scenario::{Engine, Instrument, Log, Scenario};

/// Squares of 4 m with wheels of other sizes and some more effects: 48 runs, an hour less five minutes.
fn hour(engine: Engine, more: &[&str]) -> Dataset {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motion-capture.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.engine = engine;
    scenario.effects.retain(|effect| {
        matches!(effect.id(), "wheel_scale" | "wheel_mismatch" | "wheelbase") || more.contains(&effect.id())
    });
    scenario.log = Some(Log { interval_s: 0.01 });
    scenario.protocols = vec![Schedule::Squares { side_m: 4.0, runs_each_way: 24 }];
    for instrument in &mut scenario.instruments {
        if let Instrument::MotionCapture { rate_hz, .. } = instrument {
            *rate_hz = 10.0;
        }
    }
    sim_yair::simulate(&scenario, 1, 0).expect("simulates").dataset
}

fn rows(dataset: &Dataset) -> u64 {
    dataset.runs.iter().map(|run| run.odometry.t_s.len() as u64).sum()
}

fn calibrate(criterion: &mut Criterion) {
    let dataset = hour(Engine::ClosedForm, &[]);
    let session = [dataset.session()];
    let mut group = criterion.benchmark_group("hour");
    group.sample_size(10).throughput(Throughput::Elements(rows(&dataset)));
    for name in ["joint", "linear", "censi", "segments", "augmented_kalman"] {
        let method = calib::method(name).expect("there");
        group.bench_function(name, |bencher| bencher.iter(|| method.calibrate(&session).expect("applies")));
    }
    group.finish();
}

fn diagnose(criterion: &mut Criterion) {
    let dataset = hour(Engine::Stepping { step_s: 1e-3 }, &["slip_speed", "wheel_eccentricity"]);
    let datasets = std::slice::from_ref(&dataset);
    let mut group = criterion.benchmark_group("hour");
    group.sample_size(10).throughput(Throughput::Elements(rows(&dataset)));
    group.bench_function("diagnose", |bencher| {
        bencher.iter(|| diagnose::diagnose(datasets, &diagnose::Options::default()).expect("a diagnosis"));
    });
    group.finish();
}

criterion_group!(benches, calibrate, diagnose);
criterion_main!(benches);
