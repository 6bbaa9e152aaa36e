//! Wheels that are exchanged or count backwards, and lengths of another unit or of another robot.

use dataset::Protocol;
use kinematics::{Side, Wheels};

use crate::kind::Kind;
use crate::problem::{Problem, Severity, probability};
use crate::problems::ends;
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

/// Names of the units of `length_units`.
const UNIT_NAMES: [&str; 4] = ["millimetres", "centimetres", "inches", "feet"];

pub(crate) fn found(check: &mut SessionCheck) {
    let Some(matched) = &check.matched else {
        let problems = ends::found(check);
        check.problems.extend(problems);
        return;
    };
    let mirrored = matched.reading.clockwise;
    let mut kinds = Vec::new();
    if let Some(geometry) = matched.geometry {
        let sign = |value: f64| value < 0.0;
        let signs = [sign(geometry.m_per_rad.left), sign(geometry.m_per_rad.right), sign(geometry.separation_m)];
        match signs {
            // All negative: an instrument that looks backwards.
            [false, false, false] | [true, true, true] => {}
            // What is mirrored has been said.
            [false, false, true] | [true, true, false] if mirrored => {}
            [false, false, true] => kinds.push(Kind::WheelsExchanged { label: truth_follows_labels(&check.runs) }),
            [true, true, false] => kinds.push(Kind::WheelBackwards { sides: Side::BOTH.to_vec() }),
            [left, _, turned] => {
                let sides = vec![if left ^ turned { Side::Left } else { Side::Right }];
                kinds.push(Kind::WheelBackwards { sides });
                if turned {
                    kinds.push(Kind::WheelsExchanged { label: None });
                }
            }
        }
        let nominal = check.m_per_rad();
        let ratios = geometry.m_per_rad.map(f64::abs).zip_with(nominal, |found, nominal| found / nominal);
        let separation = geometry.separation_m.abs() / check.robot.wheel_separation_m;
        if !geometry.is_diluted {
            kinds.extend(scale(check, ratios, Some(separation), geometry.sigma));
        }
    } else if let Some(one) = matched.one_direction {
        let nominal = check.m_per_rad();
        // What the stated robot would do for a radian along this direction.
        let left_m = one.direction.left * nominal.left;
        let right_m = one.direction.right * nominal.right;
        let distance_m = 0.5 * (left_m + right_m);
        let turn_rad = (right_m - left_m) / check.robot.wheel_separation_m;
        let reversed_distance_m = 0.5 * (left_m - right_m);
        let reversed_turn_rad = -(right_m + left_m) / check.robot.wheel_separation_m;
        let miss = |distance_m: f64, turn_rad: f64| {
            (one.distance_m_per_rad - distance_m.abs()).abs() / nominal.left
                + (one.turn_per_rad.abs() - turn_rad.abs()).abs() * check.robot.wheel_separation_m / nominal.left
        };
        if miss(reversed_distance_m, reversed_turn_rad) < 0.2 * miss(distance_m, turn_rad) {
            // Positive is along the left wheel: ahead if that counts forward.
            let left_is_right = if reversed_turn_rad.abs() * check.robot.wheel_separation_m > reversed_distance_m.abs()
            {
                one.turn_per_rad < 0.0
            } else {
                one.ahead_m_per_rad > 0.0
            };
            let sides = vec![if left_is_right { Side::Right } else { Side::Left }];
            kinds.push(Kind::WheelBackwards { sides });
        } else if distance_m.abs() > turn_rad.abs() * check.robot.wheel_separation_m {
            let ratio = one.distance_m_per_rad / distance_m.abs();
            kinds.extend(scale(check, Wheels::both(ratio), None, [one.distance_sigma; 3]));
        } else if one.turn_per_rad * turn_rad < 0.0
            && one.turn_per_rad.abs() > CHECKS.certain_sigmas * one.turn_sigma
            && !mirrored
        {
            kinds.push(Kind::WheelsExchanged { label: truth_follows_labels(&check.runs) });
        }
    } else {
        let problems = ends::of_positions(check);
        check.problems.extend(problems);
        return;
    }
    let unsure = |kind: &Kind| matches!(kind, Kind::WheelsExchanged { label: None });
    for kind in kinds {
        let probability = if unsure(&kind) { 0.99 } else { 0.999 };
        check.problems.push(Problem::new(&kind, Severity::Error, None, probability));
    }
}

/// What ratios to the stated values say, if they are certain.
fn scale(check: &SessionCheck, wheels: Wheels<f64>, separation: Option<f64>, sigma: [f64; 3]) -> Option<Kind> {
    let is_off = |ratio: f64, most: f64, sigma: f64| {
        ratio.ln().abs() > most.ln() && ratio.ln().abs() - most.ln() > CHECKS.certain_sigmas * sigma.min(0.05)
    };
    let off = Wheels {
        left: is_off(wheels.left, CHECKS.max_wheel_ratio, sigma[0]),
        right: is_off(wheels.right, CHECKS.max_wheel_ratio, sigma[1]),
    };
    let near = |a: f64, b: f64| (a / b).ln().abs() < CHECKS.factor_tolerance;
    // The product of two that are large has no number.
    let mean = wheels.left.sqrt() * wheels.right.sqrt();
    if off.left && off.right && near(wheels.left, wheels.right) {
        if separation.is_some_and(|separation| near(separation, mean))
            || (separation.is_none() && !(0.05..20.0).contains(&mean))
        {
            // Near feet, the last, lie km/h and radii.
            let is_unit = |ratio: f64, number: usize| {
                let off = ratio / CHECKS.length_units[number];
                if number + 1 == CHECKS.length_units.len() {
                    (off - 1.0).abs() < CHECKS.unit_tolerance
                } else {
                    near(off, 1.0)
                }
            };
            let units = 0..CHECKS.length_units.len();
            let unit = units.clone().find(|number| is_unit(mean, *number));
            let nominal_unit = units.clone().find(|number| is_unit(mean.recip(), *number));
            return Some(Kind::LengthUnit {
                ratio: unit.map_or_else(
                    || nominal_unit.map_or(mean, |at| CHECKS.length_units[at].recip()),
                    |at| CHECKS.length_units[at],
                ),
                unit: unit.or(nominal_unit).map(|at| UNIT_NAMES[at]),
                of_truth: mean > 1.0,
            });
        }
        let simple = CHECKS.tick_factors.iter().copied().find(|factor| near(mean, *factor));
        let ratio = simple.unwrap_or(mean);
        return Some(Kind::TicksPerTurn { ratio, stated: check.robot.ticks_per_rev, simple: simple.is_some() });
    }
    for (parameter, ratio, off) in [
        ("left_wheel_diameter_m", wheels.left, off.left),
        ("right_wheel_diameter_m", wheels.right, off.right),
        (
            "wheel_separation_m",
            separation.unwrap_or(1.0),
            separation.is_some_and(|ratio| is_off(ratio, CHECKS.max_separation_ratio, sigma[2])),
        ),
    ] {
        if off {
            return Some(Kind::OtherRobot { parameter, ratio });
        }
    }
    None
}

/// Whether the truth turns as the protocols of the runs say; `None` where none says.
fn truth_follows_labels(runs: &[RunLog]) -> Option<bool> {
    let mut agreement = 0.0;
    for run in runs {
        let sense = match run.protocol {
            Some(Protocol::SquareCcw | Protocol::CircleCcw) => 1.0,
            Some(Protocol::SquareCw | Protocol::CircleCw) => -1.0,
            Some(Protocol::Spin) => run.turn_rad.map_or(0.0, f64::signum),
            _ => 0.0,
        };
        let headings: Vec<f64> = run.truth.iter().filter_map(dataset::TruthSample::theta_rad).collect();
        let turned: f64 = headings.windows(2).map(|pair| kinematics::wrap_to_pi(pair[1] - pair[0])).sum();
        agreement += sense * turned;
    }
    (agreement.abs() > CHECKS.min_turning_rad).then_some(agreement > 0.0)
}

/// The probability of what fits better by so many squared standard deviations.
pub(super) fn certain(sigmas: f64) -> f64 {
    probability(0.5 * sigmas * sigmas)
}
