//! `wrong_counts_per_turn`: a counter makes another number of counts of a turn than the dataset states.
//!
//! Model: logged = factor × counts: two or four of one edge, a gear left out, radians for turns, millimetres
//! for inches.
//! Signature: every distance and every turn is off by that factor. A gross fault, tried before any fit: the
//! records without it believe the factor that the distances measured outside show, where that is far from
//! one; of runs seen at their ends alone, each factor by which people err is tried.
//! Observability: any distance measured outside, or turns.
//! Alias: `wheel_scale`, whose sizes are per cents.
//! Reference: quadrature decoding ×1, ×2, ×4; the units that people mix.

use dataset::{Dataset, RunView, WheelLog, median};
use kinematics::{Pose, Rule, Twist, Wheels, sinc};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, RecordFault};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, RecordCorrection, rewrite_wheels, value_of};
use crate::on_board::{Correction, OnBoard, RawInterval};
use crate::settings;

/// Factors by which people err.
const FACTORS: [(f64, &str); 14] = [
    (2.0, "decoded twice as finely"),
    (4.0, "decoded four times as finely"),
    (0.5, "decoded half as finely"),
    (0.25, "decoded a quarter as finely"),
    (std::f64::consts::TAU, "radians for turns"),
    (1.0 / std::f64::consts::TAU, "turns for radians"),
    (180.0 / std::f64::consts::PI, "degrees for radians"),
    (std::f64::consts::PI / 180.0, "radians for degrees"),
    (25.4, "millimetres for inches"),
    (1.0 / 25.4, "inches for millimetres"),
    (10.0, "a decimal point"),
    (0.1, "a decimal point"),
    (1000.0, "millimetres for metres"),
    (0.001, "metres for millimetres"),
];

/// What a robot's own odometry does first.
const ON_BOARD: OnBoard = OnBoard::Constant(Correction {
    statements: "\
left_counts /= factor;
right_counts /= factor;",
    correct: |size, raw| RawInterval { counts: raw.counts.map(|counts| counts / size("factor")), ..raw },
    counter_bits: None,
});

/// Counts of a turn, logged over nominal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrongCountsPerTurn {
    /// Logged over nominal counts of a turn.
    pub factor: f64,
}

impl PhysicalEffect for WrongCountsPerTurn {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_positive("wrong_counts_per_turn", [("factor", self.factor)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            record_fault: RecordFault {
                leaves_a_trace: false,
                counts_factor: Some("factor"),
                ..RecordFault::WITH_A_TRACE
            },
            benchmark: Benchmark::of_fault(|_, stream| vec![("factor", [0.25, 0.5, 2.0, 4.0][stream.below(4)])]),
            on_board: ON_BOARD,
            ..Description::of("a wheel turn makes another number of counts than the dataset states")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { factor: value_of(values, "factor")? })
    }
}

struct State {
    effect: WrongCountsPerTurn,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { readout: true, ..Hooks::NONE }
    }

    fn readout(&mut self, readout: &mut Readout) {
        let logged = |counts: i64| (counts as f64 * self.effect.factor).floor() as i64;
        readout.ticks = readout.ticks.map(logged);
    }
}

/// Counted over seen amounts between measurements that are far enough apart: of the distance, and of the
/// turn.
fn ratios(dataset: &Dataset, run: &RunView<'_>) -> Option<[Vec<f64>; 2]> {
    let geometry = dataset.robot.geometry().ok()?;
    // The distance and the turn by the counts at every row; travel of single wheels add up where the robot
    // spins, so both are signed sums.
    let mut track: Vec<(f64, [f64; 2])> = Vec::new();
    let (mut amounts, mut before) = ([0.0; 2], None::<Pose>);
    run.dead_reckon(&dataset.robot, &geometry, Rule::ExactArc, Pose::IDENTITY, |t_s, pose| {
        let step = before.map_or(Pose::IDENTITY, |before| before.to(pose));
        let chord_m = step.x_m.hypot(step.y_m);
        // An arc is longer than its chord by the sinc of half its turn.
        amounts[0] += chord_m / sinc(0.5 * step.theta_rad).abs().max(0.1);
        amounts[1] += step.theta_rad;
        before = Some(pose);
        track.push((t_s, amounts));
    });
    let at = |t_s: f64| {
        let after = track.partition_point(|(row_s, _)| *row_s < t_s);
        let (to_s, to) = track.get(after)?;
        let (from_s, from) = track.get(after.saturating_sub(1))?;
        let share = if to_s > from_s { (t_s - from_s) / (to_s - from_s) } else { 0.0 };
        Some([0, 1].map(|k| from[k] + share * (to[k] - from[k])))
    };
    let mut found = [Vec::new(), Vec::new()];
    for poses in measured_poses(run) {
        let mut anchors: [Option<(Pose, [f64; 2])>; 2] = [None; 2];
        for (t_s, pose) in poses {
            let Some(counted) = at(t_s) else { continue };
            for k in 0..2 {
                let Some((anchor, start)) = anchors[k] else {
                    anchors[k] = Some((pose, counted));
                    continue;
                };
                let moved =
                    [(pose.x_m - anchor.x_m).hypot(pose.y_m - anchor.y_m), (pose.theta_rad - anchor.theta_rad).abs()];
                if moved[k] > settings::FACTORS.min_compared_motion[k] {
                    found[k].push((counted[k] - start[k]).abs() / moved[k]);
                    anchors[k] = Some((pose, counted));
                }
            }
        }
    }
    Some(found)
}

/// What the instrument measured, in stretches that hang together: its poses, or displacements that follow
/// each other, each from the first one's start.
fn measured_poses(run: &RunView<'_>) -> Vec<Vec<(f64, Pose)>> {
    let displacements = &run.run().displacements;
    if displacements.is_empty() {
        return vec![run.observed_poses()];
    }
    displacements
        .chunk_by(|before, after| (after.t0_s - before.t1_s).abs() <= settings::FACTORS.same_instant_s)
        .map(|stretch| {
            let mut poses: Vec<(f64, Pose)> =
                stretch.first().map(|first| (first.t0_s, Pose::IDENTITY)).into_iter().collect();
            let mut at = Pose::IDENTITY;
            poses.extend(stretch.iter().map(|moved| {
                at = at * Pose::new(moved.dx_m, moved.dy_m, moved.dtheta_rad);
                (moved.t1_s, at)
            }));
            poses
        })
        .collect()
}

/// Logged over true counts, by the distances; by the turns where no path was long enough. Absent where the
/// middle one of all is no gross fault.
fn estimate(dataset: &Dataset) -> Option<f64> {
    let mut all = [Vec::new(), Vec::new()];
    for run in &dataset.session().runs {
        let Some(found) = ratios(dataset, run) else { continue };
        all.iter_mut().zip(found).for_each(|(all, found)| all.extend(found));
    }
    let [distances, turns] = all.map(median);
    let factor = distances.or(turns).filter(|factor| *factor > 0.0 && factor.is_finite())?;
    (factor.ln().abs() > settings::FACTORS.min_departure.ln_1p()).then_some(factor)
}

/// Whether the runs are measured at their ends alone.
fn is_measured_at_ends(dataset: &Dataset) -> bool {
    let measurements = |run: &RunView<'_>| measured_poses(run).iter().map(Vec::len).sum::<usize>();
    let session = dataset.session();
    let (runs, measurements) = session
        .runs
        .iter()
        .map(measurements)
        .filter(|measurements| *measurements > 0)
        .fold((0, 0), |(runs, all), own| (runs + 1, all + own));
    measurements < settings::FACTORS.min_measurements * runs
}

/// The factors that may be: that of the distances that were measured and, where hardly any was, all that
/// people err by.
fn factors(dataset: &Dataset) -> Vec<(f64, &'static str)> {
    let of_distances = estimate(dataset).map(|estimate| {
        let off = |factor: f64| (estimate / factor).ln().abs();
        let nearest = FACTORS.iter().min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
        nearest
            .filter(|(factor, _)| off(*factor) < settings::FACTORS.factor_tolerance)
            .copied()
            .unwrap_or((estimate, "a gear?"))
    });
    let all = if is_measured_at_ends(dataset) { &FACTORS[..] } else { &[] };
    let others = all.iter().copied().filter(|known| Some(*known) != of_distances);
    of_distances.into_iter().chain(others).collect()
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    factors(dataset).into_iter().map(|(factor, reason)| correction(dataset, factor, reason)).collect()
}

fn correction(dataset: &Dataset, factor: f64, reason: &str) -> RecordCorrection {
    let scaled = |wheels: &mut WheelLog| {
        if let WheelLog::Angles(Wheels { left, right }) | WheelLog::Speeds(Wheels { left, right }) = wheels {
            left.iter_mut().chain(right).for_each(|angle| *angle /= factor);
        }
    };
    let twist = |twist: Twist| Twist { v_m_s: twist.v_m_s / factor, ..twist };
    let mut records = rewrite_wheels(dataset, scaled, twist);
    if let Some(ticks_per_rev) = &mut records.robot.ticks_per_rev {
        *ticks_per_rev *= factor;
    }
    RecordCorrection {
        values: vec![("factor", factor)],
        sentence: format!("the wheels are logged {factor:.4} times as far as they went ({reason})"),
        visible_in_log: false,
        mistakes: 1,
        records,
    }
}
