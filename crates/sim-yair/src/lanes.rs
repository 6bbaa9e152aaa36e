//! Trials driven side by side: the closed form's records of [`crate::precomputed_run`] for W trials at once,
//! to the bit, by loops over lanes that become vectors.
//!
//! All trials of a precomputed run turn the shafts alike, so that only what is drawn and where the robot is
//! differs from lane to lane. That holds where sensitivities do not scatter, every effect says what it does
//! in lanes, and floor grids are all that measures; elsewhere trials are driven one by one.

use dataset::{ReplicatedReading, ReplicatedRun, Replicates, RunInfo};
use effects::{Address, LaneForm, NormalTable, StreamLanes, StreamName, StreamsLanes};
use kinematics::{
    BridgeCovariance, Elementary, Formula, Frame, Increment, InstructionSet, Kernel, Point, Pose, Wheels, by_lanes,
};
use scenario::Placement;

use crate::actuator::ConstantSpeed;
use crate::body::{DriveSetup, PLACEMENT, WHEEL_NOISE, WHEEL_PHASE, with_noise_m, within_arc_m};
use crate::instrument::FloorGrid;
use crate::precomputed_run::PrecomputedRun;

/// A robot and its programs, ready for trials side by side.
#[derive(Debug, Clone)]
pub struct LaneDrive {
    pub(crate) setup: DriveSetup,
    pub(crate) placement: Placement,
    pub(crate) counts_per_turn: f64,
    pub(crate) effects: Vec<(StreamName, LaneForm)>,
    pub(crate) grids: Vec<(StreamName, FloorGrid)>,
    pub(crate) runs: Vec<(RunInfo, PrecomputedRun)>,
    pub(crate) address: Address,
}

impl LaneDrive {
    /// Room for the records of W trials, everything that they have in common in place. `records` has the
    /// robot's nominal values.
    #[must_use]
    pub fn replicates<const W: usize>(&self, records: &dataset::Dataset) -> Replicates<W> {
        let runs = self.runs.iter().map(|(info, plan)| {
            let (mut t_s, mut point_readings) = (Vec::new(), Vec::new());
            for (interval, &row_s) in plan.intervals.iter().zip(&plan.rows_s) {
                t_s.push(row_s);
                for _ in self.grids.iter().filter(|_| interval.is_read) {
                    let reading = |point| ReplicatedReading { t_s: row_s, point, x_m: [0.0; W], y_m: [0.0; W] };
                    point_readings.extend((0..self.setup.points.len()).map(reading));
                }
            }
            let ticks = vec![Wheels::both([0.0; W]); t_s.len()];
            ReplicatedRun { info: info.clone(), t_s, ticks, point_readings }
        });
        Replicates {
            robot: records.robot,
            truth_noise: records.truth_noise,
            points: records.points.clone(),
            runs: runs.collect(),
        }
    }

    /// Drives trial `first` and those that follow it, into what [`Self::replicates`] made. Not generic: the
    /// loops are compiled in this crate, where they are optimised.
    pub fn drive_into(&self, first: u64, replicates: &mut Replicates) {
        self.drive_into_by(InstructionSet::widest(), first, replicates);
    }

    /// [`Self::drive_into`] by a given instruction set, for any number of lanes: the same bits.
    fn drive_into_by<const W: usize>(&self, set: InstructionSet, first: u64, replicates: &mut Replicates<W>) {
        set.run(DriveRuns { drive: self, first, runs: &mut replicates.runs });
    }
}

/// All runs of all lanes.
struct DriveRuns<'d, const W: usize> {
    drive: &'d LaneDrive,
    first: u64,
    runs: &'d mut [ReplicatedRun<W>],
}

impl<const W: usize> Kernel for DriveRuns<'_, W> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let table = NormalTable::load();
        let Self { drive, first, runs } = self;
        for (number, ((_, plan), run)) in (0..).zip(drive.runs.iter().zip(runs)) {
            let address = Address { trial: first, run: number, ..drive.address };
            DriveRun { drive, plan, address, run }.go(&table);
        }
    }
}

/// One run of all lanes.
struct DriveRun<'d, const W: usize> {
    drive: &'d LaneDrive,
    plan: &'d PrecomputedRun,
    address: Address,
    run: &'d mut ReplicatedRun<W>,
}

/// What varies the wheel separation from motion to motion, and by how much it does now, metres.
struct SeparationLanes<const W: usize> {
    stream: StreamLanes<W>,
    sigma_m: f64,
    now_m: [f64; W],
}

impl<const W: usize> DriveRun<'_, W> {
    #[inline(always)]
    fn go(self, table: &NormalTable) {
        let Self { drive: LaneDrive { setup, placement, counts_per_turn, .. }, plan, address, run } = self;
        let streams = StreamsLanes::<W>::of(&address);
        let mut separations = self.drive.separations(&streams, table);
        let mut grids = Vec::with_capacity(self.drive.grids.len());
        for (name, grid) in &self.drive.grids {
            grids.push((streams.stream(*name), *grid));
        }
        let mut wheel_noise = streams.stream(WHEEL_NOISE);
        let mut placed = streams.stream(PLACEMENT);
        let x_m = placed.uniform_about_zero(placement.half_width_m);
        let y_m = placed.uniform_about_zero(placement.half_width_m);
        let theta_rad = placed.uniform_about_zero(placement.half_width_rad);
        let mut phase = streams.stream(WHEEL_PHASE);
        let mut counts = Wheels { left: phase.uniform(), right: phase.uniform() };
        scale(&mut counts.left, *counts_per_turn);
        scale(&mut counts.right, *counts_per_turn);

        let mut frame = by_lanes(&StartFrame { pose: [x_m, y_m, theta_rad] });
        let mut readings = run.point_readings.iter_mut();
        for (interval, ticks) in plan.intervals.iter().zip(&mut run.ticks) {
            if interval.sets_out {
                for separation in &mut separations {
                    let [mut draws] = separation.stream.normals(table);
                    scale(&mut draws, separation.sigma_m);
                    separation.now_m = draws;
                }
            }
            for &segment in &interval.segments {
                // What a step of one trial does before the floor, which is the same in all.
                let shaft_rad = ConstantSpeed::new(setup.counts_per_rad, Wheels::both(0.0)).whole(segment).shaft_rad;
                let travel_m = setup.true_radius_m.zip_with(shaft_rad, |radius_m, turn_rad| radius_m * turn_rad);
                let travel_var_m2 = setup.noise.travel_var_m2(travel_m);
                let is_noisy = travel_var_m2.left > 0.0 || travel_var_m2.right > 0.0;
                let draws = if is_noisy { wheel_noise.normals(table) } else { [[0.0; W]; 4] };
                let mut separation_m = [setup.wheel_separation_m; W];
                for separation in &separations {
                    #[allow(clippy::needless_range_loop)] // arrays side by side
                    for lane in 0..W {
                        separation_m[lane] += separation.now_m[lane];
                    }
                }
                let step =
                    RolledFrame { frame: &frame, draws: &draws, separation_m: &separation_m, travel_m, travel_var_m2 };
                frame = by_lanes(&step);
                add(&mut counts.left, shaft_rad.left * setup.counts_per_rad);
                add(&mut counts.right, shaft_rad.right * setup.counts_per_rad);
            }
            *ticks = Wheels { left: self.drive.ticks(&counts.left), right: self.drive.ticks(&counts.right) };
            if interval.is_read {
                for (stream, grid) in &mut grids {
                    for (mark, reading) in setup.points.iter().zip(&mut readings) {
                        let draws = stream.normals(table);
                        let mark = MarkReading { frame: &frame, draws: &draws, mark: mark.body, grid: *grid };
                        [reading.x_m, reading.y_m] = by_lanes(&mark);
                    }
                }
            }
        }
    }
}

impl LaneDrive {
    /// The effects on the wheel separation, at a run's start.
    #[inline(always)]
    fn separations<const W: usize>(&self, streams: &StreamsLanes<W>, table: &NormalTable) -> Vec<SeparationLanes<W>> {
        let mut separations = Vec::new();
        for (name, form) in &self.effects {
            if let LaneForm::SeparationPerMotion { sigma_m } = *form {
                let mut stream = streams.stream(*name);
                let _unused: [[f64; W]; 1] = stream.normals(table);
                separations.push(SeparationLanes { stream, sigma_m, now_m: [0.0; W] });
            }
        }
        separations
    }

    /// What the log shows of a counter.
    #[inline(always)]
    fn ticks<const W: usize>(&self, counts: &[f64; W]) -> [f64; W] {
        let [mut ticks] = by_lanes(&WholeCounts { counts });
        for (_, form) in &self.effects {
            if let LaneForm::Ticks { counts } = *form {
                [ticks] = by_lanes(&WholeTicks { counts: &ticks, counts_per_tick: f64::from(counts) });
            }
        }
        ticks
    }
}

#[inline(always)]
fn scale<const W: usize>(numbers: &mut [f64; W], factor: f64) {
    for number in numbers {
        *number *= factor;
    }
}

#[inline(always)]
fn add<const W: usize>(numbers: &mut [f64; W], more: f64) {
    for number in numbers {
        *number += more;
    }
}

/// Where runs begin.
struct StartFrame<const W: usize> {
    /// x, y and heading.
    pose: [[f64; W]; 3],
}

impl<const W: usize> Formula<5> for StartFrame<W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 5] {
        let [x_m, y_m, theta_rad] = &self.pose;
        Frame::by(elementary, Pose::new(x_m[lane], y_m[lane], theta_rad[lane])).numbers()
    }
}

/// Where robots are after a step: what [`crate::body::Body`] does on the floor.
struct RolledFrame<'s, const W: usize> {
    frame: &'s [[f64; W]; 5],
    /// For the left and the right wheel, along the chord and across it.
    draws: &'s [[f64; W]; 4],
    separation_m: &'s [f64; W],
    travel_m: Wheels<f64>,
    travel_var_m2: Wheels<f64>,
}

impl<const W: usize> Formula<5> for RolledFrame<'_, W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 5] {
        let Self { travel_m, travel_var_m2, .. } = *self;
        let (separation_m, [left, right, along, across]) = (self.separation_m[lane], at(self.draws, lane));
        let bridge = BridgeCovariance::within_by(elementary, travel_m, travel_var_m2, separation_m);
        let [along_m, across_m] = within_arc_m(&bridge, [along, across]);
        let travel_m = with_noise_m(travel_m, travel_var_m2, [left, right]);
        let increment = Increment::from_travel(travel_m, separation_m);
        let before_from_after = increment.perturbed_arc_by(elementary, along_m, across_m);
        (Frame::from_numbers(at(self.frame, lane)) * before_from_after).numbers()
    }
}

/// A mark's reading.
struct MarkReading<'s, const W: usize> {
    frame: &'s [[f64; W]; 5],
    draws: &'s [[f64; W]; 2],
    mark: Point,
    grid: FloorGrid,
}

impl<const W: usize> Formula<2> for MarkReading<'_, W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 2] {
        let room = Frame::from_numbers(at(self.frame, lane)) * self.mark;
        self.grid.reading(elementary, room, at(self.draws, lane))
    }
}

/// The whole counts that a counter shows.
struct WholeCounts<'c, const W: usize> {
    counts: &'c [f64; W],
}

impl<const W: usize> Formula<1> for WholeCounts<'_, W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 1] {
        [elementary.floor(self.counts[lane])]
    }
}

/// The whole ticks in whole counts. A quotient of whole numbers under 2⁵⁰ is nearer to the whole number below
/// it than to the next by more than its rounding, so that its floor is that of the division.
struct WholeTicks<'c, const W: usize> {
    counts: &'c [f64; W],
    counts_per_tick: f64,
}

impl<const W: usize> Formula<1> for WholeTicks<'_, W> {
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 1] {
        [elementary.floor(self.counts[lane] / self.counts_per_tick)]
    }
}

/// One lane's numbers.
#[inline(always)]
fn at<const W: usize, const N: usize>(lanes: &[[f64; W]; N], lane: usize) -> [f64; N] {
    let mut numbers = [0.0; N];
    for n in 0..N {
        numbers[n] = lanes[n][lane];
    }
    numbers
}

#[cfg(test)]
mod tests {
    use dataset::{Dataset, Provenance, Run};
    use motion_programs::{Motion, MotionProgram, Platform};
    use scenario::Scenario;

    use super::*;
    use crate::SimulatedRobot;

    fn paper() -> Scenario {
        let mut paper = Scenario::parse(scenario::PAPER, "paper.toml").expect("the shipped scenario");
        paper.placement.half_width_rad = 3.0;
        paper
    }

    /// Programs with every kind of motion, with readings at the ends, in between and nowhere.
    fn programs(scenario: &Scenario) -> Vec<MotionProgram> {
        let mut programs = scenario.programs();
        programs.truncate(2);
        let mut square = scenario.programs().pop().expect("one");
        let arc = Motion::Arc { radius_m: 0.4, turn_rad: -2.0 };
        square.motions.extend([Motion::Measure, arc, Motion::Pause { duration_s: 0.2 }, Motion::Measure]);
        programs.push(square);
        programs.push(MotionProgram { id: "stands".to_owned(), motions: Vec::new(), ..programs[0].clone() });
        programs
    }

    fn one_by_one(scenario: &Scenario, programs: &[MotionProgram], trial: u64) -> Dataset {
        let mut robot = SimulatedRobot::new(scenario, 5, trial).expect("simulates").at_point(2);
        let runs = programs.iter().map(|program| {
            let mut run = Run::default();
            robot.drive_into(program, &mut run).expect("drives");
            run
        });
        let runs = runs.collect();
        Dataset {
            provenance: Provenance::default(),
            robot: robot.robot(),
            truth_noise: robot.truth_noise(),
            points: robot.points().to_vec(),
            runs,
        }
    }

    fn check<const W: usize>(scenario: &Scenario, what: &str) {
        let programs = programs(scenario);
        let robot = SimulatedRobot::new(scenario, 5, 0).expect("simulates").at_point(2);
        let prepared: Vec<_> = programs.iter().map(|program| robot.prepare(program.clone())).collect();
        let drive = robot.lane_drive(&prepared).unwrap_or_else(|| panic!("{what} goes in lanes"));
        for set in InstructionSet::available() {
            // The second block goes over what the first one left.
            let mut replicates: Replicates<W> = drive.replicates(&one_by_one(scenario, &programs, 0));
            for first in [3, 3 + W as u64] {
                drive.drive_into_by(set, first, &mut replicates);
                for lane in 0..W {
                    let expected = one_by_one(scenario, &programs, first + lane as u64);
                    assert_eq!(replicates.dataset(lane), expected, "{what}, lane {lane} of {W}, {}", set.name());
                }
            }
        }
    }

    /// Rejects, as was tried: a heading that is not carried on, the effect's unused draw left out, counts
    /// rounded to the nearest.
    #[test]
    fn trials_side_by_side_record_what_each_records_by_itself() {
        check::<16>(&paper(), "the paper's robot");
        check::<4>(&paper(), "the paper's robot");
        check::<1>(&paper(), "the paper's robot");
        let mut exact = paper();
        exact.noise.wheel_sigma_m_per_sqrt_m = 0.0;
        exact.effects.retain(|effect| effect.id() != "contact_patch_wheelbase" && effect.id() != "quantization");
        if let [scenario::Instrument::FloorGrid { resolution_m, reading_sigma_m }] = &mut exact.instruments[..] {
            (*resolution_m, *reading_sigma_m) = (0.0, 0.0);
        }
        check::<8>(&exact, "a robot without noise");
        let mut twice = paper();
        twice.effects.extend(paper().effects.into_iter().filter(|effect| effect.id() == "contact_patch_wheelbase"));
        twice.effects.extend(paper().effects.into_iter().filter(|effect| effect.id() == "quantization"));
        twice.instruments.extend(paper().instruments);
        check::<8>(&twice, "two of each effect and instrument");
        let mut three = paper();
        let mut ahead = three.robot.points[0].clone();
        (ahead.id, ahead.x_m) = ("ahead".to_owned(), 0.2);
        three.robot.points.push(ahead);
        check::<8>(&three, "three marks");
    }

    #[test]
    fn what_lanes_do_not_know_is_driven_one_by_one() {
        let goes_in_lanes = |scenario: &Scenario| {
            let robot = SimulatedRobot::new(scenario, 5, 0).expect("simulates");
            let prepared: Vec<_> = scenario.programs().into_iter().map(|program| robot.prepare(program)).collect();
            robot.lane_drive(&prepared).is_some()
        };
        assert!(goes_in_lanes(&paper()));
        let mut scattering = paper();
        scattering.noise.sensitivity_sigma = 1e-3;
        let mut logged = paper();
        logged.log = Some(scenario::Log { interval_s: 0.1 });
        let mut taped = paper();
        taped.instruments.push(scenario::Instrument::Tape { sigma_m: 1e-3 });
        let slipping = Scenario::parse(
            &format!("{}\n[[effect]]\nkind = \"slip_speed\"\nslip_s_m = 0.01\n", scenario::PAPER),
            "paper.toml",
        );
        let slipping = slipping.expect("the paper's robot on a floor that slips");
        for (what, scenario) in [("scatter", &scattering), ("rows", &logged), ("tape", &taped), ("slip", &slipping)] {
            assert!(!goes_in_lanes(scenario), "{what}");
        }
    }
}
