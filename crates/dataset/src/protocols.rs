//! What a run drove, read off its wheels: a protocol only where the run as a whole plainly is one.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::record::{Dataset, NominalRobot, Odometry, Protocol, ProtocolSettings};
use crate::run_motion::{RunMotion, increments};
use crate::settings::LABELS;

/// Gives each run without a protocol that of what it plainly drove by the stated robot: a straight, a spin,
/// or a square with turns on the spot either way. Nothing is said of its lengths and turns: the stated
/// robot's are no measurement.
pub fn recognise_protocols(dataset: &mut Dataset) {
    let robot = dataset.robot;
    for run in dataset.runs.iter_mut().filter(|run| run.info.protocol.is_none()) {
        run.info.protocol = recognised(&run.odometry, &robot);
    }
}

fn recognised(odometry: &Odometry, robot: &NominalRobot) -> Option<Protocol> {
    let (protocol, _) = label(&RunMotion::of(odometry, robot)?, None);
    match protocol {
        Protocol::Straight | Protocol::Spin => Some(protocol),
        Protocol::SquareCw | Protocol::SquareCcw if has_four_sides(odometry, robot) => Some(protocol),
        _ => None,
    }
}

/// Four sides of one length with right turns on the spot between them: three, or four with the last at the
/// start.
fn has_four_sides(odometry: &Odometry, robot: &NominalRobot) -> bool {
    let settings = &*LABELS;
    let Some(increments) = increments(odometry, robot) else { return false };
    let half_base_m = 0.5 * robot.wheel_separation_m;
    let (mut sides_m, mut turns_rad, mut turn_rad) = (vec![0.0], Vec::new(), 0.0_f64);
    for step in increments {
        if step.turn_rad.abs() * half_base_m > step.distance_m.abs() {
            turn_rad += step.turn_rad;
        } else {
            if turn_rad.abs() > settings.min_turn_rad && step.distance_m != 0.0 {
                turns_rad.push(turn_rad);
                sides_m.push(0.0);
            }
            if step.distance_m != 0.0 {
                turn_rad = 0.0;
            }
            if let Some(side_m) = sides_m.last_mut() {
                *side_m += step.distance_m.abs();
            }
        }
    }
    if turn_rad.abs() > settings.min_turn_rad {
        turns_rad.push(turn_rad);
    }
    let (least_m, most_m) = sides_m.iter().fold((f64::MAX, 0.0_f64), |(a, b), side_m| (a.min(*side_m), b.max(*side_m)));
    let are_right = turns_rad.iter().all(|turn_rad| (turn_rad.abs() - FRAC_PI_2).abs() < settings.max_turn_error_rad);
    sides_m.len() == 4 && (3..=4).contains(&turns_rad.len()) && are_right && most_m < settings.max_side_ratio * least_m
}

/// What a run drove: a label only where all of the run is like it, else `free`.
///
/// | label | rule (by the nominal robot) | setting |
/// | --- | --- | --- |
/// | `spin` | a path of less than 0.1 m, and a net turn of at least an eighth of a turn | `turn_rad`: the nearest whole number of half turns |
/// | `straight` | at least 0.1 m, and all headings within 10° | `length_m`: signed, to the centimetre |
/// | `square_*` | a whole turn to within an eighth, most of the turning with the wheels in opposite directions, four sides where the metadata says their length | `side_m`: the metadata's |
/// | `circle_*` | at least a half turn, with both wheels forward, that grows evenly with the distance | `radius_m`: distance over turn, the mean radius of the run, to the millimetre |
/// | `free` | none of these | |
///
/// All but `free` go one way: forward or backward, left or right. The runs of the study's `circular` folder
/// are spirals: half turns of a radius that shrinks from 0.375 m. Their mean is what one number can say.
pub(crate) fn label(motion: &RunMotion, side_m: Option<f64>) -> (Protocol, ProtocolSettings) {
    let settings = &*LABELS;
    let none = ProtocolSettings::default();
    let free = (Protocol::Free, none);
    // Counts that are no robot's give lengths that are none.
    let is_path = motion.path_m.is_finite() && motion.distance_m.is_finite() && motion.turn_rad.is_finite();
    if !is_path {
        return free;
    }
    let turn_rad = motion.turn_rad.abs();
    let turns_one_way = turn_rad >= settings.min_one_way_share * motion.heading_range_rad;
    let clockwise = motion.turn_rad < 0.0;
    if motion.path_m < settings.min_path_m {
        if turn_rad < settings.eighth_turn_rad || !turns_one_way {
            return free;
        }
        let turn_rad = (motion.turn_rad / PI).round() * PI;
        return (Protocol::Spin, ProtocolSettings { turn_rad: Some(turn_rad), ..none });
    }
    if motion.distance_m.abs() < settings.min_one_way_share * motion.path_m {
        return free;
    }
    if motion.heading_range_rad < settings.max_straight_rad {
        let length_m = (motion.distance_m * 100.0).round() / 100.0;
        return (Protocol::Straight, ProtocolSettings { length_m: Some(length_m), ..none });
    }
    let sides =
        side_m.is_none_or(|side_m| (motion.distance_m.abs() / (4.0 * side_m) - 1.0).abs() < settings.max_side_error);
    let is_square =
        (turn_rad - TAU).abs() < settings.eighth_turn_rad && motion.on_the_spot_rad > 0.5 * motion.turning_rad && sides;
    let is_circle = turn_rad >= 4.0 * settings.eighth_turn_rad
        && motion.on_the_spot_rad < settings.max_on_the_spot_share * motion.turning_rad
        && motion.uneven_rad < settings.max_uneven_share * turn_rad;
    match (turns_one_way, is_square, is_circle) {
        (true, true, _) => {
            let protocol = if clockwise { Protocol::SquareCw } else { Protocol::SquareCcw };
            (protocol, ProtocolSettings { side_m, ..none })
        }
        (true, false, true) => {
            let radius_m = (motion.distance_m / motion.turn_rad).abs();
            let radius_m = (radius_m * 1000.0).round() / 1000.0;
            if !(radius_m.is_finite() && radius_m > 0.0) {
                return free;
            }
            let protocol = if clockwise { Protocol::CircleCw } else { Protocol::CircleCcw };
            (protocol, ProtocolSettings { radius_m: Some(radius_m), ..none })
        }
        _ => free,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::WheelLog;
    use kinematics::Wheels;

    const ROBOT: NominalRobot = NominalRobot {
        left_wheel_diameter_m: 0.1,
        right_wheel_diameter_m: 0.1,
        wheel_separation_m: 0.2,
        ticks_per_rev: Some(100.0),
        counter_bits: None,
    };

    fn odometry(ticks: Wheels<Vec<i64>>) -> Odometry {
        let t_s: Vec<f64> = (0..ticks.left.len()).map(|row| row as f64).collect();
        Odometry { t_s: t_s.into(), wheels: WheelLog::Ticks(ticks), ..Odometry::default() }
    }

    #[test]
    fn a_square_has_four_sides_and_right_turns() {
        // 100 counts are 0.314 m, and 100 of each wheel against the other turn by half a turn: 50 are a right
        // turn.
        let drive = |pieces: &[(i64, i64)]| {
            let mut ticks = Wheels { left: vec![0], right: vec![0] };
            for &(left, right) in pieces {
                for _ in 0..10 {
                    ticks.left.push(ticks.left[ticks.left.len() - 1] + left);
                    ticks.right.push(ticks.right[ticks.right.len() - 1] + right);
                }
            }
            recognised(&odometry(ticks), &ROBOT)
        };
        let square = |turn: i64| [(20, 20), (-turn, turn)].repeat(4);
        assert_eq!(drive(&square(5)), Some(Protocol::SquareCcw));
        assert_eq!(drive(&square(-5)), Some(Protocol::SquareCw));
        assert_eq!(drive(&[(20, 20), (20, 20)]), Some(Protocol::Straight));
        assert_eq!(drive(&[(5, -5), (5, -5)]), Some(Protocol::Spin));
        // A straight, a whole turn and a straight; a triangle; a rectangle; a circle.
        assert_eq!(drive(&[(20, 20), (-20, 20), (20, 20)]), None);
        assert_eq!(drive(&[(21, 21), (-7, 7)].repeat(3)), None);
        assert_eq!(drive(&[(20, 20), (-5, 5), (10, 10), (-5, 5)].repeat(2)), None);
        assert_eq!(drive(&[(5, 10)].repeat(10)), None);
    }

    #[test]
    fn labels_follow_the_rule_on_both_sides_of_its_borders() {
        let motion = |distance_m: f64, turn_rad: f64, on_the_spot_rad| RunMotion {
            distance_m,
            path_m: distance_m.abs() + 0.02,
            turn_rad,
            heading_range_rad: turn_rad.abs(),
            uneven_rad: 0.05 * turn_rad.abs(),
            turning_rad: turn_rad.abs() + 0.1,
            on_the_spot_rad,
        };
        let labelled = |motion| label(&motion, Some(0.75));
        assert_eq!(labelled(motion(-1.502, 0.02, 0.0)).1.length_m, Some(-1.5));
        assert_eq!(labelled(motion(0.007, -3.19, 3.1)).1.turn_rad, Some(-PI));
        assert_eq!(
            labelled(motion(2.98, 6.3, 5.0)),
            (Protocol::SquareCcw, ProtocolSettings { side_m: Some(0.75), ..Default::default() })
        );
        assert_eq!(labelled(motion(2.98, -6.3, 5.0)).0, Protocol::SquareCw);
        assert_eq!(
            labelled(motion(3.98, -12.57, 0.4)),
            (Protocol::CircleCw, ProtocolSettings { radius_m: Some(0.317), ..Default::default() })
        );
        assert_eq!(labelled(motion(2.98, 6.3, 0.4)).0, Protocol::CircleCcw);
        // Not a square of these sides, not a whole turn, too short a turn, hardly any motion.
        for (distance_m, turn_rad, on_the_spot_rad) in
            [(4.0, 6.3, 5.0), (2.0, 3.0, 2.9), (2.0, 1.0, 0.0), (0.01, 0.1, 0.1)]
        {
            assert_eq!(labelled(motion(distance_m, turn_rad, on_the_spot_rad)).0, Protocol::Free, "{distance_m}");
        }
    }

    #[test]
    fn drives_of_several_kinds_are_free() {
        let motion_of = |ticks: Wheels<Vec<i64>>| RunMotion::of(&odometry(ticks), &ROBOT).expect("motion");
        // Rows of wheel counts, 100 a turn, in pieces of so many rows.
        let drive = |pieces: &[(i64, i64, usize)]| {
            let mut ticks = Wheels { left: vec![0], right: vec![0] };
            for &(left, right, rows) in pieces {
                for _ in 0..rows {
                    ticks.left.push(ticks.left[ticks.left.len() - 1] + left);
                    ticks.right.push(ticks.right[ticks.right.len() - 1] + right);
                }
            }
            label(&motion_of(ticks), None).0
        };
        assert_eq!(drive(&[(10, 10, 50)]), Protocol::Straight);
        assert_eq!(drive(&[(5, 10, 100)]), Protocol::CircleCcw);
        assert_eq!(drive(&[(-5, 5, 20)]), Protocol::Spin);
        // A slalom whose net turn is nothing, out and back, two arcs, a circle and a straight, to and fro.
        assert_eq!(drive(&[(5, 10, 60), (10, 5, 120), (5, 10, 60)]), Protocol::Free);
        assert_eq!(drive(&[(10, 10, 50), (-10, -10, 30)]), Protocol::Free);
        assert_eq!(drive(&[(5, 10, 100), (8, 10, 100)]), Protocol::Free);
        assert_eq!(drive(&[(5, 10, 100), (10, 10, 100)]), Protocol::Free);
        assert_eq!(drive(&[(-5, 5, 20), (5, -5, 10)]), Protocol::Free);
    }
}
