//! Motion programs: what a protocol drives and where it measures, in the robot's own nominal units.
//!
//! A program is commanded in what the robot believes: "0.5 m" is so many counts by its nominal wheels, "a
//! quarter turn" so many by its nominal wheelbase. How far the robot really goes is what calibration is
//! about.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::{Deserialize, Serialize};

use dataset::{Protocol, ProtocolSettings};

/// One motion between two standstills, in nominal units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// A straight line of nominal length, metres, negative backward.
    Straight {
        /// Signed length, metres.
        length_m: f64,
    },
    /// A turn on the spot by a nominal angle.
    Spin {
        /// Signed turn, radians, counter-clockwise.
        turn_rad: f64,
    },
    /// A turn on the spot at a speed of its own.
    SpinAt {
        /// Signed turn, radians, counter-clockwise.
        turn_rad: f64,
        /// Speed of the wheels' contacts, m/s, instead of the robot's cruise speed.
        speed_m_s: f64,
    },
    /// A circular arc of the centre. A robot whose wheel speeds lie on a lattice, as under an HCTL-1100,
    /// drives a radius that is a little off.
    Arc {
        /// Radius of the centre's path, metres, positive.
        radius_m: f64,
        /// Signed turn, radians, counter-clockwise; the robot drives forward.
        turn_rad: f64,
    },
    /// Standing still.
    Pause {
        /// How long, seconds.
        duration_s: f64,
    },
    /// The outside instrument reads the standing robot. The start and the end of a program are always read.
    Measure,
}

/// What one run drives.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionProgram {
    /// The run's id.
    pub id: String,
    /// Its protocol, by which estimators find their runs.
    pub protocol: Protocol,
    /// What the protocol says of itself.
    pub settings: ProtocolSettings,
    /// The motions in order.
    pub motions: Vec<Motion>,
}

/// A protocol with its numbers: how many runs of what.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Schedule {
    /// Straight runs of the paper, alternately forward and backward.
    Straights {
        /// Nominal length of each, metres.
        length_m: f64,
        /// How many.
        runs: u32,
    },
    /// Spins of the paper, alternately counter-clockwise and clockwise.
    Spins {
        /// Nominal turn of each, radians.
        turn_rad: f64,
        /// How many.
        runs: u32,
    },
    /// Spins at several speeds, from the slowest to the fastest in even steps; at each alternately
    /// counter-clockwise and clockwise. They tell a wheelbase that depends on the yaw rate.
    SpinsAtSpeeds {
        /// Nominal turn of each, radians.
        turn_rad: f64,
        /// Lowest speed of the wheels' contacts, m/s.
        slowest_m_s: f64,
        /// Highest speed of the wheels' contacts, m/s.
        fastest_m_s: f64,
        /// How many speeds, two or more.
        speeds: u32,
        /// How many in each direction at each speed.
        runs_each_way: u32,
    },
    /// UMBmark squares, alternately clockwise and counter-clockwise (Borenstein & Feng 1995: five in each
    /// direction).
    Squares {
        /// Nominal side, metres.
        side_m: f64,
        /// How many in each direction.
        runs_each_way: u32,
    },
    /// Circles of the bidirectional circular path test, alternately clockwise and counter-clockwise (Abbas
    /// 2006). The robot stands and is read every half turn or sooner: a reading across a circle shows its
    /// diameter, one that closes it shows nothing.
    Circles {
        /// Nominal radius of the centre's path, metres.
        radius_m: f64,
        /// How often each run goes round, a real number; 1 when it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        turns: Option<f64>,
        /// How many in each direction.
        runs_each_way: u32,
    },
    /// The paper's validation path: nine straight legs joined by eight quarter turns on the spot, read at
    /// even steps.
    ValidationPath {
        /// Length of the whole path, metres (the paper: about 40).
        length_m: f64,
        /// Distance between two readings, metres (the paper: 0.5).
        measure_every_m: f64,
        /// How many.
        runs: u32,
    },
}

/// Legs of the validation path: eight turns join nine.
const VALIDATION_LEGS: usize = 9;

impl Schedule {
    /// How many runs it drives.
    #[must_use]
    pub fn runs(&self) -> u64 {
        match *self {
            Self::Straights { runs, .. } | Self::Spins { runs, .. } | Self::ValidationPath { runs, .. } => runs.into(),
            Self::SpinsAtSpeeds { speeds, runs_each_way, .. } => 2 * u64::from(speeds) * u64::from(runs_each_way),
            Self::Squares { runs_each_way, .. } | Self::Circles { runs_each_way, .. } => 2 * u64::from(runs_each_way),
        }
    }

    /// The same with so many runs in each direction, at each speed where there are several; twice as many of
    /// a validation path, which has one direction.
    #[must_use]
    pub fn with_pairs(mut self, pairs: u32) -> Self {
        match &mut self {
            Self::Straights { runs, .. } | Self::Spins { runs, .. } | Self::ValidationPath { runs, .. } => {
                *runs = pairs.saturating_mul(2);
            }
            Self::SpinsAtSpeeds { runs_each_way, .. }
            | Self::Squares { runs_each_way, .. }
            | Self::Circles { runs_each_way, .. } => *runs_each_way = pairs,
        }
        self
    }

    /// The programs, with ids that sort in driving order.
    #[must_use]
    pub fn programs(&self) -> Vec<MotionProgram> {
        match *self {
            Self::Straights { length_m, runs } => (0..runs)
                .map(|run| {
                    let length_m = if run % 2 == 0 { length_m } else { -length_m };
                    let settings = ProtocolSettings { length_m: Some(length_m), ..ProtocolSettings::default() };
                    program("straight", run, Protocol::Straight, settings, vec![Motion::Straight { length_m }])
                })
                .collect(),
            Self::Spins { turn_rad, runs } => (0..runs)
                .map(|run| {
                    let turn_rad = if run % 2 == 0 { turn_rad } else { -turn_rad };
                    let settings = ProtocolSettings { turn_rad: Some(turn_rad), ..ProtocolSettings::default() };
                    program("spin", run, Protocol::Spin, settings, vec![Motion::Spin { turn_rad }])
                })
                .collect(),
            Self::SpinsAtSpeeds { turn_rad, slowest_m_s, fastest_m_s, speeds, runs_each_way } => {
                let step_m_s = (fastest_m_s - slowest_m_s) / f64::from(speeds.saturating_sub(1).max(1));
                let of_each = 2 * runs_each_way;
                (0..speeds * of_each)
                    .map(|run| {
                        let turn_rad = if run % 2 == 0 { turn_rad } else { -turn_rad };
                        let speed_m_s = slowest_m_s + step_m_s * f64::from(run / of_each);
                        let settings = ProtocolSettings { turn_rad: Some(turn_rad), ..ProtocolSettings::default() };
                        program("spin", run, Protocol::Spin, settings, vec![Motion::SpinAt { turn_rad, speed_m_s }])
                    })
                    .collect()
            }
            Self::Squares { side_m, runs_each_way } => {
                (0..2 * runs_each_way).map(|run| square(run, side_m, run % 2 == 0)).collect()
            }
            Self::Circles { radius_m, turns, runs_each_way } => {
                (0..2 * runs_each_way).map(|run| circle(run, radius_m, turns.unwrap_or(1.0), run % 2 == 0)).collect()
            }
            Self::ValidationPath { length_m, measure_every_m, runs } => {
                (0..runs).map(|run| validation_path(run, length_m, measure_every_m)).collect()
            }
        }
    }
}

fn program(
    prefix: &str,
    run: u32,
    protocol: Protocol,
    settings: ProtocolSettings,
    motions: Vec<Motion>,
) -> MotionProgram {
    MotionProgram { id: format!("{prefix}_{run:03}"), protocol, settings, motions }
}

/// Four sides, each followed by a quarter turn, so that the robot ends as it began. First leg along +x.
fn square(run: u32, side_m: f64, clockwise: bool) -> MotionProgram {
    let (turn_rad, protocol) =
        if clockwise { (-FRAC_PI_2, Protocol::SquareCw) } else { (FRAC_PI_2, Protocol::SquareCcw) };
    let side = [Motion::Straight { length_m: side_m }, Motion::Spin { turn_rad }];
    let settings = ProtocolSettings { side_m: Some(side_m), ..ProtocolSettings::default() };
    program(protocol.name(), run, protocol, settings, side.repeat(4))
}

/// Equal arcs of at most half a turn with a reading between each two.
fn circle(run: u32, radius_m: f64, turns: f64, clockwise: bool) -> MotionProgram {
    let arcs = (2.0 * turns).ceil().max(1.0) as u32;
    let (sign, protocol) = if clockwise { (-1.0, Protocol::CircleCw) } else { (1.0, Protocol::CircleCcw) };
    let arc = Motion::Arc { radius_m, turn_rad: sign * TAU * turns / f64::from(arcs) };
    let motions: Vec<_> = (0..arcs).flat_map(|_| [arc, Motion::Measure]).take(2 * arcs as usize - 1).collect();
    let settings = ProtocolSettings { radius_m: Some(radius_m), ..ProtocolSettings::default() };
    program(protocol.name(), run, protocol, settings, motions)
}

/// A corridor loop: two rounds of a rectangle would close; this walks nine legs, four turns left and four
/// right, as the paper's figure 7 does not say which.
fn validation_path(run: u32, length_m: f64, measure_every_m: f64) -> MotionProgram {
    let steps = (length_m / measure_every_m).round().max(1.0) as usize;
    let mut motions = Vec::with_capacity(2 * steps + VALIDATION_LEGS);
    for step in 0..steps {
        if step > 0 && step * VALIDATION_LEGS / steps != (step - 1) * VALIDATION_LEGS / steps {
            let turn = step * VALIDATION_LEGS / steps;
            motions.push(Motion::Spin { turn_rad: if turn <= VALIDATION_LEGS / 2 { FRAC_PI_2 } else { -FRAC_PI_2 } });
        }
        motions.push(Motion::Straight { length_m: measure_every_m });
        if step + 1 < steps {
            motions.push(Motion::Measure);
        }
    }
    let settings = ProtocolSettings { length_m: Some(length_m), ..ProtocolSettings::default() };
    program("validation", run, Protocol::Path, settings, motions)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length_m(program: &MotionProgram) -> f64 {
        program
            .motions
            .iter()
            .map(|motion| if let Motion::Straight { length_m } = motion { length_m.abs() } else { 0.0 })
            .sum()
    }

    fn turns(program: &MotionProgram) -> Vec<f64> {
        program
            .motions
            .iter()
            .filter_map(|motion| if let Motion::Spin { turn_rad } = motion { Some(*turn_rad) } else { None })
            .collect()
    }

    #[test]
    fn straights_and_spins_alternate() {
        let straights = Schedule::Straights { length_m: 0.5, runs: 3 }.programs();
        assert_eq!(straights[0].motions, [Motion::Straight { length_m: 0.5 }]);
        assert_eq!(straights[1].motions, [Motion::Straight { length_m: -0.5 }]);
        assert_eq!(straights[2].id, "straight_002");
        let spins = Schedule::Spins { turn_rad: TAU, runs: 2 }.programs();
        assert_eq!(spins[0].settings.turn_rad, Some(TAU));
        assert_eq!(spins[1].settings.turn_rad, Some(-TAU));
    }

    #[test]
    fn pairs_of_runs_are_driven_alike_in_both_directions() {
        let length_m = 0.5;
        for schedule in [
            Schedule::Straights { length_m, runs: 7 },
            Schedule::Spins { turn_rad: TAU, runs: 7 },
            Schedule::Squares { side_m: 1.0, runs_each_way: 7 },
            Schedule::Circles { radius_m: 1.0, turns: None, runs_each_way: 7 },
        ] {
            let programs = schedule.with_pairs(3).programs();
            assert_eq!((programs.len(), schedule.with_pairs(3).runs()), (6, 6));
            let one_way = programs.iter().filter(|program| program.motions == programs[0].motions).count();
            assert_eq!(one_way, 3, "{schedule:?}");
        }
    }

    #[test]
    fn squares_close_in_both_directions() {
        let squares = Schedule::Squares { side_m: 4.0, runs_each_way: 5 }.programs();
        assert_eq!(squares.len(), 10);
        assert_eq!(squares.iter().filter(|square| square.protocol == Protocol::SquareCw).count(), 5);
        for square in &squares {
            assert_eq!(length_m(square), 16.0);
            let turn: f64 = turns(square).iter().sum();
            assert_eq!(turn.abs(), TAU);
            assert_eq!(turn < 0.0, square.protocol == Protocol::SquareCw);
        }
    }

    #[test]
    fn circles_go_round_as_often_as_asked_and_are_read_every_half_turn_or_sooner() {
        for (turns, arcs) in [(None, 2), (Some(0.5), 1), (Some(0.25), 1), (Some(0.75), 2), (Some(2.0), 4)] {
            let circles = Schedule::Circles { radius_m: 1.5, turns, runs_each_way: 2 }.programs();
            assert_eq!(circles.len(), 4);
            for circle in circles {
                let of = |motion: &Motion| match *motion {
                    Motion::Arc { radius_m: 1.5, turn_rad } => Some(turn_rad),
                    _ => None,
                };
                let arcs_rad: Vec<f64> = circle.motions.iter().filter_map(of).collect();
                let readings = circle.motions.iter().filter(|motion| **motion == Motion::Measure).count();
                assert_eq!((arcs_rad.len(), readings, circle.motions.len()), (arcs, arcs - 1, 2 * arcs - 1));
                let turn_rad: f64 = arcs_rad.iter().sum();
                // A sum of four numbers of size π.
                assert!((turn_rad.abs() - TAU * turns.unwrap_or(1.0)).abs() < 1e-14);
                assert_eq!(turn_rad < 0.0, circle.protocol == Protocol::CircleCw);
                assert_eq!(circle.settings.radius_m, Some(1.5));
            }
        }
    }

    #[test]
    fn the_validation_path_is_the_papers() {
        let path = &Schedule::ValidationPath { length_m: 40.0, measure_every_m: 0.5, runs: 1 }.programs()[0];
        assert_eq!(length_m(path), 40.0);
        assert_eq!(turns(path).len(), 8);
        // The start, the end and 79 in between: every 0.5 m.
        assert_eq!(path.motions.iter().filter(|motion| **motion == Motion::Measure).count(), 79);
    }
}
