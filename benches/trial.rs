//! One Monte-Carlo trial of the paper (30 straights, 30 spins, 10 squares): driven in closed form and stepped, and calibrated by each method.

use criterion::{Criterion, criterion_group, criterion_main};
use dataset::Schedule;
use scenario::{Engine, Scenario};

fn paper(engine: Engine) -> Scenario {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.engine = engine;
    scenario.protocols = vec![
        Schedule::Straights { length_m: 0.5, runs: 30 },
        Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 30 },
        Schedule::Squares { side_m: 4.0, runs_each_way: 5 },
    ];
    scenario
}

fn trial(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("trial");
    group.sample_size(10);
    for (name, engine) in [("closed_form", Engine::ClosedForm), ("stepped", Engine::Stepping { step_s: 1e-3 })] {
        let mut trial = bench::Trial::new(&paper(engine), 1).expect("simulates");
        let mut number = 0;
        group.bench_function(format!("drive/{name}"), |bencher| {
            bencher.iter(|| {
                number += 1;
                trial.drive(number).expect("drives").runs.len()
            });
        });
    }
    let mut trial = bench::Trial::new(&paper(Engine::ClosedForm), 1).expect("simulates");
    let session = [trial.drive(0).expect("drives")];
    for method in calib::METHODS {
        group.bench_function(format!("calibrate/{}", method.name()), |bencher| {
            bencher.iter(|| method.calibrate(&session).expect("applies"));
        });
    }
    group.finish();
}

criterion_group!(benches, trial);
criterion_main!(benches);
