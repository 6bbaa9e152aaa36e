//! Trials side by side against trials one by one: the paper's experiment (30 straights, 30 spins, 10 squares)
//! driven in closed form and calibrated by `direct` and `umbmark`. Arguments: `--check FILE` and
//! `--write FILE` of `speed_gate`.

use std::hint::black_box;
use std::process::ExitCode;

use motion_programs::Schedule;
use scenario::{PAPER, Scenario};
use speed_gate::{Contender, Gate, Race};

const ROUNDS: usize = 15;

#[allow(clippy::print_stdout)]
fn main() -> ExitCode {
    let mut scenario = Scenario::parse(PAPER, "paper.toml").expect("the shipped scenario");
    scenario.protocols = vec![
        Schedule::Straights { length_m: 0.5, runs: 30 },
        Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 30 },
        Schedule::Squares { side_m: 4.0, runs_each_way: 5 },
    ];
    let [mut one, mut lanes] = [(); 2].map(|()| bench::Trial::new(&scenario, 1).expect("simulates"));
    let methods = ["direct", "umbmark"].map(|name| calib::method(name).expect("there"));
    let (mut trial, mut first_lane) = (0, 0);
    let mut contenders = [
        Contender::new("one by one", 64, || {
            trial += 1;
            let session = [one.drive(trial).expect("drives")];
            black_box(methods.map(|method| method.calibrate(&session).expect("applies")));
        }),
        Contender::new("side by side", 12, || {
            first_lane += dataset::LANES as u64;
            let replicates = lanes.drive_side_by_side(first_lane).expect("goes in lanes");
            black_box(methods.map(|method| method.calibrate_replicates(replicates, dataset::LANES)));
        }),
    ];
    let race = Race::run(ROUNDS, &mut contenders);
    let faster = race.ratio(0, 1).times(dataset::LANES as f64);
    println!("a trial of the paper, one by one   {:8.2} us", 1e6 * race.seconds(0));
    println!("side by side                       {:8.2} us", 1e6 * race.seconds(1) / dataset::LANES as f64);
    println!(
        "  times one by one                 {:8.2} (quartiles {:.2} to {:.2})",
        faster.median, faster.low, faster.high
    );
    let mut gate = Gate::new("side_by_side");
    let set = kinematics::InstructionSet::widest().name();
    gate.add(&format!("paper/{set}/times one by one"), faster);
    gate.exit_code(&std::env::args().collect::<Vec<_>>())
}
