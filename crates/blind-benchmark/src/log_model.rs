//! What becomes of a run's rows on their way into the log: lost rows, stamps, and two clocks that drift.
//!
//! The counters go on over a lost row; rows that are lost with their counts are the effect
//! `dropped_samples`. Rows are stamped in their order: one that is received late holds up those behind it.

use dataset::Run;

use super::conditions::{Conditions, Stamps};
use super::draw::Draw;

/// Time that a row takes on a line, seconds: those that were held up come as close together.
const ROW_ON_LINE_S: f64 = 1e-4;

/// Makes of a run with exact stamps what is recorded of it.
pub(crate) fn record(conditions: &Conditions, run: &mut Run, draw: &mut Draw) {
    if conditions.lost_row_share > 0.0 {
        lose_rows(run, |_| draw.bernoulli(conditions.lost_row_share));
    }
    match conditions.stamps {
        Stamps::Exact | Stamps::Irregular { .. } => {}
        Stamps::Jittering { sigma_s } => stamp(run, || sigma_s * draw.0.normal()),
        Stamps::Received { mean_s } => stamp(run, || -mean_s * (1.0 - draw.0.uniform()).ln()),
    }
    if conditions.clock_drift != 0.0 {
        let gains = 1.0 + conditions.clock_drift;
        run.truth.iter_mut().for_each(|sample| sample.t_s *= gains);
        run.displacements.iter_mut().for_each(|moved| {
            moved.t0_s *= gains;
            moved.t1_s *= gains;
        });
    }
}

fn stamp(run: &mut Run, mut late_s: impl FnMut() -> f64) {
    let mut before_s = f64::NEG_INFINITY;
    for t_s in run.odometry.t_s.iter_mut() {
        *t_s = (*t_s + late_s()).max(before_s + ROW_ON_LINE_S);
        before_s = *t_s;
    }
}

/// The first row and the last are never lost.
fn lose_rows(run: &mut Run, mut is_lost: impl FnMut(usize) -> bool) {
    let rows = run.odometry.t_s.len();
    let keep: Vec<bool> = (0..rows).map(|row| row == 0 || row + 1 == rows || !is_lost(row)).collect();
    run.odometry.retain_rows(&keep);
}

#[cfg(test)]
mod tests {
    use dataset::WheelLog;
    use kinematics::Wheels;

    use super::*;

    fn run() -> Run {
        let mut run = Run::default();
        run.odometry.t_s = (0..6).map(|row| 0.1 * f64::from(row)).collect();
        run.odometry.wheels = WheelLog::Ticks(Wheels { left: (0..6).collect(), right: (10..16).collect() });
        run
    }

    #[test]
    fn the_counters_go_on_over_a_lost_row() {
        let mut run = run();
        lose_rows(&mut run, |row| row == 0 || row == 2 || row == 5);
        assert_eq!(run.odometry.t_s.len(), 5);
        let WheelLog::Ticks(ticks) = run.odometry.wheels else { panic!("counts") };
        assert_eq!((ticks.left, ticks.right), (vec![0, 1, 3, 4, 5], vec![10, 11, 13, 14, 15]));
    }

    #[test]
    fn a_late_row_holds_up_those_behind_it() {
        let mut run = run();
        let mut late_s = [0.0, 0.25, 0.0, 0.0, 0.0, 0.0].into_iter();
        stamp(&mut run, || late_s.next().expect("six rows"));
        let expected = [0.0, 0.35, 0.3501, 0.3502, 0.4, 0.5];
        assert!(run.odometry.t_s.iter().zip(expected).all(|(t_s, due_s)| (t_s - due_s).abs() < 1e-12));
    }
}
