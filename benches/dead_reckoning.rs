//! The dead-reckoning core: online, and over a whole log with every pose stored.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use kinematics::{Odometry, Pose, Rule, Wheels};
use std::hint::black_box;

const STEPS: i64 = 1_000_000;

/// A wandering robot of some ten counts a step.
fn counts() -> Wheels<Vec<i64>> {
    let column = |bend: i64| {
        (0..STEPS)
            .scan(0, |sum, k| {
                *sum += 10 + (k / 1000 * bend) % 7 - 3;
                Some(*sum)
            })
            .collect()
    };
    Wheels { left: column(3), right: column(5) }
}

fn dead_reckoning(criterion: &mut Criterion) {
    let counts = counts();
    let columns = Wheels { left: &counts.left[..], right: &counts.right[..] };
    let mut group = criterion.benchmark_group("dead_reckoning");
    group.throughput(Throughput::Elements(STEPS.unsigned_abs()));
    group.sample_size(20);
    for (name, rule) in [("midpoint", Rule::Midpoint), ("exact_arc", Rule::ExactArc)] {
        let odometry =
            Odometry { m_per_count: Wheels { left: 1.0334e-3, right: 1.0322e-3 }, wheel_separation_m: 0.363, rule };
        group.bench_function(format!("online/{name}"), |bencher| {
            bencher.iter(|| {
                let mut state = odometry.start(Pose::IDENTITY, Wheels::both(0_i64));
                for (&left, &right) in columns.left.iter().zip(columns.right) {
                    black_box(state.update(Wheels { left, right }));
                }
                state.world_from_body()
            });
        });
        group.bench_function(format!("whole_log/{name}"), |bencher| {
            bencher.iter(|| odometry.trajectory(Pose::IDENTITY, black_box(columns)));
        });
    }
    group.finish();
}

criterion_group!(benches, dead_reckoning);
criterion_main!(benches);
