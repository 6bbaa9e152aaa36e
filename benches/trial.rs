//! One Monte-Carlo trial of the paper (30 straights, 30 spins, 10 squares): driven in closed form and
//! stepped, calibrated by each method, all of it together beside a bare loop that does the same and beside
//! trials side by side, a point of a sweep, and the Cramér–Rao bound of one. At last the ratios of these,
//! timed in turn: medians over rounds of the fastest of five.

mod yardstick;

use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use motion_programs::Schedule;
use scenario::{Engine, Instrument, Scenario};

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
    group.throughput(Throughput::Elements(dataset::LANES as u64));
    group.bench_function("whole/side_by_side", |bencher| {
        bencher.iter(|| {
            number += dataset::LANES as u64;
            let replicates = trial.drive_side_by_side(number).expect("goes in lanes");
            methods.map(|method| method.calibrate_replicates(replicates, dataset::LANES))
        });
    });
    group.throughput(Throughput::Elements(1));
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

/// The bound of the paper's protocol, which every point of a sweep computes, and of a square of one minute
/// that is seen 20 times a second.
fn bound(criterion: &mut Criterion) {
    let protocol = paper(Engine::ClosedForm);
    let mut dense = protocol.clone();
    dense.protocols = vec![Schedule::Squares { side_m: 2.9, runs_each_way: 1 }];
    dense.instruments = vec![Instrument::MotionCapture {
        rate_hz: 20.0,
        sigma_xy_m: 1e-3,
        sigma_theta_rad: 1e-3,
        latency_s: 0.0,
        lever_x_m: 0.0,
        lever_y_m: 0.0,
        lever_theta_rad: 0.0,
    }];
    let mut group = criterion.benchmark_group("bound");
    group.sample_size(20);
    for (name, scenario) in [("protocol", protocol), ("dense", dense)] {
        let programs = scenario.programs();
        group.bench_function(name, |bencher| {
            bencher.iter(|| bench::FisherInformation::of(&scenario, &programs).expect("bounded"));
        });
    }
    group.finish();
}

/// Seconds of one call, the fastest of five times some.
fn fastest_s(calls: u32, mut call: impl FnMut()) -> f64 {
    let time = |_| {
        let started = Instant::now();
        (0..calls).for_each(|_| call());
        started.elapsed().as_secs_f64() / f64::from(calls)
    };
    (0..5).map(time).fold(f64::INFINITY, f64::min)
}

/// What a trial costs beside stepping through it and beside the bare loop. In turn in every round: a busy
/// machine slows all of them.
#[allow(clippy::print_stdout)]
fn ratios(_: &mut Criterion) {
    const ROUNDS: usize = 9;
    let [mut closed, mut whole] =
        [(); 2].map(|()| bench::Trial::new(&paper(Engine::ClosedForm), 1).expect("simulates"));
    let mut stepped = bench::Trial::new(&paper(Engine::Stepping { step_s: 1e-3 }), 1).expect("simulates");
    let methods = ["direct", "umbmark"].map(|name| calib::method(name).expect("there"));
    let mut bare = yardstick::Yardstick::new(1);
    let mut number = 0;
    let mut rounds = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let of_closed_s = fastest_s(100, || {
            number += 1;
            black_box(closed.drive(number).expect("drives"));
        });
        let of_stepping_s = fastest_s(1, || {
            number += 1;
            black_box(stepped.drive(number).expect("drives"));
        });
        let of_whole_s = fastest_s(100, || {
            number += 1;
            let session = [whole.drive(number).expect("drives")];
            black_box(methods.map(|method| method.calibrate(&session).expect("applies")));
        });
        let of_bare_s = fastest_s(100, || {
            black_box(bare.trial());
        });
        let of_block_s = fastest_s(20, || {
            number += dataset::LANES as u64;
            let replicates = whole.drive_side_by_side(number).expect("goes in lanes");
            black_box(methods.map(|method| method.calibrate_replicates(replicates, dataset::LANES)));
        });
        rounds.push([of_closed_s, of_stepping_s, of_whole_s, of_bare_s, of_block_s / dataset::LANES as f64]);
    }
    let median = |of: &dyn Fn(&[f64; 5]) -> f64| {
        let mut values: Vec<f64> = rounds.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    println!("\nratios of a trial, medians of {ROUNDS} rounds");
    println!("closed form              {:8.1} us", 1e6 * median(&|times| times[0]));
    println!("stepping / closed form   {:8.0}", median(&|times| times[1] / times[0]));
    println!("with calibration         {:8.1} us", 1e6 * median(&|times| times[2]));
    println!("  of it the bare loop    {:8.0} %", 100.0 * median(&|times| times[3] / times[2]));
    println!("side by side             {:8.2} us", 1e6 * median(&|times| times[4]));
    println!("  gain over one by one   {:8.2}", median(&|times| times[2] / times[4]));
}

criterion_group!(benches, trial, sweep, bound, ratios);
criterion_main!(benches);
