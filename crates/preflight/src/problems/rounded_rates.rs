//! Recorded rates that are rounded by more than a calibration is to be off.

use dataset::{Dataset, NominalRobot, Run, WheelLog};

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

pub(crate) fn found(check: &mut SessionCheck, dataset: &Dataset) {
    let rounded = dataset.runs.iter().filter_map(|run| Some((run, run.odometry.wheels.recorded_step()?)));
    let rounded: Vec<(&Run, f64)> = rounded.collect();
    let Some(step) = rounded.iter().map(|(_, step)| *step).reduce(f64::max) else { return };
    let (off_m, driven_m) = rounded.iter().fold((0.0, 0.0), |(off_m, driven_m), (run, step)| {
        let (own_off_m, own_m) = off_and_driven_m(run, *step, &check.robot);
        (off_m + own_off_m, driven_m + own_m)
    });
    let share = off_m / driven_m;
    if share > CHECKS.min_rounded_share {
        let severity = if share > CHECKS.max_rounded_share { Severity::Warning } else { Severity::Hint };
        let runs = rounded.into_iter().map(|(run, _)| run.info.id.clone()).collect();
        let kind = Kind::RoundedRates { step, share };
        check.problems.push(Problem::new(&kind, severity, Some(runs), 0.95));
    }
}

/// How far a wheel that rolls evenly is off by the standard deviation of the rounding over a run, and how far
/// wheels go on average, metres.
fn off_and_driven_m(run: &Run, step: f64, robot: &NominalRobot) -> (f64, f64) {
    let (off_m_s, [first, second], lever_m) = match &run.odometry.wheels {
        WheelLog::Speeds(speeds) => (step, [&speeds.left, &speeds.right], None),
        WheelLog::Twist { v_mps, omega_radps } => {
            let lever_m = 0.5 * robot.wheel_separation_m;
            (step.hypot(step * lever_m), [v_mps, omega_radps], Some(lever_m))
        }
        WheelLog::Ticks(_) | WheelLog::Angles(_) => return (0.0, 0.0),
    };
    let mut sums = (0.0, 0.0);
    let rows = run.odometry.t_s.windows(2).zip(first.iter().zip(second).skip(1));
    for (t_s, (first, second)) in rows.filter(|(_, (first, second))| **first != 0.0 || **second != 0.0) {
        let [left, right] =
            lever_m.map_or([*first, *second], |lever_m| [first - lever_m * second, first + lever_m * second]);
        let row_s = t_s[1] - t_s[0];
        sums.0 += off_m_s / 12_f64.sqrt() * row_s;
        sums.1 += 0.5 * (left.abs() + right.abs()) * row_s;
    }
    sums
}

#[cfg(test)]
mod tests {
    use dataset::Odometry;
    use kinematics::Wheels;

    use super::*;

    #[test]
    fn a_wheel_is_off_by_the_rounding_for_as_long_as_it_rolls() {
        let robot = NominalRobot {
            left_wheel_diameter_m: 0.16,
            right_wheel_diameter_m: 0.16,
            wheel_separation_m: 0.4,
            ticks_per_rev: None,
            counter_bits: None,
        };
        let of = |wheels: WheelLog| {
            let odometry = Odometry { t_s: vec![0.0, 1.0, 2.0, 3.0].into(), wheels, ..Odometry::default() };
            off_and_driven_m(&Run { odometry, ..Run::default() }, 0.01, &robot)
        };
        // Two seconds at 0.2 and 0.4 m/s and one at rest; a row's speeds are of the interval that ends there.
        let speeds = Wheels { left: vec![9.0, 0.2, 0.2, 0.0], right: vec![9.0, 0.4, 0.4, 0.0] };
        let (off_m, driven_m) = of(WheelLog::Speeds(speeds));
        assert!((off_m - 0.02 / 12_f64.sqrt()).abs() < 1e-15 && (driven_m - 0.6).abs() < 1e-15, "{off_m} {driven_m}");
        // The same wheels by their twist: 0.3 m/s and 0.5 rad/s, whose step is 2 mm/s of a wheel.
        let (v_mps, omega_radps) = (vec![9.0, 0.3, 0.3, 0.0], vec![9.0, 0.5, 0.5, 0.0]);
        let (off_m, driven_m) = of(WheelLog::Twist { v_mps, omega_radps });
        let on_paper_m = 2.0 * 0.01 * 1.04_f64.sqrt() / 12_f64.sqrt();
        assert!((off_m - on_paper_m).abs() < 1e-15 && (driven_m - 0.6).abs() < 1e-15, "{off_m} {driven_m}");
    }
}
