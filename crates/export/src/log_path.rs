//! A logged run as the robot's own odometry would have had it: row by row, with nothing of what comes after.

use dataset::{Run, RunInfo, WheelLog};
use effects::{Input, OnBoard, RawInterval};
use kinematics::{Pose, Wheels};

use crate::causal::OnBoardInputs;
use crate::error::ExportError;
use crate::on_board::OnBoardOdometry;
use crate::robot::CalibratedRobot;

/// Where a logged run starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogStart {
    /// The drive's centre in the room.
    pub world_from_body: Pose,
    /// Distance driven in the session before, metres.
    pub session_m: f64,
    /// The robot is told at its start what the log says beside counts; else nothing.
    pub is_logged: bool,
}

impl CalibratedRobot {
    /// Poses at the rows of a run by on-board odometry; `None` where the run has no counts.
    ///
    /// # Errors
    /// [`ExportError`] when the robot has no counts, or is no drive.
    pub fn on_board_path(
        &self,
        run: &Run,
        counter_bits: Option<u8>,
        start: &LogStart,
    ) -> Result<Option<Vec<(f64, Pose)>>, ExportError> {
        let WheelLog::Ticks(Wheels { left, right }) = &run.odometry.wheels else { return Ok(None) };
        let t_s = &run.odometry.t_s;
        let counts = |row: usize| Wheels { left: left[row], right: right[row] };
        if t_s.is_empty() {
            return Ok(None);
        }
        let mut odometry = OnBoardOdometry::new(self, counter_bits, counts(0))?.starting_at(start.world_from_body);
        if start.is_logged {
            odometry.step_with(counts(0), 0.0, &self.logged(&run.info, t_s[0], counts(0), start)?);
        }
        let mut path = vec![(t_s[0], odometry.pose())];
        for row in 1..t_s.len() {
            odometry.step(counts(row), t_s[row] - t_s[row - 1]);
            path.push((t_s[row], odometry.pose()));
        }
        Ok(Some(path))
    }

    /// Whether it has effects that are off until the robot is told something.
    #[must_use]
    pub fn needs_inputs(&self) -> bool {
        self.effects.iter().any(|effect| effect.on_board.input().is_some())
    }

    /// What a log says at its first row beside counts.
    fn logged(
        &self,
        info: &RunInfo,
        t_s: f64,
        counts: Wheels<i64>,
        start: &LogStart,
    ) -> Result<OnBoardInputs, ExportError> {
        let raw = RawInterval { counts: counts.map(|counts| counts as f64), dt_s: t_s };
        let raw = self.corrections().fold(raw, |raw, effect| match effect.on_board {
            OnBoard::Constant(correction) => (correction.correct)(&|name| effect.size(name), raw),
            _ => raw,
        });
        let rad_per_count = std::f64::consts::TAU / self.ticks_per_rev()?;
        let payload_kg = Input::Payload.covariate().and_then(|key| info.covariates.get(key).copied());
        Ok(OnBoardInputs {
            wheel_rad: raw.counts.map(|counts| info.continuous.then_some(counts * rad_per_count)),
            room_heading_rad: Some(start.world_from_body.theta_rad),
            payload_kg,
            session_s: Some(info.start_s.unwrap_or(0.0) + raw.dt_s),
            session_m: Some(start.session_m),
        })
    }
}
