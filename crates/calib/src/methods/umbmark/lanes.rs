//! `umbmark` for trials side by side: the same formulas in loops over lanes.

use dataset::{LANES, MarkedPoint, Protocol, ReplicatedReading, ReplicatedRun, Replicates, fit_two_points};
use kinematics::{
    DriveGeometry, Elementary, Formula, Frame, InstructionSet, Kernel, Odometry, Point, Pose, Rule, Wheels, by_lanes,
};

use super::formulas::{Direction, Form, calibration};
use crate::estimate::{CalibError, Calibration};
use crate::robust_lanes::{RetainedLanes, SummaryLanes};

/// The calibration of every trial; `None` where it is to be calibrated by itself.
pub(super) fn calibrations(form: Form, replicates: &Replicates) -> [Option<Result<Calibration, CalibError>>; LANES] {
    let lanes = InputLanes::of(replicates).map(|input| (InstructionSet::widest().run(EndErrors(&input)), input));
    std::array::from_fn(|lane| {
        let ([cw, ccw], input) = lanes.as_ref()?;
        let is_regular = cw.is_finite(lane) && ccw.is_finite(lane);
        let InputLanes { geometry, side_m, .. } = input;
        is_regular.then(|| calibration(form, &replicates.robot, geometry, *side_m, cw.of(lane), ccw.of(lane)))
    })
}

/// What the method looks at.
struct InputLanes<'r, const W: usize> {
    geometry: DriveGeometry,
    odometry: Odometry,
    side_m: f64,
    /// Squares clockwise and counter-clockwise.
    squares: [Vec<SquareLanes<'r, W>>; 2],
}

/// A square with two marks read at its start and at its end.
struct SquareLanes<'r, const W: usize> {
    ticks: &'r [Wheels<[f64; W]>],
    start: Marks<'r, W>,
    end: Marks<'r, W>,
}

/// Two marks: where each is on the robot, and its readings in the room.
type Marks<'r, const W: usize> = [(Point, &'r ReplicatedReading<W>); 2];

impl<'r, const W: usize> InputLanes<'r, W> {
    /// `None` where every trial is to be looked at by itself.
    fn of(replicates: &'r Replicates<W>) -> Option<Self> {
        let geometry = replicates.robot.geometry().ok()?;
        let m_per_count = geometry.m_per_count(replicates.robot.ticks_per_rev?).ok()?;
        let odometry =
            Odometry { m_per_count, wheel_separation_m: geometry.wheel_separation_m(), rule: Rule::Midpoint };
        let squares = |protocol| {
            let runs = replicates.runs.iter().filter(move |run| run.info.protocol == Some(protocol));
            runs.map(|run| SquareLanes::of(run, &replicates.points))
                .collect::<Option<Vec<_>>>()
                .filter(|squares| !squares.is_empty())
        };
        let is_square =
            |run: &&ReplicatedRun<W>| matches!(run.info.protocol, Some(Protocol::SquareCw | Protocol::SquareCcw));
        let mut sides = replicates.runs.iter().filter(is_square).map(|run| run.info.settings.side_m);
        let side_m = sides.next()??;
        if sides.any(|other| other != Some(side_m)) {
            return None;
        }
        let squares = [squares(Protocol::SquareCw)?, squares(Protocol::SquareCcw)?];
        Some(Self { geometry, odometry, side_m, squares })
    }
}

impl<'r, const W: usize> SquareLanes<'r, W> {
    /// `None` where two marks are not read at two instants.
    fn of(run: &'r ReplicatedRun<W>, points: &[MarkedPoint]) -> Option<Self> {
        let marks = |readings: &'r [ReplicatedReading<W>]| match readings {
            [a, b] => Some([(points.get(a.point)?.body, a), (points.get(b.point)?.body, b)]),
            _ => None,
        };
        let mut instants = run.point_readings.chunk_by(|a, b| a.t_s == b.t_s);
        let (start, end) = (marks(instants.next()?)?, marks(instants.next_back()?)?);
        (!run.ticks.is_empty()).then_some(Self { ticks: &run.ticks, start, end })
    }
}

/// Where a square ended, seen from its start, by the marks.
struct MeasuredEnd<'i, 'r, const W: usize>(&'i SquareLanes<'r, W>);

impl<const W: usize> Formula<2> for MeasuredEnd<'_, '_, W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 2] {
        let [x_m, y_m, theta_rad] = fit_two_points(elementary, pairs(&self.0.start, lane));
        let [end_x_m, end_y_m, _] = fit_two_points(elementary, pairs(&self.0.end, lane));
        let start_from_world = Frame::by(elementary, Pose::new(x_m, y_m, theta_rad)).inverse();
        let end = start_from_world * Point { x_m: end_x_m, y_m: end_y_m };
        [end.x_m, end.y_m]
    }
}

/// The marks on the robot and as one trial read them in the room.
#[inline(always)]
const fn pairs<const W: usize>(&[(a, in_room_a), (b, in_room_b)]: &Marks<'_, W>, lane: usize) -> [(Point, Point); 2] {
    [(a, in_room_a.room(lane)), (b, in_room_b.room(lane))]
}

/// End errors of the squares of one direction.
struct DirectionLanes<const W: usize> {
    x_m: SummaryLanes<W>,
    y_m: SummaryLanes<W>,
}

impl<const W: usize> DirectionLanes<W> {
    fn is_finite(&self, lane: usize) -> bool {
        self.x_m.mean[lane].is_finite() && self.y_m.mean[lane].is_finite()
    }

    fn of(&self, lane: usize) -> Direction {
        Direction { x_m: self.x_m.of(lane), y_m: self.y_m.of(lane) }
    }
}

/// The work on all lanes: end errors, clockwise and counter-clockwise.
struct EndErrors<'i, 'r, const W: usize>(&'i InputLanes<'r, W>);

impl<const W: usize> Kernel for EndErrors<'_, '_, W> {
    type Output = [DirectionLanes<W>; 2];

    #[inline(always)]
    fn call(self) -> [DirectionLanes<W>; 2] {
        let [cw, ccw] = &self.0.squares;
        [self.0.direction(cw), self.0.direction(ccw)]
    }
}

impl<const W: usize> InputLanes<'_, W> {
    #[inline(always)]
    fn direction(&self, squares: &[SquareLanes<'_, W>]) -> DirectionLanes<W> {
        let (mut x_m, mut y_m) = (Vec::with_capacity(squares.len()), Vec::with_capacity(squares.len()));
        for square in squares {
            // In the start's frame the odometry starts at the origin and the first leg points along +x.
            let [mut x_error_m, mut y_error_m] = by_lanes(&MeasuredEnd(square));
            let dead_reckoned = self.odometry.final_poses(Pose::IDENTITY, square.ticks.iter().copied());
            for lane in 0..W {
                x_error_m[lane] -= dead_reckoned[lane].x_m;
                y_error_m[lane] -= dead_reckoned[lane].y_m;
            }
            x_m.push(x_error_m);
            y_m.push(y_error_m);
        }
        DirectionLanes { x_m: RetainedLanes::all(&x_m).summary(), y_m: RetainedLanes::all(&y_m).summary() }
    }
}
