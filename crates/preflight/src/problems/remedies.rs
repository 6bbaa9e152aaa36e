//! What would determine the parameters that the instruments of some runs leave open: the cheapest instruments
//! beside the same drives.
//!
//! The information that each would add to what is there is that of its measurements of the runs as they were
//! driven, with the standard deviations that people reach with it.

use serde::Serialize;

use crate::problems::coverage::{Coverage, Information, PARAMETERS, add_row, are_determined, gradients, travel};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

/// An instrument that most people have or can make.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Remedy {
    /// A tape measure along straights.
    Tape,
    /// A mark on the floor: the heading after whole turns.
    Revisit,
    /// A gyroscope whose scale nobody knows.
    Gyro,
    /// A lidar in front of a wall.
    Wall,
    /// Poses of motion capture, SLAM or a camera.
    Poses,
}

impl Remedy {
    /// From the cheapest on.
    const ALL: [Self; 5] = [Self::Tape, Self::Revisit, Self::Gyro, Self::Wall, Self::Poses];

    /// What to do with it.
    const fn what(self) -> &'static str {
        match self {
            Self::Tape => "a tape measure: the distance between where each straight began and ended (distance.csv)",
            Self::Revisit => {
                "a mark on the floor: the heading at the end of whole turns, seen from the start (revisit.csv)"
            }
            Self::Gyro => "a gyro, with 10 s of standstill in every run (gyro_radps)",
            Self::Wall => "a lidar in front of a straight wall (wall.csv; import ros2 --scan)",
            Self::Poses => "poses from outside: motion capture, SLAM or a camera (truth.csv)",
        }
    }

    /// Adds what it would tell of a session's drives.
    fn add(self, information: &mut Information, session: &SessionCheck) {
        for run in &session.runs {
            let Some(last) = run.wheels.left.len().checked_sub(1) else { continue };
            let (travel_m, turn_rad) = travel(run, session, 0, last);
            let [by_length, by_turn] = gradients(travel_m, turn_rad, session.robot.wheel_separation_m);
            let is_straight = turn_rad.abs() < CHECKS.max_straight_turn_rad;
            let is_far = 0.5 * (travel_m.left + travel_m.right).abs() > CHECKS.min_taped_m;
            let mut length = |sigma_m: f64| {
                if is_straight && is_far {
                    add_row(information, by_length, sigma_m);
                }
            };
            match self {
                Self::Tape => length(CHECKS.tape_sigma_m),
                Self::Wall if !session.has_lidar => length(CHECKS.wall_sigma_m),
                Self::Poses => length(CHECKS.pose_sigma_m),
                Self::Revisit | Self::Gyro | Self::Wall => {}
            }
            let sigma_rad = match self {
                Self::Revisit if turn_rad.abs() >= std::f64::consts::PI => Some(CHECKS.mark_sigma_rad),
                Self::Gyro if is_straight => Some(CHECKS.gyro_turn_sigma_rad),
                Self::Wall => Some(CHECKS.wall_sigma_rad),
                Self::Poses => Some(CHECKS.pose_sigma_rad),
                Self::Tape | Self::Revisit | Self::Gyro => None,
            };
            if let Some(sigma_rad) = sigma_rad {
                add_row(information, by_turn, sigma_rad);
            }
        }
    }
}

/// What would determine a parameter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct WouldDetermine {
    /// The parameter that is open.
    pub parameter: &'static str,
    /// The fewest and cheapest instruments that would determine it beside these drives; none where other
    /// drives are needed.
    pub with: Vec<Remedy>,
    /// The same in words.
    pub sentence: String,
}

/// What would determine each parameter that is open, with the same drives.
pub(crate) fn found(sessions: &[SessionCheck], coverage: &Coverage) -> Vec<WouldDetermine> {
    let determined = are_determined(&coverage.information, coverage.partial);
    let open = (0..PARAMETERS.len()).filter(|row| !determined[*row]);
    let singles = Remedy::ALL.map(|one| vec![one]);
    let pairs = Remedy::ALL
        .into_iter()
        .enumerate()
        .flat_map(|(number, one)| Remedy::ALL.into_iter().skip(number + 1).map(move |other| vec![one, other]));
    let sets: Vec<(Vec<Remedy>, [bool; 3])> = singles
        .into_iter()
        .chain(pairs)
        .map(|set| {
            let mut information = coverage.information;
            for (remedy, session) in set.iter().flat_map(|remedy| sessions.iter().map(move |of| (remedy, of))) {
                remedy.add(&mut information, session);
            }
            let determined = are_determined(&information, coverage.partial);
            (set, determined)
        })
        .collect();
    open.map(|row| {
        let parameter = PARAMETERS[row];
        let set = sets.iter().find(|(_, determined)| determined[row]).map(|(set, _)| set.clone());
        let with = set.unwrap_or_default();
        let sentence = if with.is_empty() {
            format!("{parameter}: no instrument determines it with these drives: drive straights of some metres and turns both ways")
        } else {
            let what: Vec<&str> = with.iter().map(|remedy| remedy.what()).collect();
            format!("{parameter}: would be determined by {}", what.join(", and "))
        };
        WouldDetermine { parameter, with, sentence }
    })
    .collect()
}
