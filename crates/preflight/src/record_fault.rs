//! Faults of a log's records, with their numbers and words.

use std::fmt::{self, Display, Formatter};

use kinematics::Side;

use crate::run_log::RunLog;
use crate::settings::CHECKS;
use crate::shown_numbers::{times, to_ms};

/// What records say that did not happen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum RecordFault {
    /// A wheel's column, or both, counts so many times as much in a part of the log.
    WheelChange(WheelChange),
    /// Both wheels' columns are one, though the robot turns.
    WheelsAlike,
    /// A wheel's column gains so much a second by itself, such a share of what it turns.
    RunsOn { side: Side, rate_rad_s: f64, share: f64 },
    /// A gyroscope says the same in all rows.
    ConstantGyro { rate_rad_s: f64 },
    /// Rows of zeros between rows at speed, such a share of those in which the robot drives.
    ZeroRates { from: Place, rows: usize, share: f64 },
    /// Speeds leap from one end of their range to the other.
    RatesWrap { from: Place, rows: usize },
    /// Values are cut to whole steps toward zero, in such a share of the rows in which the robot drives.
    RatesCut { share: f64 },
    /// What the truth says of a run is of one so many later in the log.
    RunsShifted { ids: [String; 2], by: f64 },
    /// Poses repeat the one before while the wheels turn, in such a share of the steps.
    HeldPoses { share: f64, from: Place },
}

/// Records of wheels that count so many times as much in a part of the log as in the rest.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WheelChange {
    pub(crate) sides: Vec<Side>,
    pub(crate) gain: f64,
    /// Where the part begins and ends, if not with the log.
    pub(crate) from: Option<Place>,
    pub(crate) until: Option<Place>,
    /// Do the data tell that it is this part, and not the rest?
    pub(crate) is_known: bool,
}

impl WheelChange {
    pub(crate) fn is_dead(&self) -> bool {
        self.gain.abs() < CHECKS.dead_gain
    }

    pub(crate) fn is_backwards(&self) -> bool {
        (self.gain + 1.0).abs() < CHECKS.factor_tolerance
    }
}

/// A row of the log.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    pub(crate) run: String,
    pub(crate) t_s: f64,
    /// From one on.
    pub(crate) row: usize,
}

impl Place {
    /// The first row from an instant on.
    pub(crate) fn at(run: &RunLog, t_s: f64) -> Self {
        Self { run: run.id.clone(), t_s, row: run.t_s.partition_point(|row_s| *row_s < t_s) + 1 }
    }
}

impl Display for Place {
    fn fmt(&self, to: &mut Formatter<'_>) -> fmt::Result {
        write!(to, "t = {} s of run \"{}\" (row {})", to_ms(self.t_s), self.run, self.row)
    }
}

impl RecordFault {
    /// The problem's name.
    pub(crate) fn id(&self) -> &'static str {
        match self {
            Self::WheelChange(change) if change.is_dead() => "wheel_dead",
            Self::WheelChange(change) if change.is_backwards() => "wheel_backwards",
            Self::WheelChange(_) => "wheel_rescaled",
            Self::WheelsAlike => "wheels_alike",
            Self::RunsOn { .. } => "wheel_runs_on",
            Self::ConstantGyro { .. } => "gyro_constant",
            Self::ZeroRates { .. } => "rates_of_no_message",
            Self::RatesWrap { .. } => "rates_wrap",
            Self::RatesCut { .. } => "rates_cut",
            Self::RunsShifted { .. } => "truth_runs_shifted",
            Self::HeldPoses { .. } => "poses_held",
        }
    }

    /// What a person reads.
    pub(crate) fn sentence(&self) -> String {
        match self {
        Self::WheelChange(change) => change.sentence(),
        Self::WheelsAlike => "the records of both wheels are the same in every row, and the instrument sees the robot turn: one column is copied, or a yaw rate is never filled; record both wheels".to_owned(),
        Self::RunsOn { side, rate_rad_s, share } => format!(
            "the {} wheel's records run on by {rate_rad_s:.2e} rad/s by themselves, whether the robot drives or not, as of an encoder that flickers or a speed with an offset: {:.2} % of what the wheel turns; take the offset out of its column",
            side.name(),
            100.0 * share
        ),
        Self::ConstantGyro { rate_rad_s } => format!(
            "the gyroscope says {rate_rad_s} rad/s in every row, and the wheels turn the robot: its column is never filled; leave it out"
        ),
        Self::ZeroRates { from, rows, share } => format!(
            "{rows} rows of speeds are 0 between rows at speed, {:.2} % of the rows of a robot that drives, the first at {from}: no message came there, and a row that is 0 takes its distance away; delete these rows",
            100.0 * share
        ),
        Self::RatesWrap { from, rows } => format!(
            "speeds leap from one end of their range to the other and back, first at {from}, {rows} rows in all: they wrap at the largest number of their type; record them in a wider one, or add its range to these rows"
        ),
        Self::RatesCut { share } => format!(
            "{:.0} % of the rows in which the robot drives are whole steps that were cut toward zero, as distances and angles since the last row in whole millimetres and degrees: each row loses half of a step on average, which no later row makes up for; record counts, or sum up before values are rounded",
            100.0 * share
        ),
        Self::RunsShifted { ids: [first, other], by } => format!(
            "run ids of the truth are shifted by {by} against those of the log: what the truth calls \"{first}\" is run \"{other}\" of the log, and so on; mend the ids in truth.csv"
        ),
        Self::HeldPoses { share, from } => format!(
            "{:.0} % of the poses repeat the one before though the wheels turn, the first at {from}: the instrument's last pose is logged again until a new one comes; keep the first of equal poses",
            100.0 * share
        ),
        }
    }
}

impl WheelChange {
    fn sentence(&self) -> String {
        let whose = match &self.sides[..] {
            [side] => format!("the {} wheel's records", side.name()),
            _ => "both wheels' records".to_owned(),
        };
        let what = match self {
            of if of.is_dead() => "stand still while the robot drives".to_owned(),
            of if of.is_backwards() => "count backwards".to_owned(),
            of => format!("count {} as much for the same motion as in the rest of the log", times(of.gain)),
        };
        let when = match (&self.from, &self.until) {
            (Some(from), None) => format!("from {from} on"),
            (None, Some(until)) => format!("up to {until}"),
            (Some(from), Some(until)) => format!("from {from} to {until}"),
            (None, None) => "throughout".to_owned(),
        };
        if self.from.is_none() && self.until.is_none() {
            return format!("{whose} {what} {when}; check the encoder and the column's name");
        }
        let which = if self.is_known { "" } else { ", or the rest does: the data do not tell which part is right" };
        format!("{whose} {what} {when}{which}; cut the log there, and leave that part out")
    }
}
