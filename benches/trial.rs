//! One Monte-Carlo trial of the paper (30 straights, 30 spins, 10 squares): driven in closed form and stepped, calibrated by each method, all of it together
//! beside a bare loop that does the same, and a point of a sweep.

mod yardstick;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
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
    group.sample_size(20).throughput(Throughput::Elements(1));
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
    for method in calib::METHODS.iter().filter(|method| method.calibrate(&session).is_ok()) {
        group.bench_function(format!("calibrate/{}", method.name()), |bencher| {
            bencher.iter(|| method.calibrate(&session).expect("applies"));
        });
    }
    let mut trial = bench::Trial::new(&paper(Engine::ClosedForm), 1).expect("simulates");
    let methods = ["direct", "umbmark"].map(|name| calib::method(name).expect("there"));
    let mut number = 0;
    group.bench_function("whole/library", |bencher| {
        bencher.iter(|| {
            number += 1;
            let session = [trial.drive(number).expect("drives")];
            methods.map(|method| method.calibrate(&session).expect("applies"))
        });
    });
    let mut bare = yardstick::Yardstick::new(1);
    group.bench_function("whole/bare_loop", |bencher| {
        bencher.iter(|| {
            let found = bare.trial();
            (found.direct, found.umbmark)
        });
    });
    group.finish();
}

fn sweep(criterion: &mut Criterion) {
    let mut scenario = paper(Engine::ClosedForm);
    if let Some(sweep) = &mut scenario.sweep {
        sweep.axes.clear();
    }
    const TRIALS: u64 = 2000;
    let options = bench::SweepOptions { trials: Some(TRIALS), ..bench::SweepOptions::default() };
    let plan = bench::SweepPlan::new(&scenario, options).expect("a sweep");
    let mut group = criterion.benchmark_group("sweep");
    group.sample_size(10).throughput(Throughput::Elements(TRIALS));
    for jobs in [1, 2] {
        group.bench_function(format!("point/{jobs}_threads"), |bencher| {
            bencher.iter(|| plan.run(jobs, &|_| ()).expect("runs"));
        });
    }
    group.finish();
}

criterion_group!(benches, trial, sweep);
criterion_main!(benches);
