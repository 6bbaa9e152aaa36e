//! One session with what was found of it.

use dataset::{NominalRobot, Session};
use kinematics::Wheels;

use crate::alignment::{Comparison, Explained, Paired, paired};
use crate::clock::model::Clock;
use crate::geometry_estimate::{GeometryEstimate, OneDirection};
use crate::problem::Problem;
use crate::run_log::{RunLog, m_per_rad};
use crate::settings::CHECKS;
use crate::windows::{Measured, Reading, windows};

/// A session with what was found of it.
#[derive(Debug, Clone)]
pub(crate) struct SessionCheck {
    pub(crate) name: String,
    pub(crate) robot: NominalRobot,
    /// Relative standard deviation of the gyroscope's scale, where it is stated.
    pub(crate) gyro_scale_sigma: Option<f64>,
    /// Are readings of walls those of a lidar whose place on the robot is not known?
    pub(crate) has_lidar: bool,
    pub(crate) runs: Vec<RunLog>,
    pub(crate) problems: Vec<Problem>,
    pub(crate) matched: Option<Matched>,
}

/// Windows of log and instrument that go together.
#[derive(Debug, Clone)]
pub(crate) struct Matched {
    pub(crate) pairs: Vec<Paired>,
    pub(crate) measured: Measured,
    pub(crate) reading: Reading,
    pub(crate) clock: Clock,
    pub(crate) explained: Explained,
    pub(crate) geometry: Option<GeometryEstimate>,
    pub(crate) one_direction: Option<OneDirection>,
}

impl SessionCheck {
    /// A session of which nothing has been checked.
    pub(crate) fn new(session: &Session<'_>) -> Self {
        let runs: Vec<RunLog> = session.runs.iter().filter_map(|run| RunLog::of(run, session.robot)).collect();
        let name = session.name.to_owned();
        let gyro_scale_sigma = session.truth_noise.gyro.scale_sigma;
        let has_lidar = session.truth_noise.lidar.is_some();
        Self { name, robot: *session.robot, gyro_scale_sigma, has_lidar, runs, problems: Vec::new(), matched: None }
    }

    pub(crate) fn m_per_rad(&self) -> Wheels<f64> {
        m_per_rad(&self.robot)
    }

    /// The windows with a reading of the instrument's records and a clock.
    pub(crate) fn explained(&self, reading: Reading, clock: Clock) -> Option<Explained> {
        let (windows, measured) = windows(&self.runs, reading, CHECKS.max_windows);
        let comparison = Comparison { windows: &windows, measured, runs: &self.runs, m_per_rad: self.m_per_rad() };
        comparison.at(clock)
    }

    /// Windows of a reading and a clock, with the drive that they show.
    pub(crate) fn matched_at(&self, reading: Reading, clock: Clock) -> Option<Matched> {
        let (windows, measured) = windows(&self.runs, reading, CHECKS.max_windows);
        let pairs = paired(&windows, &self.runs, clock);
        if pairs.len() < CHECKS.min_windows {
            return None;
        }
        let explained = crate::alignment::explain(&pairs, measured, self.m_per_rad())?;
        let poses = measured == Measured::Poses;
        let one_direction = if poses { OneDirection::of(&pairs) } else { None };
        let geometry = if poses && one_direction.is_none() { GeometryEstimate::of(&pairs) } else { None };
        Some(Matched { pairs, measured, reading, clock, explained, geometry, one_direction })
    }

    /// Whether the instrument sees positions alone.
    pub(crate) fn measures_positions(&self) -> bool {
        windows(&self.runs, Reading::AS_IS, CHECKS.max_windows).1 == Measured::Positions
    }

    /// All turning of both wheels, radians.
    pub(crate) fn turning(&self) -> Wheels<f64> {
        self.runs.iter().map(RunLog::turning).fold(Wheels::both(0.0), |sum, run| sum.zip_with(run, |a, b| a + b))
    }
}
