//! The bound by brute force: every raw reading of one run in one vector, its covariance from each source of
//! noise by finite differences, the start pose eliminated at the end. What is driven and when it is seen is
//! taken from a simulated run, nothing from the bound's own code.

use dataset::{Run, WheelLog};
use kinematics::{BridgeCovariance, DriveGeometry, Increment, Point, Pose, Side, Wheels};
use motion_programs::{Motion, Platform};
use nalgebra::{DMatrix, Matrix3, Matrix6};
use scenario::{Instrument, Scenario};
use sim_yair::SimulatedRobot;

use super::program;

/// A batch with a mistake in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrong {
    /// None.
    Nothing,
    /// The wheels' noise summed over each piece, and no scatter inside of it.
    NoScatterWithin,
    /// The counts' roundings of two rows independent.
    IndependentRounding,
}

/// Left diameter, right diameter, separation; start pose x, y, θ.
type Unknowns = [f64; 6];

/// Where a random number enters.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Source {
    Walk { piece: usize, side: Side },
    Along { piece: usize },
    Across { piece: usize },
    Sensitivity { motion: usize, side: Side },
    Patch { motion: usize },
    Rounding { row: usize, side: Side },
}

/// A stretch of a motion between two instants that matter.
#[derive(Debug, Clone, Copy)]
struct Piece {
    /// The motion, from row `motion` to row `motion + 1`.
    motion: usize,
    share: f64,
    /// What measures at its end.
    measurements: (usize, usize),
}

/// What a simulated run tells of when and how much.
struct Script<'a> {
    scenario: &'a Scenario,
    /// Controller counts at every standing row.
    rows: Vec<Wheels<f64>>,
    /// Captures and grid readings at the start.
    first_measurements: (usize, usize),
    pieces: Vec<Piece>,
    counts_per_tick: f64,
    separation_sigma_m: f64,
}

impl<'a> Script<'a> {
    fn of(scenario: &'a Scenario, motions: &[Motion]) -> Self {
        let mut silent = scenario.clone();
        silent.noise.wheel_sigma_m_per_sqrt_m = 0.0;
        silent.noise.sensitivity_sigma = 0.0;
        silent.effects.retain(|effect| effect.id() != "quantization");
        let mut run = Run::default();
        let mut robot = SimulatedRobot::new(&silent, 1, 0).expect("simulates");
        robot.drive_into(&program(motions), &mut run).expect("drives");
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { unreachable!("the simulated robot counts") };
        let rows = ticks
            .left
            .iter()
            .zip(&ticks.right)
            .map(|(&left, &right)| Wheels { left: left as f64, right: right as f64 });

        // At one instant all marks are read: count the first one's readings.
        let measurements_at = |t_s: f64| {
            let same = |other_s: f64| (other_s - t_s).abs() < 1e-9;
            (
                run.truth.iter().filter(|sample| same(sample.t_s)).count(),
                run.point_readings.iter().filter(|reading| reading.point == 0 && same(reading.t_s)).count(),
            )
        };
        let mut instants: Vec<f64> =
            run.odometry.t_s.iter().copied().chain(run.truth.iter().map(|sample| sample.t_s)).collect();
        instants.sort_by(f64::total_cmp);
        instants.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        let rows_s = &run.odometry.t_s;
        let pieces = instants
            .windows(2)
            .map(|ends| {
                let middle_s = 0.5 * (ends[0] + ends[1]);
                let motion = rows_s.partition_point(|row_s| *row_s < middle_s) - 1;
                let share = (ends[1] - ends[0]) / (rows_s[motion + 1] - rows_s[motion]);
                Piece { motion, share, measurements: measurements_at(ends[1]) }
            })
            .collect();
        let counts_per_tick =
            |effect: &effects::Effect| effect.physical().forward().and_then(|forward| forward.counts_per_tick());
        let separation_sigma_m = |effect: &effects::Effect| match effect {
            effects::Effect::ContactPatchWheelbase(patch) => Some(patch.sigma_m),
            _ => None,
        };
        Self {
            scenario,
            rows: rows.collect(),
            first_measurements: measurements_at(0.0),
            pieces,
            counts_per_tick: scenario.effects.iter().find_map(counts_per_tick).map_or(1.0, f64::from),
            separation_sigma_m: scenario.effects.iter().find_map(separation_sigma_m).unwrap_or(0.0),
        }
    }

    fn truth(&self) -> Unknowns {
        let geometry = self.scenario.true_geometry().expect("a drive");
        let diameter_m = geometry.wheel_diameter_m();
        [diameter_m.left, diameter_m.right, geometry.wheel_separation_m(), 0.0, 0.0, 0.0]
    }

    fn travel_m(&self, unknowns: &Unknowns, piece: &Piece) -> Wheels<f64> {
        let geometry =
            DriveGeometry::new(Wheels { left: unknowns[0], right: unknowns[1] }, unknowns[2]).expect("a drive");
        let m_per_count = geometry.m_per_count(self.scenario.robot.encoder.counts_per_wheel_turn()).expect("counts");
        let counts = self.rows[piece.motion + 1].zip_with(self.rows[piece.motion], |after, before| after - before);
        counts.zip_with(m_per_count, |counts, m| counts * m * piece.share)
    }

    /// Every reading in order, and the pose at the end, with one source of noise at a value.
    fn readings(&self, unknowns: &Unknowns, noise: Option<(Source, f64)>) -> (Vec<f64>, Pose) {
        let of = |source: Source| noise.filter(|(other, _)| *other == source).map_or(0.0, |(_, value)| value);
        let geometry =
            DriveGeometry::new(Wheels { left: unknowns[0], right: unknowns[1] }, unknowns[2]).expect("a drive");
        let m_per_tick = geometry
            .m_per_count(self.scenario.robot.encoder.counts_per_wheel_turn() / self.counts_per_tick)
            .expect("ticks");
        let mut pose = Pose::new(unknowns[3], unknowns[4], unknowns[5]);
        let mut readings = Vec::new();
        self.measurement(pose, self.first_measurements, &mut readings);
        for (index, piece) in self.pieces.iter().enumerate() {
            let motion = piece.motion;
            let counted_m = self.travel_m(unknowns, piece);
            let travel_m = Wheels::from_sides(|side| {
                let rounding =
                    of(Source::Rounding { row: motion + 1, side }) - of(Source::Rounding { row: motion, side });
                counted_m[side] * (1.0 + of(Source::Sensitivity { motion, side }))
                    + piece.share * m_per_tick[side] * rounding
                    + of(Source::Walk { piece: index, side })
            });
            let increment = Increment::from_travel(travel_m, unknowns[2] + of(Source::Patch { motion }));
            let chord = Pose::new(0.0, 0.0, 0.5 * increment.turn_rad);
            let off = chord * Point::new(of(Source::Along { piece: index }), of(Source::Across { piece: index }));
            let mut arc = increment.arc();
            (arc.x_m, arc.y_m) = (arc.x_m + off.x_m, arc.y_m + off.y_m);
            pose = pose * arc;
            self.measurement(pose, piece.measurements, &mut readings);
        }
        (readings, pose)
    }

    fn measurement(&self, pose: Pose, (captures, grids): (usize, usize), readings: &mut Vec<f64>) {
        for instrument in &self.scenario.instruments {
            match *instrument {
                Instrument::MotionCapture { lever_x_m, lever_y_m, lever_theta_rad, .. } if captures > 0 => {
                    let marker = pose * Pose::new(lever_x_m, lever_y_m, lever_theta_rad);
                    readings.extend([marker.x_m, marker.y_m, marker.theta_rad]);
                }
                Instrument::FloorGrid { .. } if grids > 0 => {
                    for mark in self.scenario.robot.marked_points() {
                        let room = pose * mark.body;
                        readings.extend([room.x_m, room.y_m]);
                    }
                }
                _ => {}
            }
        }
    }

    /// Variance of every reading, in the order of its measurement.
    fn reading_var(&self) -> Vec<f64> {
        let measurements =
            std::iter::once(self.first_measurements).chain(self.pieces.iter().map(|piece| piece.measurements));
        let of = |(captures, grids): (usize, usize)| {
            self.scenario.instruments.iter().flat_map(move |instrument| match *instrument {
                Instrument::MotionCapture { sigma_xy_m, sigma_theta_rad, .. } if captures > 0 => {
                    vec![sigma_xy_m * sigma_xy_m, sigma_xy_m * sigma_xy_m, sigma_theta_rad * sigma_theta_rad]
                }
                Instrument::FloorGrid { resolution_m, reading_sigma_m } if grids > 0 => {
                    let var_m2 = reading_sigma_m * reading_sigma_m + resolution_m * resolution_m / 12.0;
                    vec![var_m2; 2 * self.scenario.robot.points.len()]
                }
                _ => Vec::new(),
            })
        };
        measurements.flat_map(of).collect()
    }

    /// Every source of noise with its variance; a rounding's own is a twelfth.
    fn sources(&self, unknowns: &Unknowns, wrong: Wrong) -> Vec<(Source, f64)> {
        let mut sources = Vec::new();
        let k = self.scenario.noise.wheel_sigma_m_per_sqrt_m;
        for (piece, of) in self.pieces.iter().enumerate() {
            let travel_m = self.travel_m(unknowns, of);
            let var_m2 = travel_m.map(|travel_m| k * k * travel_m.abs());
            let scatter = BridgeCovariance::within(travel_m, var_m2, unknowns[2]);
            sources.extend(Side::BOTH.map(|side| (Source::Walk { piece, side }, var_m2[side])));
            if wrong != Wrong::NoScatterWithin {
                sources.push((Source::Along { piece }, scatter.along_var_m2));
                sources.push((Source::Across { piece }, scatter.across_var_m2));
            }
        }
        let sensitivity_var = self.scenario.noise.sensitivity_sigma.powi(2);
        for motion in 0..self.rows.len() - 1 {
            sources.extend(Side::BOTH.map(|side| (Source::Sensitivity { motion, side }, sensitivity_var)));
            sources.push((Source::Patch { motion }, self.separation_sigma_m.powi(2)));
        }
        for row in 0..self.rows.len() {
            sources.extend(Side::BOTH.map(|side| (Source::Rounding { row, side }, 1.0 / 12.0)));
        }
        sources
    }

    fn source_covariance(&self, a: (Source, f64), b: (Source, f64), wrong: Wrong) -> f64 {
        match (a.0, b.0) {
            _ if a.0 == b.0 => a.1,
            (Source::Rounding { row: i, side }, Source::Rounding { row: j, side: other })
                if side == other && wrong != Wrong::IndependentRounding =>
            {
                let ticks = (self.rows[j][side] - self.rows[i][side]) / self.counts_per_tick;
                let fraction = ticks - ticks.floor();
                1.0 / 12.0 - 0.5 * fraction * (1.0 - fraction)
            }
            _ => 0.0,
        }
    }

    /// Covariance of what the slopes of some quantities make of all sources.
    fn covariance(
        &self,
        unknowns: &Unknowns,
        wrong: Wrong,
        of: impl Fn(Option<(Source, f64)>) -> Vec<f64>,
    ) -> DMatrix<f64> {
        let sources = self.sources(unknowns, wrong);
        let columns: Vec<Vec<f64>> = sources.iter().map(|(source, _)| slope(|h| of(Some((*source, h))))).collect();
        let slopes = DMatrix::from_fn(columns[0].len(), sources.len(), |row, column| columns[column][row]);
        let between = DMatrix::from_fn(sources.len(), sources.len(), |i, j| {
            self.source_covariance(sources[i], sources[j], wrong)
        });
        &slopes * between * slopes.transpose()
    }

    fn reading_covariance(&self, unknowns: &Unknowns, wrong: Wrong) -> DMatrix<f64> {
        let reading_var = self.reading_var();
        let own = DMatrix::from_diagonal(&reading_var.into());
        own + self.covariance(unknowns, wrong, |noise| self.readings(unknowns, noise).0)
    }

    fn reading_slopes(&self) -> DMatrix<f64> {
        let columns: Vec<Vec<f64>> = (0..6)
            .map(|unknown| {
                slope(|h| {
                    let mut unknowns = self.truth();
                    unknowns[unknown] += h;
                    self.readings(&unknowns, None).0
                })
            })
            .collect();
        DMatrix::from_fn(columns[0].len(), 6, |row, column| columns[column][row])
    }
}

/// Central difference of every entry.
fn slope(of: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let h = 1e-6;
    of(h).into_iter().zip(of(-h)).map(|(plus, minus)| (plus - minus) / (2.0 * h)).collect()
}

/// All readings of one run at once.
pub(crate) struct Batch {
    slopes: DMatrix<f64>,
    covariance: DMatrix<f64>,
    end_covariance: Matrix3<f64>,
}

impl Batch {
    pub(crate) fn of(scenario: &Scenario, motions: &[Motion], wrong: Wrong) -> Self {
        let script = Script::of(scenario, motions);
        let truth = script.truth();
        let end = script.covariance(&truth, wrong, |noise| {
            let pose = script.readings(&truth, noise).1;
            vec![pose.x_m, pose.y_m, pose.theta_rad]
        });
        Self {
            slopes: script.reading_slopes(),
            covariance: script.reading_covariance(&truth, wrong),
            end_covariance: Matrix3::from_fn(|i, j| end[(i, j)]),
        }
    }

    /// Covariance of the end pose by the robot's own noise and rounding, the instrument's left out.
    pub(crate) const fn end_covariance(&self) -> &Matrix3<f64> {
        &self.end_covariance
    }

    /// XᵀΣ⁻¹X with the start pose eliminated.
    pub(crate) fn information(&self) -> Matrix3<f64> {
        let cholesky = self.covariance.clone().cholesky().expect("every reading has an error");
        let full = self.slopes.transpose() * cholesky.solve(&self.slopes);
        let full = Matrix6::from_fn(|i, j| full[(i, j)]);
        let (geometry, cross, start) =
            (full.fixed_view::<3, 3>(0, 0), full.fixed_view::<3, 3>(0, 3), full.fixed_view::<3, 3>(3, 3));
        geometry - cross * start.try_inverse().expect("the start is seen") * cross.transpose()
    }
}
