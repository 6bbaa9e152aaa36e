//! Cases whose truth is that of one instrument as people have it, in place of one that is drawn: motion
//! capture, a robot's own SLAM, a gyro with a tape and a mark, a wall before a lidar, or a tape and a mark.
//!
//! Motion capture and SLAM see any path under any condition. Without poses the robot drives what its
//! instrument can measure: straights and spins, or straights and squares, one to a run, from one mark. Such
//! logs have every row, true stamps, one clock and the controllers' counts: what rounding does to tapes and
//! marks is not in the oracle. Each even case is a null, each odd one a single effect.

use std::f64::consts::TAU;
use std::str::FromStr;

use dataset::Dataset;
use motion_programs::{Motion, MotionProgram, Schedule};
use scenario::{Instrument, Placement, Slam, Wall};

use super::conditions::{Conditions, Stamps};
use super::draw::{CaseDraws, Draw};
use super::instrument::{InstrumentModel, TruthKind};
use super::robot::{PathFamily, RandomRobot, programs_of};

/// An instrument that all cases of a campaign are seen by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CaseInstrument {
    /// Poses of motion capture: 20 Hz, 0.3 mm, 0.5 mrad.
    Capture,
    /// Poses of the robot's own SLAM, with the errors of `scenarios/slam.toml`.
    Slam,
    /// A gyro of unknown scale, straights by tape, and headings of whole turns against a mark.
    GyroTape,
    /// A lidar that sees one wall ahead of the straights.
    Wall,
    /// Straights by tape, and a mark to which squares come back.
    Revisit,
}

/// The SLAM of `scenarios/slam.toml`.
const SLAM: Slam = Slam {
    rate_hz: 5.0,
    sigma_xy_m: 0.005,
    sigma_theta_rad: 0.005,
    map_sigma_xy_m: 0.015,
    map_sigma_theta_rad: 0.01,
    map_length_m: 1.0,
    map_scale_error: 0.0,
    wander_sigma_xy_m: 0.01,
    wander_sigma_theta_rad: 0.005,
    wander_tau_s: 3.0,
    jump_rate_hz: 0.0033,
    jump_m: 0.03,
    jump_rad: 0.01,
    stated_over_true: 0.2,
};

/// Motion capture: samples a second, and standard deviations of position, metres, and heading, radians.
const CAPTURE: (f64, f64, f64) = (20.0, 3e-4, 5e-4);
/// Instruments without poses, as in `scenarios/instruments-*.toml`.
const TAPE_SIGMA_M: f64 = 0.001;
const MARK_SIGMA_M: f64 = 0.001;
const MARK_SIGMA_RAD: f64 = 0.003;
const GYRO_RAD_PER_SQRT_S: f64 = 2e-4;
const GYRO_BIAS_RADPS: f64 = 0.01;
const GYRO_BIAS_WALK: f64 = 2e-5;
const GYRO_SCALE: f64 = 0.01;
const WALL_RATE_HZ: f64 = 10.0;
const WALL_SIGMA_M: f64 = 0.003;
const WALL_SIGMA_RAD: f64 = 0.001;
/// The wall is so far beyond the end of the longest straight, metres.
const WALL_BEYOND_M: f64 = 1.5;
/// Runs start so near to their mark, metres and radians.
const PLACEMENT: Placement = Placement { half_width_m: 0.05, half_width_rad: 0.02 };
/// Standing before each run, which shows a gyro's bias, and after it, seconds.
const STANDING_S: [f64; 2] = [5.0, 2.0];
/// Most rows a second of logs without poses: their runs take minutes.
const MAX_LOG_RATE_HZ: f64 = 20.0;
/// Straights take so long, seconds, and are so long, metres: a tape is laid over a metre and more.
const STRAIGHT_S: (f64, f64) = (6.0, 12.0);
const STRAIGHT_M: (f64, f64) = (1.0, 5.0);
/// Sides of squares, metres: a square comes back to its mark whose wheelbase is 3 % off.
const SIDE_M: (f64, f64) = (0.5, 1.2);
/// Whole turns of a spin: a heading that is 4.5 % off is still told from one a turn away.
const SPIN_TURNS: f64 = 4.0;
/// Runs of each kind, as in `scenarios/instruments-*.toml`.
const STRAIGHTS: u32 = 12;
const SPINS: u32 = 6;
const SQUARES_EACH_WAY: u32 = 8;
/// Noise-free records are drawn with so small a share of the errors, and state all of them: an instrument
/// without any error states none.
const NOISE_FREE: f64 = 1e-6;

impl CaseInstrument {
    /// All of them, by the words of the command.
    pub const NAMED: [(&'static str, Self); 5] = [
        ("capture", Self::Capture),
        ("slam", Self::Slam),
        ("gyro-tape", Self::GyroTape),
        ("wall", Self::Wall),
        ("revisit", Self::Revisit),
    ];

    /// Whether it gives poses.
    const fn has_poses(self) -> bool {
        matches!(self, Self::Capture | Self::Slam)
    }

    /// The drawn conditions of a robot, as far as the cases of the instrument have them.
    pub(crate) fn conditions(self, mut drawn: Conditions) -> Conditions {
        if !self.has_poses() {
            drawn.log_rate_hz = drawn.log_rate_hz.min(MAX_LOG_RATE_HZ);
            drawn.ticks_per_turn = drawn.counts_per_turn().round();
            (drawn.lost_row_share, drawn.clock_drift) = (0.0, 0.0);
            if !matches!(drawn.stamps, Stamps::Irregular { .. }) {
                drawn.stamps = Stamps::Exact;
            }
        }
        drawn
    }

    /// How it sees the robot.
    pub(crate) fn model(self, conditions: &Conditions) -> InstrumentModel {
        let (rate_hz, sigma_xy_m, sigma_theta_rad) = match self {
            Self::Capture => CAPTURE,
            Self::Slam => (SLAM.rate_hz, SLAM.sigma_xy_m, SLAM.sigma_theta_rad),
            Self::GyroTape => (conditions.log_rate_hz, TAPE_SIGMA_M, MARK_SIGMA_RAD),
            Self::Wall => (WALL_RATE_HZ, WALL_SIGMA_M, WALL_SIGMA_RAD),
            Self::Revisit => (conditions.log_rate_hz, MARK_SIGMA_M, MARK_SIGMA_RAD),
        };
        let kind = if self.has_poses() { TruthKind::Dense } else { TruthKind::Partial };
        let noise = [sigma_xy_m, sigma_theta_rad];
        if self != Self::Slam {
            return InstrumentModel::white(kind, rate_hz, noise);
        }
        // The map's errors last while the robot crosses a patch; by the way in all runs alike, which the
        // oracle does not know.
        let patch_s = SLAM.map_length_m / (MEAN_SPEED_M_S * conditions.speed_scale);
        let lasting = |wander: f64, map: f64| [(wander, SLAM.wander_tau_s), (map, patch_s)];
        let xy = lasting(SLAM.wander_sigma_xy_m, SLAM.map_sigma_xy_m);
        let theta = lasting(SLAM.wander_sigma_theta_rad, SLAM.map_sigma_theta_rad);
        InstrumentModel::white(kind, rate_hz, noise).with_lasting([xy, theta])
    }

    /// The robot with what it drives under the instrument.
    pub(crate) fn robot(self, mut robot: RandomRobot, draws: CaseDraws) -> RandomRobot {
        if self.has_poses() {
            return robot;
        }
        let mut draw = draws.of("instrument paths");
        robot.family = PathFamily::Protocols;
        robot.sessions.truncate(1);
        for session in &mut robot.sessions {
            session.scenario.placement = PLACEMENT;
            let (length_m, schedules) = self.schedules(session.scenario.robot.cruise_speed_m_s, &mut draw);
            session.scenario.instruments = self.instruments(length_m);
            session.programs = programs_of(&schedules).into_iter().map(standing).collect();
        }
        robot
    }

    /// The length of the straights, metres, and what is driven.
    fn schedules(self, speed_m_s: f64, draw: &mut Draw) -> (f64, [Schedule; 2]) {
        let length_m = (speed_m_s * draw.uniform(STRAIGHT_S.0, STRAIGHT_S.1)).clamp(STRAIGHT_M.0, STRAIGHT_M.1);
        let side_m = (0.5 * length_m).clamp(SIDE_M.0, SIDE_M.1);
        let other = match self {
            Self::Revisit => Schedule::Squares { side_m, runs_each_way: SQUARES_EACH_WAY },
            _ => Schedule::Spins { turn_rad: SPIN_TURNS * TAU, runs: SPINS },
        };
        (length_m, [Schedule::Straights { length_m, runs: STRAIGHTS }, other])
    }

    /// The instruments without poses, for straights of a length, metres.
    fn instruments(self, length_m: f64) -> Vec<Instrument> {
        let tape = Instrument::Tape { sigma_m: TAPE_SIGMA_M };
        match self {
            Self::Capture | Self::Slam => Vec::new(),
            Self::GyroTape => vec![
                Instrument::Gyro {
                    noise_rad_per_sqrt_s: GYRO_RAD_PER_SQRT_S,
                    bias_radps: GYRO_BIAS_RADPS,
                    bias_walk_radps_per_sqrt_s: GYRO_BIAS_WALK,
                    scale: GYRO_SCALE,
                    scale_sigma: 0.0,
                    still_s: STANDING_S[0],
                },
                tape,
                Instrument::Revisit { sigma_xy_m: 0.0, sigma_theta_rad: MARK_SIGMA_RAD },
            ],
            Self::Wall => vec![Instrument::Wall(Wall {
                rate_hz: WALL_RATE_HZ,
                sigma_m: WALL_SIGMA_M,
                sigma_rad: WALL_SIGMA_RAD,
                range_m: 3.0 * length_m + WALL_BEYOND_M,
                wall_distance_m: length_m + WALL_BEYOND_M,
                wall_direction_rad: -0.25 * TAU,
                lever_x_m: 0.0,
                lever_y_m: 0.0,
                lever_theta_rad: 0.0,
                still_s: STANDING_S[1],
            })],
            Self::Revisit => {
                vec![tape, Instrument::Revisit { sigma_xy_m: MARK_SIGMA_M, sigma_theta_rad: MARK_SIGMA_RAD }]
            }
        }
    }

    /// The instruments of a scenario, with their errors or without, where its sessions' own are `listed`.
    pub(crate) fn at_work(self, listed: &mut Vec<Instrument>, noisy: bool) {
        if self == Self::Slam && noisy {
            *listed = vec![Instrument::Slam(SLAM)];
        }
        if noisy {
            return;
        }
        for instrument in listed {
            match instrument {
                Instrument::Gyro { noise_rad_per_sqrt_s, bias_walk_radps_per_sqrt_s, .. } => {
                    *noise_rad_per_sqrt_s *= NOISE_FREE;
                    *bias_walk_radps_per_sqrt_s *= NOISE_FREE;
                }
                Instrument::Tape { sigma_m } => *sigma_m *= NOISE_FREE,
                Instrument::Wall(wall) => {
                    (wall.sigma_m, wall.sigma_rad) = (WALL_SIGMA_M * NOISE_FREE, WALL_SIGMA_RAD * NOISE_FREE);
                }
                Instrument::Revisit { sigma_xy_m, sigma_theta_rad } => {
                    *sigma_xy_m *= NOISE_FREE;
                    *sigma_theta_rad *= NOISE_FREE;
                }
                _ => {}
            }
        }
    }

    /// Whether the dataset states what the simulated instruments state, and not what was drawn.
    pub(crate) fn states_its_own(self) -> bool {
        self != Self::Capture
    }

    /// Makes noise-free records state the errors that those with noise have.
    pub(crate) fn restate(self, dataset: &mut Dataset) {
        let whole = |sigma: &mut f64| *sigma /= NOISE_FREE;
        let gyro = &mut dataset.truth_noise.gyro;
        let gyro = [&mut gyro.noise_rad_per_sqrt_s, &mut gyro.bias_walk_radps_per_sqrt_s];
        gyro.into_iter().flatten().for_each(whole);
        for run in &mut dataset.runs {
            run.distances.iter_mut().for_each(|of| whole(&mut of.sigma_m));
            let revisits = run.revisits.iter_mut().flat_map(|of| [&mut of.sigma_xy_m, &mut of.sigma_theta_rad]);
            let walls = run.walls.iter_mut().flat_map(|of| [&mut of.sigma_m, &mut of.sigma_rad]);
            revisits.chain(walls).flatten().for_each(whole);
        }
    }
}

/// Mean cruise speed of a robot of usual size, m/s; the map's patches are crossed at it.
const MEAN_SPEED_M_S: f64 = 0.3;

/// The program with the robot standing before it and after it.
fn standing(program: MotionProgram) -> MotionProgram {
    let [before, after] = STANDING_S.map(|duration_s| Motion::Pause { duration_s });
    let motions = std::iter::once(before).chain(program.motions).chain([after]).collect();
    MotionProgram { motions, ..program }
}

impl FromStr for CaseInstrument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = || Self::NAMED.map(|(name, _)| name).join(", ");
        let found = Self::NAMED.into_iter().find(|(name, _)| *name == text);
        found
            .map(|(_, of)| of)
            .ok_or_else(|| format!("not an instrument of the blind benchmark; there are {}", known()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use crate::scope::Scope;

    #[test]
    fn each_instrument_measures_what_determines_the_drive() {
        for (name, instrument) in CaseInstrument::NAMED {
            let Ok(case) = Case::draw(Scope::Instrument(instrument), 5, 0).expect("simulates") else {
                panic!("no null")
            };
            let runs = || case.datasets.iter().flat_map(|dataset| &dataset.runs);
            let poses = runs().map(|run| run.truth.len()).sum::<usize>();
            assert_eq!(poses > 0, instrument.has_poses(), "{name}");
            let [tapes, marks, walls, gyros] = [
                runs().map(|run| run.distances.len()).sum::<usize>(),
                runs().map(|run| run.revisits.len()).sum(),
                runs().map(|run| run.walls.len()).sum(),
                runs().filter(|run| run.gyro_rates().is_some()).count(),
            ];
            // One tape a straight, one mark a spin or square; a spin is whole turns.
            let expected = match instrument {
                CaseInstrument::Capture | CaseInstrument::Slam => [0, 0],
                CaseInstrument::GyroTape => [12, 6],
                CaseInstrument::Revisit => [12, 16],
                CaseInstrument::Wall => [0, 0],
            };
            // Sides of squares are not taped: the robot does not stop to be read.
            assert_eq!([tapes, marks], expected, "{name}");
            assert_eq!(gyros > 0, instrument == CaseInstrument::GyroTape, "{name}");
            assert_eq!(walls > 0, instrument == CaseInstrument::Wall, "{name}");
        }
    }
}
