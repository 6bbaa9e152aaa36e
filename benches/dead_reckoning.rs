//! Dead reckoning against what it could cost: a plain loop with the C library's sine and cosine, and a copy
//! of the same bytes.
//!
//! Every round times all contenders in turn, each by its fastest of five turns of about a millisecond, which
//! a busy machine seldom interrupts all; what is printed are medians over rounds, of times and of ratios
//! within a round. `docs/performance.md` has a run of it. Arguments: `--quick` for fewer rounds and no log
//! that exceeds the caches.

mod plain;

use std::hint::black_box;
use std::time::Instant;

use kinematics::{InstructionSet, Odometry, Pose, Rule, Wheels};

/// Bytes that a step of a log moves: two counts in, a pose out.
const BYTES_A_STEP: usize = 2 * size_of::<i64>() + size_of::<Pose>();

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

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// One thing to be timed.
struct Contender<'a> {
    name: String,
    run: Box<dyn FnMut() + 'a>,
}

impl<'a> Contender<'a> {
    fn new(name: impl Into<String>, run: impl FnMut() + 'a) -> Self {
        Self { name: name.into(), run: Box::new(run) }
    }
}

/// Times contenders in turn and prints each beside the first and beside the last.
#[allow(clippy::print_stdout)]
fn race(
    title: &str,
    (steps, rounds): (usize, usize),
    (bytes_a_step, last): (usize, &str),
    mut contenders: Vec<Contender<'_>>,
) {
    // A turn is to take a millisecond or so, and only short ones are worth repeating.
    let again = (100_000 / steps).max(1);
    let turns = if steps > 1_000_000 { 1 } else { 5 };
    let times: Vec<Vec<f64>> = (0..rounds)
        .map(|_| {
            let time = |contender: &mut Contender<'_>| {
                let turn = |_| {
                    let started = Instant::now();
                    (0..again).for_each(|_| (contender.run)());
                    started.elapsed().as_secs_f64() / (again * steps) as f64
                };
                (0..turns).map(turn).fold(f64::INFINITY, f64::min)
            };
            contenders.iter_mut().map(time).collect()
        })
        .collect();
    println!("\n{title}, {steps} steps");
    println!("{:<34} {:>8} {:>7} {:>11} {:>12}", "", "ns/step", "GB/s", "x plain", last);
    for (k, contender) in contenders.iter().enumerate() {
        let of = |ratio: &dyn Fn(&[f64]) -> f64| median(times.iter().map(|times| ratio(times)).collect());
        let seconds = of(&|times| times[k]);
        let faster = of(&|times| times[0] / times[k]);
        let of_copy = of(&|times| times[times.len() - 1] / times[k]);
        let (ns, gb_s) = (1e9 * seconds, 1e-9 * bytes_a_step as f64 / seconds);
        println!("{:<34} {ns:>8.2} {gb_s:>7.1} {faster:>11.2} {:>10.0} %", contender.name, 100.0 * of_copy);
    }
}

/// A log with every pose stored, by each instruction set.
fn whole_log(steps: usize, rounds: usize) {
    let counts = counts(steps);
    let columns = Wheels { left: &counts.left[..], right: &counts.right[..] };
    // Half of the bytes are read and half written.
    let source = vec![1_u8; steps * BYTES_A_STEP / 2];
    for (name, rule) in [("midpoint", Rule::Midpoint), ("exact arc", Rule::ExactArc)] {
        let odometry = odometry(rule);
        let buffers = || (vec![Pose::IDENTITY; steps], vec![0_u8; source.len()]);
        let ((mut plain_poses, mut copied), (mut poses, _)) = (buffers(), buffers());
        let poses = std::cell::RefCell::new(&mut poses);
        let mut contenders = vec![Contender::new("plain loop, C library", || {
            plain::trajectory(&odometry, Pose::IDENTITY, black_box(columns), &mut plain_poses);
        })];
        for set in InstructionSet::available() {
            let poses = &poses;
            contenders.push(Contender::new(format!("trajectory_into, {}", set.name()), move || {
                odometry.trajectory_into_by(set, Pose::IDENTITY, black_box(columns), &mut poses.borrow_mut());
            }));
        }
        contenders.push(Contender::new("final_pose", || {
            black_box(odometry.final_pose(Pose::IDENTITY, black_box(columns)));
        }));
        contenders.push(Contender::new("update, one by one", || {
            let mut state = odometry.start(Pose::IDENTITY, Wheels::both(0_i64));
            for ((&left, &right), pose) in columns.left.iter().zip(columns.right).zip(poses.borrow_mut().iter_mut()) {
                *pose = state.update(Wheels { left, right });
            }
        }));
        contenders.push(Contender::new("loads and stores alone", || {
            let columns = black_box(columns);
            let rows = columns.left.iter().zip(columns.right);
            for (pose, (left, right)) in poses.borrow_mut().iter_mut().zip(rows) {
                let [left, right] = [left, right].map(|count| f64::from_bits(count.cast_unsigned()));
                *pose = Pose::new(left, right, left);
            }
            black_box(&poses);
        }));
        contenders.push(Contender::new("copy of the same bytes", || {
            copied.copy_from_slice(black_box(&source));
            black_box(&mut copied);
        }));
        race(&format!("Whole log, {name}"), (steps, rounds), (BYTES_A_STEP, "of a copy"), contenders);
    }
}

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick" || argument == "--test");
    let rounds = if quick { 9 } else { 41 };
    for steps in [100, 1_000, 100_000] {
        whole_log(steps, rounds);
    }
    if !quick {
        whole_log(1_000_000, 15);
        whole_log(10_000_000, 9);
    }
}
