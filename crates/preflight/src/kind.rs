//! The kinds of problem, each with its numbers.

use kinematics::Side;

use crate::record_fault::RecordFault;

/// What is wrong, with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Kind {
    /// Nothing moves, in the log or for the instrument.
    NothingMoves { wheels_turn_rad: f64, truth_extent_m: Option<f64> },
    /// What the instrument saw has nothing to do with what the wheels did.
    TruthUnrelated { unexplained: f64 },
    /// All times are in milliseconds.
    TimeInMilliseconds { row: f64 },
    /// Times of the instrument are of another unit than those of the log.
    TruthTimeUnit { unit: usize, of_truth: bool },
    /// Clocks are apart: truth's stamps are too large by so much.
    ClockOffset { offset_s: f64, sigma_s: f64 },
    /// Truth's clock is fast by this share.
    ClockRate { rate: f64, of_session: bool },
    /// Headings are in degrees.
    HeadingInDegrees,
    /// Headings count clockwise.
    HeadingClockwise,
    /// x and y are exchanged, or one of them is mirrored.
    AxesMirrored { axis: MirroredAxis },
    /// Left and right are exchanged, or the truth is mirrored.
    WheelsExchanged { label: Option<bool> },
    /// A wheel counts backwards.
    WheelBackwards { sides: Vec<Side> },
    /// Records say something else than what happened, in rows or throughout.
    Record(RecordFault),
    /// Wheels and separation are so many times as large as stated.
    LengthUnit { ratio: f64, unit: Option<&'static str>, of_truth: bool },
    /// Both wheels are so many times as large as stated.
    TicksPerTurn { ratio: f64, stated: Option<f64>, simple: bool },
    /// One wheel or the separation is so many times as large as stated.
    OtherRobot { parameter: &'static str, ratio: f64 },
    /// Sessions are of different robots.
    SeveralRobots { parameter: &'static str, sessions: [String; 2], values_m: [f64; 2] },
    /// The truth is computed from the wheels.
    TruthIsOdometry,
    /// Between its corrections the truth moves as the wheels do, in a share of its steps.
    TruthFollowsOdometry { share: f64 },
    /// A counter shows something else for a row.
    CounterSpike { side: Side, t_s: f64, count: f64, rows: usize },
    /// A counter starts again from 0.
    CounterRestart { side: Side, t_s: f64 },
    /// The instrument errs by metres for a row.
    TruthOutlier { t_s: f64, distance_m: f64, rows: usize },
    /// Rates are of the instant, not of the interval.
    InstantRates,
    /// Recorded rates are rounded to a step, m/s and rad/s, which is such a share of what wheels roll.
    RoundedRates { step: f64, share: f64 },
    /// A gap within a log.
    Gap { t_s: f64, length_s: f64 },
    /// Rows are sent so many at a time.
    RowsInPackets { rows: usize },
    /// Rows are missing.
    LostRows { share: f64 },
    /// Too little was driven.
    TooShort { distance_m: f64 },
    /// All turns go one way.
    OneWayTurns { left: bool },
    /// Parameters that these runs do not determine.
    NotDetermined { parameters: Vec<&'static str>, why: String },
    /// Tapes, walls, returns or a gyroscope in runs that have displacements too, where no method takes them.
    UnusedMeasurements { gyro_alone: bool },
}

/// How positions of the instrument are mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MirroredAxis {
    /// x and y are exchanged.
    Exchanged,
    /// x has the wrong sign.
    X,
    /// y has the wrong sign.
    Y,
}
