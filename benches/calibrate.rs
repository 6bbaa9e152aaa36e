//! Calibration of long logs: an hour of counts a hundred times a second and looks ten times a second, by each method that takes any path.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dataset::Schedule;
use scenario::{Engine, Instrument, Log, Scenario};

/// Squares of 4 m: 48 runs, an hour less five minutes.
fn hour() -> Scenario {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motion-capture.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.engine = Engine::ClosedForm;
    scenario.effects.retain(|effect| matches!(effect.id(), "wheel_scale" | "wheel_mismatch" | "wheelbase"));
    scenario.log = Some(Log { interval_s: 0.01 });
    scenario.protocols = vec![Schedule::Squares { side_m: 4.0, runs_each_way: 24 }];
    for instrument in &mut scenario.instruments {
        if let Instrument::MotionCapture { rate_hz, .. } = instrument {
            *rate_hz = 10.0;
        }
    }
    scenario
}

fn calibrate(criterion: &mut Criterion) {
    let dataset = sim_yair::simulate(&hour(), 1, 0).expect("simulates").dataset;
    let rows: usize = dataset.runs.iter().map(|run| run.odometry.t_s.len()).sum();
    let session = [dataset.session()];
    let mut group = criterion.benchmark_group("hour");
    group.sample_size(10).throughput(Throughput::Elements(rows as u64));
    for name in ["joint", "linear", "censi", "segments", "augmented_kalman"] {
        let method = calib::method(name).expect("there");
        group.bench_function(name, |bencher| bencher.iter(|| method.calibrate(&session).expect("applies")));
    }
    group.finish();
}

criterion_group!(benches, calibrate);
criterion_main!(benches);
