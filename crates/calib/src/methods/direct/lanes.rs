//! `direct` for trials side by side: the same formulas in loops over lanes.
//!
//! A trial that has a value which is no number, or a spin of too small a turn, is calibrated by itself.

use dataset::{LANES, Protocol, ReplicatedReading, ReplicatedRun, Replicates};
use kinematics::{DriveGeometry, Elementary, Formula, InstructionSet, Kernel, Point, Side, Wheels, by_lanes};

use super::formulas::{Marks, Spin, WHEELBASE, calibration, check_marks, outermost, outlier, outside_m};
use crate::estimate::{CalibError, Calibration};
use crate::robust::MedianMad;
use crate::robust_lanes::{RetainedLanes, SummaryLanes};
use crate::settings::MIN_SPIN_RAD;

/// The calibration of every trial; `None` where it is to be calibrated by itself.
pub(super) fn calibrations(
    outliers: &MedianMad,
    replicates: &Replicates,
) -> [Option<Result<Calibration, CalibError>>; LANES] {
    let lanes = InputLanes::of(replicates).map(|input| (Found::of(outliers, &input), input));
    std::array::from_fn(|lane| {
        let (found, input) = lanes.as_ref()?;
        found.is_regular[lane].then(|| found.calibration(outliers, replicates, input, lane))
    })
}

/// What the method looks at.
struct InputLanes<'r, const W: usize> {
    geometry: DriveGeometry,
    mark_sigma_m: f64,
    straights: Vec<RunLanes<'r, W>>,
    spins: Vec<RunLanes<'r, W>>,
}

/// A run as the method sees it.
struct RunLanes<'r, const W: usize> {
    id: &'r str,
    outside_m: Wheels<f64>,
    start: Wheels<&'r ReplicatedReading<W>>,
    end: Wheels<&'r ReplicatedReading<W>>,
    turned_ticks: Wheels<[f64; W]>,
    rad_per_tick: f64,
}

impl<'r, const W: usize> InputLanes<'r, W> {
    /// `None` where every trial is to be looked at by itself.
    fn of(replicates: &'r Replicates<W>) -> Option<Self> {
        let geometry = replicates.robot.geometry().ok()?;
        let outermost = outermost(&replicates.points)?;
        let body = outermost.map(|(_, body)| body);
        check_marks(body).ok()?;
        let outside_m = outside_m(body, 0.5 * geometry.wheel_separation_m());
        let rad_per_tick = std::f64::consts::TAU / replicates.robot.ticks_per_rev?;
        let measured = |run: &'r ReplicatedRun<W>| {
            let reading = |side: Side| {
                let mut readings = run.point_readings.iter().filter(move |reading| reading.point == outermost[side].0);
                let first = readings.next()?;
                Some((first, readings.next_back().unwrap_or(first)))
            };
            let (left, right) = (reading(Side::Left)?, reading(Side::Right)?);
            let (start, end) = (Wheels { left: left.0, right: right.0 }, Wheels { left: left.1, right: right.1 });
            let turned_ticks = run.turned_ticks()?;
            Some(RunLanes { id: &run.info.id, outside_m, start, end, turned_ticks, rad_per_tick })
        };
        let of = |protocol| {
            let runs = replicates.runs.iter().filter(move |run| run.info.protocol == Some(protocol));
            runs.filter_map(measured).collect::<Vec<_>>()
        };
        let (straights, spins) = (of(Protocol::Straight), of(Protocol::Spin));
        let mark_sigma_m = replicates.truth_noise.sigma_xy_m.unwrap_or(0.0);
        (!straights.is_empty() && !spins.is_empty()).then_some(Self { geometry, mark_sigma_m, straights, spins })
    }
}

impl<const W: usize> RunLanes<'_, W> {
    #[inline(always)]
    fn wheel_rad(&self, lane: usize) -> Wheels<f64> {
        Wheels {
            left: self.turned_ticks.left[lane] * self.rad_per_tick,
            right: self.turned_ticks.right[lane] * self.rad_per_tick,
        }
    }

    #[inline(always)]
    fn marks(&self, lane: usize) -> Marks {
        let room = |marks: &Wheels<&ReplicatedReading<W>>| -> Wheels<Point> {
            Wheels { left: marks.left.room(lane), right: marks.right.room(lane) }
        };
        Marks { start: room(&self.start), end: room(&self.end), outside_m: self.outside_m }
    }
}

/// The metres per radian of each wheel on a straight, and their standard deviations by statement.
struct Straight<'r, const W: usize> {
    run: &'r RunLanes<'r, W>,
    chord_sigma_m: f64,
}

impl<const W: usize> Formula<4> for Straight<'_, W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 4] {
        let wheel_rad = self.run.wheel_rad(lane);
        let Wheels { left, right } = self.run.marks(lane).m_per_rad(elementary, wheel_rad);
        [left, right, self.chord_sigma_m / wheel_rad.left.abs(), self.chord_sigma_m / wheel_rad.right.abs()]
    }
}

/// The wheelbase of a spin, its slopes, its standard deviation by statement, and the turn.
struct SpinLanes<'r, const W: usize> {
    run: &'r RunLanes<'r, W>,
    geometry: &'r DriveGeometry,
    m_per_rad: &'r Wheels<[f64; W]>,
    mark_sigma_m: f64,
}

impl<const W: usize> Formula<5> for SpinLanes<'_, W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 5] {
        let m_per_rad = Wheels { left: self.m_per_rad.left[lane], right: self.m_per_rad.right[lane] };
        let marks = self.run.marks(lane);
        let Spin { turn_rad, wheel_separation_m, slope } =
            marks.spin(elementary, self.geometry, self.run.wheel_rad(lane), m_per_rad);
        let stated_sigma_m = marks.stated_sigma_m(wheel_separation_m / turn_rad, self.mark_sigma_m);
        [wheel_separation_m, slope.left, slope.right, stated_sigma_m, turn_rad]
    }
}

/// Values of all runs by lanes, one after the other, and the largest standard deviation stated of one.
struct ColumnLanes<const W: usize> {
    values: Vec<[f64; W]>,
    stated_sigma: [f64; W],
}

impl<const W: usize> ColumnLanes<W> {
    #[inline(always)]
    fn with_capacity(runs: usize) -> Self {
        Self { values: Vec::with_capacity(runs), stated_sigma: [0.0; W] }
    }

    #[inline(always)]
    fn push(&mut self, values: [f64; W], stated_sigma: [f64; W]) {
        self.values.push(values);
        #[allow(clippy::needless_range_loop)] // arrays side by side
        for lane in 0..W {
            self.stated_sigma[lane] = self.stated_sigma[lane].max(stated_sigma[lane]);
        }
    }

    /// Makes irregular the trials of which a value is no finite number.
    #[inline(always)]
    fn check(&self, is_regular: &mut [bool; W]) {
        let mut product = [0.0; W];
        for values in &self.values {
            for lane in 0..W {
                product[lane] += 0.0 * values[lane];
            }
        }
        for lane in 0..W {
            is_regular[lane] &= product[lane] == 0.0;
        }
    }
}

/// What a quantity's values come to: their summary, and the outliers by lane and run.
struct Retained<const W: usize> {
    summary: SummaryLanes<W>,
    outliers: Vec<(usize, usize)>,
}

impl<const W: usize> Retained<W> {
    #[inline(always)]
    fn of(retained: &RetainedLanes<'_, W>) -> Self {
        let mut outliers = Vec::new();
        for lane in 0..W {
            outliers.extend(retained.outliers(lane).map(|run| (lane, run)));
        }
        Self { summary: retained.summary(), outliers }
    }
}

/// What the trials' runs come to.
struct Found<const W: usize> {
    left: Retained<W>,
    right: Retained<W>,
    base: Retained<W>,
    slope: Wheels<[f64; W]>,
    is_regular: [bool; W],
}

impl<const W: usize> Found<W> {
    fn of(outliers: &MedianMad, input: &InputLanes<'_, W>) -> Self {
        InstructionSet::widest().run(Estimate { outliers, input })
    }

    fn calibration(
        &self,
        outliers: &MedianMad,
        replicates: &Replicates<W>,
        input: &InputLanes<'_, W>,
        lane: usize,
    ) -> Result<Calibration, CalibError> {
        let mut runs_rejected = Vec::new();
        for (retained, runs, of) in [
            (&self.left, &input.straights, Side::Left.name()),
            (&self.right, &input.straights, Side::Right.name()),
            (&self.base, &input.spins, WHEELBASE),
        ] {
            let of_lane = retained.outliers.iter().filter(|(of_lane, _)| *of_lane == lane);
            runs_rejected.extend(of_lane.map(|(_, run)| outlier(outliers, runs[*run].id, of)));
        }
        let m_per_rad = Wheels { left: self.left.summary.of(lane), right: self.right.summary.of(lane) };
        let slope = Wheels { left: self.slope.left[lane], right: self.slope.right[lane] };
        let runs_used = input.straights.len() + input.spins.len();
        let found = calibration(&replicates.robot, m_per_rad, self.base.summary.of(lane), slope)?;
        Ok(Calibration { runs_used, runs_rejected, ..found })
    }
}

/// The work on all lanes.
struct Estimate<'i, 'r, const W: usize> {
    outliers: &'i MedianMad,
    input: &'i InputLanes<'r, W>,
}

impl<const W: usize> Kernel for Estimate<'_, '_, W> {
    type Output = Found<W>;

    #[inline(always)]
    fn call(self) -> Found<W> {
        let InputLanes { geometry, mark_sigma_m, straights, spins } = self.input;
        let outliers = self.outliers;
        let mut is_regular = [true; W];
        // Both ends of a chord are read.
        let chord_sigma_m = 2_f64.sqrt() * mark_sigma_m;
        let mut left = ColumnLanes::with_capacity(straights.len());
        let mut right = ColumnLanes::with_capacity(straights.len());
        for run in straights {
            let [left_m, right_m, left_sigma_m, right_sigma_m] = by_lanes(&Straight { run, chord_sigma_m });
            left.push(left_m, left_sigma_m);
            right.push(right_m, right_sigma_m);
        }
        left.check(&mut is_regular);
        right.check(&mut is_regular);
        let left = Retained::of(&RetainedLanes::of(&left.values, outliers, &left.stated_sigma));
        let right = Retained::of(&RetainedLanes::of(&right.values, outliers, &right.stated_sigma));

        let m_per_rad = Wheels { left: left.summary.mean, right: right.summary.mean };
        let mut base = ColumnLanes::with_capacity(spins.len());
        let mut slopes = Wheels { left: Vec::with_capacity(spins.len()), right: Vec::with_capacity(spins.len()) };
        for run in spins {
            let spin = SpinLanes { run, geometry, m_per_rad: &m_per_rad, mark_sigma_m: *mark_sigma_m };
            let [base_m, slope_left, slope_right, sigma_m, turn_rad] = by_lanes(&spin);
            base.push(base_m, sigma_m);
            slopes.left.push(slope_left);
            slopes.right.push(slope_right);
            for lane in 0..W {
                is_regular[lane] &= turn_rad[lane].abs() > MIN_SPIN_RAD;
            }
        }
        base.check(&mut is_regular);
        let retained = RetainedLanes::of(&base.values, outliers, &base.stated_sigma);
        let slope = Wheels { left: retained.mean(&slopes.left), right: retained.mean(&slopes.right) };
        Found { left, right, base: Retained::of(&retained), slope, is_regular }
    }
}
