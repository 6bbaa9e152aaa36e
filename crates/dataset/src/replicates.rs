//! Replicates: the same runs measured in several trials, lane by lane.
//!
//! What trials have in common stands once; what differs is an array of one number a trial, so that whoever
//! makes or estimates from them does the same arithmetic for all lanes at once.

use kinematics::{Point, Wheels};

use crate::record::{
    Dataset, MarkedPoint, NominalRobot, Odometry, PointReading, Provenance, Run, RunInfo, TruthNoise, WheelLog,
};

/// How many trials stand side by side: two vectors of the widest instructions.
pub const LANES: usize = 16;

/// W trials of the same runs of one robot, which counts ticks and is read on marked points.
#[derive(Debug, Clone, PartialEq)]
pub struct Replicates<const W: usize = LANES> {
    /// Nominal values.
    pub robot: NominalRobot,
    /// Precision of the outside instrument.
    pub truth_noise: TruthNoise,
    /// Marked points of the robot.
    pub points: Vec<MarkedPoint>,
    /// The runs.
    pub runs: Vec<ReplicatedRun<W>>,
}

/// W trials of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReplicatedRun<const W: usize = LANES> {
    /// Id and protocol.
    pub info: RunInfo,
    /// The rows' timestamps, seconds.
    pub t_s: Vec<f64>,
    /// Each wheel's ticks, row by row: whole numbers.
    pub ticks: Vec<Wheels<[f64; W]>>,
    /// Marked points read in the room.
    pub point_readings: Vec<ReplicatedReading<W>>,
}

/// W trials of a reading of a marked point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplicatedReading<const W: usize = LANES> {
    /// When, seconds.
    pub t_s: f64,
    /// Position in the list of marked points.
    pub point: usize,
    /// Where it was read in the room, metres.
    pub x_m: [f64; W],
    /// As `x_m`.
    pub y_m: [f64; W],
}

impl<const W: usize> ReplicatedReading<W> {
    /// Where one trial read it.
    #[inline(always)]
    #[must_use]
    pub const fn room(&self, lane: usize) -> Point {
        Point { x_m: self.x_m[lane], y_m: self.y_m[lane] }
    }
}

impl<const W: usize> ReplicatedRun<W> {
    /// The turn of each wheel from the first row to the last in ticks; `None` when the run has no row.
    #[inline(always)]
    #[must_use]
    pub fn turned_ticks(&self) -> Option<Wheels<[f64; W]>> {
        let (first, last) = (self.ticks.first()?, self.ticks.last()?);
        let turned = |last: &[f64; W], first: &[f64; W]| std::array::from_fn(|lane| last[lane] - first[lane]);
        Some(Wheels { left: turned(&last.left, &first.left), right: turned(&last.right, &first.right) })
    }

    /// The records of one trial.
    fn run(&self, lane: usize) -> Run {
        let column = |of: fn(&Wheels<[f64; W]>) -> &[f64; W]| {
            self.ticks.iter().map(|ticks| of(ticks)[lane] as i64).collect::<Vec<_>>()
        };
        let ticks = Wheels { left: column(|ticks| &ticks.left), right: column(|ticks| &ticks.right) };
        let reading = |of: &ReplicatedReading<W>| PointReading { t_s: of.t_s, point: of.point, room: of.room(lane) };
        Run {
            info: self.info.clone(),
            odometry: Odometry { t_s: self.t_s.clone().into(), wheels: WheelLog::Ticks(ticks), ..Odometry::default() },
            point_readings: self.point_readings.iter().map(reading).collect(),
            ..Run::default()
        }
    }
}

impl<const W: usize> Replicates<W> {
    /// The dataset of one trial.
    #[must_use]
    pub fn dataset(&self, lane: usize) -> Dataset {
        Dataset {
            provenance: Provenance::default(),
            robot: self.robot,
            truth_noise: self.truth_noise,
            points: self.points.clone(),
            runs: self.runs.iter().map(|run| run.run(lane)).collect(),
        }
    }
}
