//! One Monte-Carlo trial of the paper (30 straights, 30 spins, 10 squares): driven in closed form and
//! stepped, calibrated by each method, all of it together beside a bare loop that does the same and beside
//! trials side by side, a point of a sweep, and the Cramér–Rao bound of one. At last the ratios of these,
//! timed in turn: medians over rounds of the fastest of five.

mod yardstick;

use std::cell::Cell;
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use motion_programs::Schedule;
use scenario::{Engine, Instrument, Scenario};
use speed_gate::{Contender, Race};

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

/// What a trial costs beside stepping through it, beside the bare loop and beside trials side by side. In
/// turn in every round: a busy machine slows all of them.
#[allow(clippy::print_stdout)]
fn ratios(_: &mut Criterion) {
    const ROUNDS: usize = 9;
    let [closed_form, stepping, calibrated, bare_loop, side_by_side] = [0, 1, 2, 3, 4];
    let [mut closed, mut whole, mut lanes] =
        [(); 3].map(|()| bench::Trial::new(&paper(Engine::ClosedForm), 1).expect("simulates"));
    let mut stepped = bench::Trial::new(&paper(Engine::Stepping { step_s: 1e-3 }), 1).expect("simulates");
    let methods = ["direct", "umbmark"].map(|name| calib::method(name).expect("there"));
    let mut bare = yardstick::Yardstick::new(1);
    let numbers: [Cell<u64>; 4] = Default::default();
    let next = |contender: usize, by: u64| {
        numbers[contender].set(numbers[contender].get() + by);
        numbers[contender].get()
    };
    let mut contenders = [
        Contender::new("closed form", 100, || {
            black_box(closed.drive(next(0, 1)).expect("drives"));
        }),
        Contender::new("stepping", 1, || {
            black_box(stepped.drive(next(1, 1)).expect("drives"));
        }),
        Contender::new("with calibration", 100, || {
            let session = [whole.drive(next(2, 1)).expect("drives")];
            black_box(methods.map(|method| method.calibrate(&session).expect("applies")));
        }),
        Contender::new("bare loop", 100, || {
            black_box(bare.trial());
        }),
        Contender::new("side by side", 20, || {
            let replicates = lanes.drive_side_by_side(next(3, dataset::LANES as u64)).expect("goes in lanes");
            black_box(methods.map(|method| method.calibrate_replicates(replicates, dataset::LANES)));
        }),
    ];
    let race = Race::run(ROUNDS, &mut contenders);
    let lanes = dataset::LANES as f64;
    println!("\nratios of a trial, medians of {ROUNDS} rounds");
    println!("closed form              {:8.1} us", 1e6 * race.seconds(closed_form));
    println!("stepping / closed form   {:8.0}", race.ratio(stepping, closed_form).median);
    println!("with calibration         {:8.1} us", 1e6 * race.seconds(calibrated));
    println!("  of it the bare loop    {:8.0} %", 100.0 * race.ratio(bare_loop, calibrated).median);
    println!("side by side             {:8.2} us", 1e6 * race.seconds(side_by_side) / lanes);
    println!("  gain over one by one   {:8.2}", race.ratio(calibrated, side_by_side).times(lanes).median);
}

criterion_group!(benches, trial, sweep, bound, ratios);
criterion_main!(benches);
