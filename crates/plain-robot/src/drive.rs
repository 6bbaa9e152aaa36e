//! Drives, and what the robot does on them.

use std::f64::consts::TAU;

use crate::draws::Draws;
use crate::robot::{Event, PlainRobot};

/// A part of a drive: top speed and yaw rate, and how long it takes at these.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    v_m_s: f64,
    omega_rad_s: f64,
    for_s: f64,
    /// Stands still after it, seconds.
    rest_s: f64,
}

impl Part {
    /// The same by a robot of another size and pace.
    pub(super) fn driven_by(self, robot: &PlainRobot) -> Self {
        Self {
            v_m_s: self.v_m_s * robot.scale * robot.pace,
            omega_rad_s: self.omega_rad_s * robot.pace,
            for_s: self.for_s / robot.pace,
            rest_s: if robot.never_rests { 0.0 } else { self.rest_s },
        }
    }
}

const SPEEDS: [f64; 3] = [0.15, 0.3, 0.45];

fn straight(length_m: f64, v_m_s: f64) -> Part {
    Part { v_m_s, omega_rad_s: 0.0, for_s: length_m / v_m_s.abs(), rest_s: 0.4 }
}

fn spin(turn_rad: f64, omega_rad_s: f64) -> Part {
    Part { v_m_s: 0.0, omega_rad_s: omega_rad_s * turn_rad.signum(), for_s: turn_rad.abs() / omega_rad_s, rest_s: 0.4 }
}

/// Six straights, four spins, four squares, four circles and three free drives, mixed.
pub(super) fn programs(draws: &mut Draws) -> Vec<(&'static str, Vec<Part>)> {
    let straights = (0..6).map(|k| ("straight", vec![straight(2.0, SPEEDS[k % 3]), straight(2.0, -SPEEDS[k % 3])]));
    let spins = (0..4).map(|k| {
        let turn_rad = if k % 2 == 0 { 2.0 * TAU } else { -2.0 * TAU };
        ("spin", vec![spin(turn_rad, 0.6 + 0.3 * k as f64)])
    });
    let squares = (0..4).map(|k| {
        let (name, turn_rad) = if k % 2 == 0 { ("square_ccw", 0.25 * TAU) } else { ("square_cw", -0.25 * TAU) };
        (name, (0..4).flat_map(|_| [straight(1.5, SPEEDS[1 + k / 2]), spin(turn_rad, 0.9)]).collect())
    });
    let circles = (0..4).map(|k| {
        let (name, side) = if k % 2 == 0 { ("circle_ccw", 1.0) } else { ("circle_cw", -1.0) };
        let v_m_s = SPEEDS[1 + k / 2];
        let leg = Part { v_m_s, omega_rad_s: side * v_m_s / 0.7, for_s: 2.0 * TAU * 0.7 / v_m_s, rest_s: 0.4 };
        (name, vec![leg])
    });
    let groups: [Vec<(&str, Vec<Part>)>; 4] =
        [straights.collect(), spins.collect(), squares.collect(), circles.collect()];
    let mut free = (0..3).map(|_| {
        let leg = |_| Part {
            v_m_s: 0.1 + 0.4 * draws.uniform(),
            omega_rad_s: 1.2 * (2.0 * draws.uniform() - 1.0),
            for_s: 1.0 + 2.0 * draws.uniform(),
            rest_s: 0.0,
        };
        ("free", (0..12).map(leg).collect::<Vec<Part>>())
    });
    let mut groups = groups.map(Vec::into_iter);
    let mut all = Vec::new();
    // In turn, so that the first few runs are of all kinds.
    for _ in 0..6 {
        all.extend(groups.iter_mut().filter_map(Iterator::next));
        all.extend(free.next());
    }
    all
}

#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub(super) at: [f64; 3],
    pub(super) wheels_rad: [f64; 2],
}

pub(super) struct Path1kHz {
    pub(super) samples: Vec<Sample>,
}

/// The geometry that a robot has.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrueGeometry {
    pub(super) base_m: f64,
    pub(super) radius_m: [f64; 2],
    /// Of the wheels that are not round.
    pub(super) phase_rad: f64,
}

pub(super) struct World {
    pub(super) at: [f64; 3],
    pub(super) wheels_rad: [f64; 2],
    /// How far each wheel's axis is ahead of the middle of its gap.
    pub(super) ahead_m: [f64; 2],
}

impl World {
    /// Drives the legs with limited accelerations; half a second of standing at both ends.
    pub(super) fn drive(
        &mut self,
        legs: &[Part],
        robot: &PlainRobot,
        number: usize,
        TrueGeometry { base_m, radius_m, phase_rad }: TrueGeometry,
        draws: &mut Draws,
    ) -> Path1kHz {
        const DT_S: f64 = 1e-3;
        let limits = [0.6 * robot.scale, 2.5].map(|limit| limit * robot.briskness * robot.pace);
        let mut samples = vec![Sample { at: self.at, wheels_rad: self.wheels_rad }];
        let mut now = [0.0, 0.0];
        let rest = |for_s| Part { v_m_s: 0.0, omega_rad_s: 0.0, for_s, rest_s: 0.0 };
        let mut parts = vec![rest(0.5 + robot.stands_s)];
        for leg in legs {
            parts.push(*leg);
            if leg.rest_s > 0.0 {
                // Brakes, then stands.
                parts.push(rest((leg.v_m_s.abs() / limits[0]).max(leg.omega_rad_s.abs() / limits[1]) + leg.rest_s));
            }
        }
        parts.push(rest(1.5 + robot.stands_s));
        let mut t_s = 0.0;
        for part in parts {
            let target = [part.v_m_s, part.omega_rad_s];
            // Speed and yaw rate arrive together, so that a circle stays one while the robot speeds up.
            let change = [target[0] - now[0], target[1] - now[1]];
            let ramp_s = (change[0].abs() / limits[0]).max(change[1].abs() / limits[1]);
            let start = now;
            let steps = (part.for_s.max(ramp_s) / DT_S).round() as usize;
            for step in 0..steps {
                let share = if ramp_s > 0.0 { ((step + 1) as f64 * DT_S / ramp_s).min(1.0) } else { 1.0 };
                now = [start[0] + share * change[0], start[1] + share * change[1]];
                t_s += DT_S;
                let ripple = 1.0 + robot.ripple * (TAU * 1.7 * t_s).sin();
                let contact_m =
                    [now[0] - 0.5 * base_m * now[1], now[0] + 0.5 * base_m * now[1]].map(|v| v * ripple * DT_S);
                // What was commanded is turned by the wheel; what it rolls differs by noise and eccentricity.
                let mut rolled_m = [0.0; 2];
                let slips = robot.slippery_band.is_some_and(|[from_m, to_m]| (from_m..to_m).contains(&self.at[0]));
                for wheel in 0..2 {
                    let turned_rad = contact_m[wheel] / radius_m[wheel];
                    let middle_rad = self.wheels_rad[wheel] + 0.5 * turned_rad;
                    let wobble = if wheel == 1 { robot.eccentricity * (middle_rad + phase_rad).cos() } else { 0.0 };
                    let slip = robot.slip_s_m * contact_m[wheel].abs() / DT_S + if slips { 0.03 } else { 0.0 };
                    let noise_m = robot.wheel_sigma_m_per_sqrt_m * contact_m[wheel].abs().sqrt() * draws.normal();
                    // The wheel hangs back in its gap.
                    self.ahead_m[wheel] += contact_m[wheel];
                    let gap_m = 0.5 * robot.gap_m;
                    let over_m = self.ahead_m[wheel] - self.ahead_m[wheel].clamp(-gap_m, gap_m);
                    self.ahead_m[wheel] -= over_m;
                    rolled_m[wheel] = over_m * (1.0 + wobble - slip) + noise_m;
                    self.wheels_rad[wheel] += turned_rad;
                }
                let yaw_rate_rad_s = (rolled_m[1] - rolled_m[0]) / base_m / DT_S;
                let turn_rad = yaw_rate_rad_s * DT_S / (1.0 + robot.base_grows_s * yaw_rate_rad_s.abs());
                let middle_rad = self.at[2] + 0.5 * turn_rad;
                let ahead_m = 0.5 * (rolled_m[0] + rolled_m[1]);
                let rolls = robot.of_run(number).all(
                    |event| !matches!(event, Event::Lifted { from_s, for_s } if t_s > from_s && t_s < from_s + for_s),
                );
                if rolls {
                    self.at = [
                        self.at[0] + ahead_m * middle_rad.cos(),
                        self.at[1] + ahead_m * middle_rad.sin(),
                        self.at[2] + turn_rad,
                    ];
                }
                for event in robot.of_run(number) {
                    if let Event::Pushed { from_s, for_s, by } = event
                        && t_s > from_s
                        && t_s < from_s + for_s
                    {
                        self.at.iter_mut().zip(by).for_each(|(at, by)| *at += by * DT_S / for_s);
                    }
                }
                samples.push(Sample { at: self.at, wheels_rad: self.wheels_rad });
            }
        }
        Path1kHz { samples }
    }
}
