//! Dead reckoning against what it could cost: a plain loop with the C library's sine and cosine, and a copy
//! of the same bytes.
//!
//! Every round times all contenders in turn, each by its fastest of five turns of about a millisecond, which
//! a busy machine seldom interrupts all; what is printed are medians over rounds, of times and of ratios
//! within a round. `docs/performance.md` has a run of it. Arguments: `--quick` for fewer rounds and no log
//! that exceeds the caches, `--check FILE` and `--write FILE` of `speed_gate`.

mod plain;

use std::hint::black_box;
use std::process::ExitCode;

use kinematics::{InstructionSet, Odometry, Pose, Rule, Wheels};
use speed_gate::{Contender, Gate, Race};

/// Bytes that a step of a log moves: two counts in, a pose out.
const BYTES_A_STEP: usize = 2 * size_of::<i64>() + size_of::<Pose>();

/// The contender that the others are compared with.
const PLAIN: usize = 0;

/// The log whose ratios the gate holds.
const GATED_STEPS: usize = 100_000;

fn odometry(rule: Rule) -> Odometry {
    Odometry { m_per_count: Wheels { left: 1.0334e-3, right: 1.0322e-3 }, wheel_separation_m: 0.363, rule }
}

/// A wandering robot of some ten counts a step.
fn counts(steps: usize) -> Wheels<Vec<i64>> {
    let column = |curvature: i64| {
        (0..)
            .scan(0, |sum, k: i64| {
                *sum += 10 + (k / 1000 * curvature) % 7 - 3;
                Some(*sum)
            })
            .take(steps)
            .collect()
    };
    Wheels { left: column(3), right: column(5) }
}

/// Times contenders in turn and prints each beside the first and beside the last. The ratios of a log that
/// fills the caches, a step of which costs what it does in every longer log, are the gate's.
#[allow(clippy::print_stdout)]
fn race(rule: &str, steps: usize, rounds: usize, contenders: &mut [Contender<'_>], gate: &mut Gate) {
    let race = Race::run(rounds, contenders);
    let copy = contenders.len() - 1;
    println!("\nWhole log, {rule}, {steps} steps");
    println!("{:<34} {:>8} {:>7} {:>11} {:>12}", "", "ns/step", "GB/s", "x plain", "of a copy");
    for (k, contender) in contenders.iter().enumerate() {
        let seconds = race.seconds(k) / steps as f64;
        let (faster, of_copy) = (race.ratio(PLAIN, k), race.ratio(copy, k));
        let (ns, gb_s) = (1e9 * seconds, 1e-9 * BYTES_A_STEP as f64 / seconds);
        let percent = 100.0 * of_copy.median;
        println!("{:<34} {ns:>8.2} {gb_s:>7.1} {:>11.2} {percent:>10.0} %", contender.name(), faster.median);
        if steps == GATED_STEPS && k != PLAIN && k < copy - 1 {
            gate.add(&format!("{rule}/{}/times plain", contender.name()), faster);
        }
    }
}

/// A log with every pose stored, by each instruction set.
fn whole_log(steps: usize, rounds: usize, gate: &mut Gate) {
    let counts = counts(steps);
    let columns = Wheels { left: &counts.left[..], right: &counts.right[..] };
    // Half of the bytes are read and half written.
    let source = vec![1_u8; steps * BYTES_A_STEP / 2];
    for (name, rule) in [("midpoint", Rule::Midpoint), ("exact arc", Rule::ExactArc)] {
        let odometry = odometry(rule);
        let buffers = || (vec![Pose::IDENTITY; steps], vec![0_u8; source.len()]);
        let ((mut plain_poses, mut copied), (mut poses, _)) = (buffers(), buffers());
        let poses = std::cell::RefCell::new(&mut poses);
        // A turn takes a millisecond or so.
        let calls = (100_000 / steps).max(1) as u32;
        let mut contenders = vec![Contender::new("plain loop, C library", calls, || {
            plain::trajectory(&odometry, Pose::IDENTITY, black_box(columns), &mut plain_poses);
        })];
        for set in InstructionSet::available() {
            let poses = &poses;
            contenders.push(Contender::new(format!("trajectory_into, {}", set.name()), calls, move || {
                odometry.trajectory_into_by(set, Pose::IDENTITY, black_box(columns), &mut poses.borrow_mut());
            }));
        }
        // By the widest instructions of the machine, which is part of what is compared.
        contenders.push(Contender::new(format!("final_pose, {}", InstructionSet::widest().name()), calls, || {
            black_box(odometry.final_pose(Pose::IDENTITY, black_box(columns)));
        }));
        contenders.push(Contender::new("update, one by one", calls, || {
            let mut state = odometry.start(Pose::IDENTITY, Wheels::both(0_i64));
            for ((&left, &right), pose) in columns.left.iter().zip(columns.right).zip(poses.borrow_mut().iter_mut()) {
                *pose = state.update(Wheels { left, right });
            }
        }));
        contenders.push(Contender::new("loads and stores alone", calls, || {
            let columns = black_box(columns);
            let rows = columns.left.iter().zip(columns.right);
            for (pose, (left, right)) in poses.borrow_mut().iter_mut().zip(rows) {
                let [left, right] = [left, right].map(|count| f64::from_bits(count.cast_unsigned()));
                *pose = Pose::new(left, right, left);
            }
            black_box(&poses);
        }));
        contenders.push(Contender::new("copy of the same bytes", calls, || {
            copied.copy_from_slice(black_box(&source));
            black_box(&mut copied);
        }));
        race(name, steps, rounds, &mut contenders, gate);
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let quick = arguments.iter().any(|argument| argument == "--quick" || argument == "--test");
    let rounds = if quick { 9 } else { 41 };
    let mut gate = Gate::new("dead_reckoning");
    for steps in [100, 1_000, GATED_STEPS] {
        whole_log(steps, rounds, &mut gate);
    }
    if !quick {
        whole_log(1_000_000, 15, &mut gate);
        whole_log(10_000_000, 9, &mut gate);
    }
    gate.exit_code(&arguments)
}
