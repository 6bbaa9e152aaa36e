//! The filter of one chain: innovations, their derivatives by the mean parameters, and the score of the noise.
//!
//! Scalar updates, one component of a look after the other: along and across the robot, then heading. With gain k = P h/s the sensitivities follow
//! D⁺ = D + k·∂v/∂p, exactly, because the gains do not depend on the mean parameters; those of P by ln(variance) follow the same recursion, differentiated.

use kinematics::{InstructionSet, Kernel, Pose, Twist, sin_cos, wrap_to_pi};
use model_term::ModelTerm;
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use crate::covariances::{Covariance, Covariances};
use crate::derivatives::Derivatives;
use crate::model::{Column, Instrument, Model};
use crate::noise::{Noise, NoiseComponent};
use crate::products::{Products, Sums};
use crate::propagation::{Kept, KeptLegs, Legs, Moved, Propagator, Trail};
use crate::records::{Chain, Start};
use crate::thinning::Leg;
use crate::wheel_angles::Piece;

/// A look whose squared innovation, over its variance, is larger than this lies outside of what chance does: χ² with 3 degrees of freedom at 1 − 1e-5.
pub(crate) const OUTLIER_CHI_SQUARE: f64 = 25.9;
/// After so many looks in a row that do not fit, it is the filter that is wrong: it starts again.
const LOST_AFTER: u32 = 2;
const NOISES: usize = 4;

/// One whitened component of a look's innovation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Which chain.
    pub chain: usize,
    /// Which look of the chain.
    pub look: usize,
    /// 0 along the robot, 1 across, 2 heading.
    pub component: usize,
    /// Over its standard deviation.
    pub z: f64,
    /// That standard deviation: metres, or radians of a heading.
    pub sigma: f64,
}

/// Whether measurements whose innovation is improbable are rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gate {
    /// They are.
    #[default]
    Shut,
    /// Every measurement is taken, however far off.
    Open,
}

impl Gate {
    /// Open for every look.
    pub(crate) const fn of(every_look: bool) -> Self {
        if every_look { Self::Open } else { Self::Shut }
    }
}

/// What to carry along in a pass.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Want<'p> {
    pub(crate) noise_score: bool,
    pub(crate) innovations: bool,
    pub(crate) gate: Gate,
    /// Legs are kept, for passes at models near this one.
    pub(crate) keep: bool,
    /// Legs are taken as they were kept by a pass at another model.
    pub(crate) by: Option<&'p Kept>,
    /// The last columns come in parts of so many, each tested for itself: columns of two parts have no products with each other.
    pub(crate) parts: &'p [usize],
}

/// Score of the cost by the logarithms of the variances, and its information.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NoiseScore {
    pub(crate) gradient: Vector4<f64>,
    pub(crate) information: Matrix4<f64>,
}

impl NoiseScore {
    pub(super) fn zero() -> Self {
        Self { gradient: Vector4::zeros(), information: Matrix4::zeros() }
    }

    pub(super) fn add(&mut self, other: &Self, weight: f64) {
        self.gradient += weight * other.gradient;
        self.information += weight * other.information;
    }
}

/// The filter of one chain.
pub(super) struct Filter<'f, 'a> {
    chain: &'f Chain<'a>,
    number: usize,
    model: &'f Model,
    instrument: Instrument,
    noise: &'f Noise,
    propagator: Propagator<'f, 'a>,
    want: Want<'f>,
    pose: Pose,
    covariance: Covariance,
    /// ∂pose/∂column.
    by: Derivatives,
    /// Derivatives of the covariance and of the pose by the logarithm of each variance.
    covariance_by: Covariances<NOISES>,
    pose_by_noise: [[f64; NOISES]; 3],
    /// Derivatives of the look by the terms' parameters, in the room.
    sights: Derivatives,
    pub(super) sums: Sums<'f>,
    pub(super) innovations: Vec<Innovation>,
    pub(super) outliers: Vec<usize>,
    pub(super) noise_score: NoiseScore,
    /// What a component of a look sees of each column directly, and in all.
    direct: Vec<f64>,
    j: Vec<f64>,
}

/// The filter of a chain over its legs, from a start heading that nobody saw.
struct Run<'r, 'f, 'a> {
    filter: &'r mut Filter<'f, 'a>,
    legs: &'r [Leg],
    free_heading_rad: f64,
}

impl Kernel for Run<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.filter.run_over(self.legs, self.free_heading_rad);
    }
}

impl<'f, 'a> Filter<'f, 'a> {
    pub(super) fn new(
        chain: &'f Chain<'a>,
        number: usize,
        model: &'f Model,
        noise: &'f Noise,
        products: &'f Products,
        terms: &'f mut [Box<dyn ModelTerm>],
        want: Want<'f>,
    ) -> Self {
        let columns = Column::BASE.len() + terms.iter().map(|term| term.parameters().len()).sum::<usize>();
        // One more for a free heading.
        let all = columns + 1;
        Self {
            chain,
            number,
            model,
            instrument: model.instrument(chain.run),
            noise,
            propagator: Propagator::new(chain, model, terms),
            want,
            pose: Pose::IDENTITY,
            covariance: Covariance::ZERO,
            by: Derivatives::zeros(all),
            covariance_by: Covariances::ZERO,
            pose_by_noise: [[0.0; NOISES]; 3],
            sights: Derivatives::zeros(columns - Column::BASE.len()),
            sums: Sums::new(columns, products),
            innovations: Vec::new(),
            outliers: Vec::new(),
            noise_score: NoiseScore::zero(),
            direct: vec![0.0; all],
            j: vec![0.0; all],
        }
    }

    /// Goes on where the chain before ended.
    pub(super) fn go_on(&mut self, trail: Trail) {
        self.propagator.go_on(trail);
    }

    /// Where this chain ended.
    pub(super) fn trail(&self) -> Trail {
        self.propagator.trail(self.pose * self.instrument.body_from_sensor)
    }

    /// Legs come from here, not from the counts.
    pub(super) fn take_legs(&mut self, legs: Legs<'f>) {
        self.propagator.legs = legs;
    }

    /// What the chain said, and its legs where they were to be kept.
    pub(super) fn into_parts(self) -> (Sums<'f>, Vec<usize>, Vec<Innovation>, NoiseScore, Option<KeptLegs>) {
        (self.sums, self.outliers, self.innovations, self.noise_score, self.propagator.legs.into_kept())
    }

    /// Filters the looks at the ends of some legs.
    pub(super) fn run(&mut self, legs: &[Leg], free_heading_rad: f64) {
        // Loops over a dozen columns: eight at a time leave more over than they save.
        InstructionSet::Avx2.run(Run { filter: self, legs, free_heading_rad });
    }

    #[inline(always)]
    fn run_over(&mut self, legs: &[Leg], free_heading_rad: f64) {
        self.propagator.restart();
        let Some(first) = legs.first() else {
            let start_s = self.chain.pieces.first().map_or(0.0, |piece| piece.t_s);
            self.start(Pose::IDENTITY, (0.0, 0.0), self.chain.pieces.first().copied(), (0, start_s));
            let pieces = 0..self.chain.pieces.len();
            self.predict(0, &Leg { pieces, from: 0, look: 0, noise: Covariances::ZERO });
            return;
        };
        match self.chain.start {
            Start::Seen => self.start_at((0, first.from), first.pieces.start, free_heading_rad),
            Start::Origin => {
                let start_s = self.chain.pieces.first().map_or(0.0, |piece| piece.t_s);
                self.start(Pose::IDENTITY, (0.0, 0.0), self.chain.pieces.first().copied(), (0, start_s));
            }
        }
        let mut lost = 0;
        for (number, leg) in legs.iter().enumerate() {
            self.predict(number, leg);
            if self.update(number, leg) {
                lost = 0;
                continue;
            }
            self.outliers.push(leg.look);
            lost += 1;
            // Without a heading the filter cannot start in the middle of a chain.
            if lost >= LOST_AFTER && self.chain.looks[leg.look].theta_rad.is_some() && self.chain.start == Start::Seen {
                self.start_at((number + 1, leg.look), leg.pieces.end, self.pose.theta_rad);
                lost = 0;
            }
        }
    }

    /// Stands where a look saw the robot, after so many legs.
    #[inline(always)]
    fn start_at(&mut self, (legs, look): (usize, usize), next_piece: usize, free_heading_rad: f64) {
        let seen = self.chain.looks[look];
        let [_, _, xy, theta] = self.noise.variance;
        let pose = Pose::new(seen.x_m, seen.y_m, seen.theta_rad.unwrap_or(free_heading_rad));
        let free = seen.theta_rad.is_none();
        let piece = self.chain.pieces.get(next_piece).or(self.chain.pieces.last()).copied();
        self.start(pose, (xy, if free { 0.0 } else { theta }), piece, (legs, seen.t_s));
        if free {
            // The instrument's heading is the parameter, the drive's centre follows it round the instrument.
            self.sums.free = true;
            let last = self.j.len() - 1;
            self.by.set(last, Vector3::new(-(self.pose.y_m - seen.y_m), self.pose.x_m - seen.x_m, 1.0));
        }
    }

    #[inline(always)]
    fn start(&mut self, seen: Pose, (var_xy, var_theta): (f64, f64), next: Option<Piece>, (legs, t_s): (usize, f64)) {
        let twist = next.map_or(Twist { v_m_s: 0.0, omega_rad_s: 0.0 }, |piece| self.propagator.twist(&piece));
        let Instrument { body_from_sensor: Pose { x_m: lx, y_m: ly, theta_rad: ltheta }, latency_s: late } =
            self.instrument;
        let theta_rad = seen.theta_rad - ltheta;
        let (sin, cos) = sin_cos(theta_rad);
        let mounted = Vector3::new(cos * lx - sin * ly, sin * lx + cos * ly, 0.0);
        let moved = Vector3::new(cos * twist.v_m_s, sin * twist.v_m_s, twist.omega_rad_s);
        self.pose = Pose::new(
            seen.x_m - mounted.x + late * moved.x,
            seen.y_m - mounted.y + late * moved.y,
            theta_rad + late * moved.z,
        );
        self.by.clear();
        self.by.set(Column::MountX.index(), Vector3::new(-cos, -sin, 0.0));
        self.by.set(Column::MountY.index(), Vector3::new(sin, -cos, 0.0));
        self.by.set(Column::MountTheta.index(), Vector3::new(-mounted.y, mounted.x, -1.0));
        self.by.set(Column::Latency.index(), moved);
        self.sight(legs, t_s, twist);
        for (number, size) in self.model.sizes.iter().enumerate() {
            let sight = self.sights.get(number);
            self.by.set(Column::Term(number).index(), -sight);
            self.pose = Pose::new(
                self.pose.x_m - size * sight.x,
                self.pose.y_m - size * sight.y,
                self.pose.theta_rad - size * sight.z,
            );
        }
        // The instrument's heading error moves the drive's centre round the instrument.
        let lever = Vector3::new(-(self.pose.y_m - seen.y_m), self.pose.x_m - seen.x_m, 1.0);
        let position = Matrix3::from_diagonal(&Vector3::new(var_xy, var_xy, 0.0));
        let heading = lever * lever.transpose() * var_theta;
        self.covariance = Covariance::of([&(position + heading)]);
        self.covariance_by = Covariances::of([&Matrix3::zeros(), &Matrix3::zeros(), &position, &heading]);
        self.pose_by_noise = [[0.0; NOISES]; 3];
    }

    /// Finds what the terms add to the look after so many legs at the pose in force, in the room, for each parameter.
    #[inline(always)]
    fn sight(&mut self, legs: usize, t_s: f64, twist: Twist) {
        self.propagator.sight(self.pose, legs, t_s, twist);
        let (sin, cos) = sin_cos(self.pose.theta_rad);
        let sights = self.sights.x.iter_mut().zip(&mut self.sights.y).zip(&mut self.sights.theta);
        for (((x, y), theta), gradient) in sights.zip(&self.propagator.gradients) {
            *x = cos * gradient.x_m - sin * gradient.y_m;
            *y = sin * gradient.x_m + cos * gradient.y_m;
            *theta = gradient.theta_rad;
        }
    }

    #[inline(always)]
    fn predict(&mut self, number: usize, leg: &Leg) {
        let Moved { motion, by_lengths } = self.propagator.moved(self.pose, number, leg);
        let (sin, cos) = sin_cos(self.pose.theta_rad);
        let room = |v: Vector3<f64>| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
        let step = room(Vector3::new(motion.x_m, motion.y_m, motion.theta_rad));
        self.by.turn(step);
        for (column, of_leg) in by_lengths.into_iter().enumerate() {
            self.by.set(column, self.by.get(column) + room(of_leg));
        }
        self.by.add_turned(Column::BASE.len(), (sin, cos), &self.propagator.leg_by_terms);
        self.pose = Pose::new(self.pose.x_m + step.x, self.pose.y_m + step.y, self.pose.theta_rad + step.z);
        let noise = leg.noise.turned((sin, cos)).times([
            self.noise.variance[NoiseComponent::Wheel as usize],
            self.noise.variance[NoiseComponent::Turn as usize],
        ]);
        self.covariance.carry(-step.y, step.x);
        self.covariance.add(0, &noise, 0);
        self.covariance.add(0, &noise, 1);
        if self.want.noise_score {
            self.covariance_by.carry(-step.y, step.x);
            self.covariance_by.add(NoiseComponent::Wheel as usize, &noise, 0);
            self.covariance_by.add(NoiseComponent::Turn as usize, &noise, 1);
            let [x, y, theta] = &mut self.pose_by_noise;
            for a in 0..NOISES {
                x[a] -= step.y * theta[a];
                y[a] += step.x * theta[a];
            }
        }
    }

    /// Takes a look; false, and nothing changes, when it lies too far off.
    #[inline(always)]
    fn update(&mut self, number: usize, leg: &Leg) -> bool {
        let seen = self.chain.looks[leg.look];
        let Some(piece) = self.chain.pieces[leg.pieces.clone()].last().copied() else { return true };
        let twist = self.propagator.twist(&piece);
        self.sight(number + 1, seen.t_s, twist);
        let Instrument { body_from_sensor: Pose { x_m: lx, y_m: ly, theta_rad: ltheta }, latency_s: late } =
            self.instrument;
        let (sin, cos) = sin_cos(self.pose.theta_rad);
        let mounted = Vector3::new(cos * lx - sin * ly, sin * lx + cos * ly, 0.0);
        // A look is late by the way that the instrument made in the meantime.
        let moved = Vector3::new(
            cos * twist.v_m_s - twist.omega_rad_s * mounted.y,
            sin * twist.v_m_s + twist.omega_rad_s * mounted.x,
            twist.omega_rad_s,
        );
        let mut from_terms = Vector3::zeros();
        for (number, size) in self.model.sizes.iter().enumerate().filter(|(_, size)| **size != 0.0) {
            from_terms += *size * self.sights.get(number);
        }
        let ahead = mounted - late * moved + from_terms;
        let error = Vector3::new(
            seen.x_m - self.pose.x_m - ahead.x,
            seen.y_m - self.pose.y_m - ahead.y,
            seen.theta_rad.map_or(0.0, |theta_rad| wrap_to_pi(theta_rad - self.pose.theta_rad - ltheta - ahead.z)),
        );
        // What a component c of the look sees of the pose, and of the parameters directly: rows along, across, heading.
        let by_heading = Vector3::new(-ahead.y, ahead.x, 1.0);
        let axes = [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z()];
        let rows = axes.map(|axis| Vector3::new(axis.x, axis.y, axis.dot(&by_heading)));
        let components = if seen.theta_rad.is_some() { 3 } else { 2 };
        let r = [self.noise.variance[2], self.noise.variance[2], self.noise.variance[3]];
        let (mut covariance, mut correction, mut distance) = (self.covariance, Vector3::zeros(), 0.0);
        let seen = [0, 1, 2].map(|component| {
            if component >= components {
                return Update { row: Vector3::zeros(), gain: Vector3::zeros(), v: 0.0, s: 1.0 };
            }
            let row = rows[component];
            let v = axes[component].dot(&error) - row.dot(&correction);
            let ph = Vector3::from(covariance.along(&row).map(|[along]| along));
            let s = row.dot(&ph) + r[component];
            let gain = ph * (1.0 / s);
            distance += v * v / s;
            correction += gain * v;
            covariance.lower(&gain, &ph);
            Update { row, gain, v, s }
        });
        if self.want.gate == Gate::Shut && distance > OUTLIER_CHI_SQUARE {
            return false;
        }
        self.covariance = covariance;
        // The lengths, and a free heading, the last column, are seen in the pose alone.
        let mounted_by = [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z(), -moved];
        for (component, update) in seen.iter().enumerate().take(components) {
            let axis = axes[component];
            let Update { row, gain, v, s } = *update;
            if self.want.noise_score {
                self.score_noise(component, update, r[component]);
            }
            for (direct, by) in self.direct[Column::MountX.index()..].iter_mut().zip(&mounted_by) {
                *direct = axis.dot(by);
            }
            for (direct, sight) in self.direct[Column::BASE.len()..].iter_mut().zip(self.sights.along(axis)) {
                *direct = sight;
            }
            for ((j, by), direct) in self.j.iter_mut().zip(self.by.along(row)).zip(&self.direct) {
                *j = -by - direct;
            }
            self.sums.add(&self.j, v, s);
            if self.want.innovations {
                let sigma = s.sqrt();
                self.innovations.push(Innovation {
                    chain: self.number,
                    look: leg.look,
                    component,
                    z: v / sigma,
                    sigma,
                });
            }
            self.by.add(gain, &self.j);
        }
        self.pose =
            Pose::new(self.pose.x_m + correction.x, self.pose.y_m + correction.y, self.pose.theta_rad + correction.z);
        true
    }

    /// The filter's recursions, differentiated by the logarithm of each variance; Gupta & Mehra 1974. With the gain k = Ph/s, and ′ for a derivative,
    /// P′ ← P′ − P′h kᵀ − k (P′h)ᵀ + s′ k kᵀ.
    #[inline(always)]
    fn score_noise(&mut self, component: usize, update: &Update, r: f64) {
        let Update { row, gain, v, s } = update;
        let per_s = 1.0 / s;
        let ph_by = self.covariance_by.along(row);
        let [x, y, theta] = &mut self.pose_by_noise;
        let (mut s_by, mut v_by) = ([0.0; NOISES], [0.0; NOISES]);
        for a in 0..NOISES {
            s_by[a] = row.x * ph_by[0][a] + row.y * ph_by[1][a] + row.z * ph_by[2][a];
            v_by[a] = -(row.x * x[a] + row.y * y[a] + row.z * theta[a]);
        }
        s_by[if component < 2 { NoiseComponent::LookPosition } else { NoiseComponent::LookHeading } as usize] += r;
        for a in 0..NOISES {
            let of_v = v * per_s;
            x[a] += (ph_by[0][a] - gain.x * s_by[a]) * of_v + gain.x * v_by[a];
            y[a] += (ph_by[1][a] - gain.y * s_by[a]) * of_v + gain.y * v_by[a];
            theta[a] += (ph_by[2][a] - gain.z * s_by[a]) * of_v + gain.z * v_by[a];
        }
        self.covariance_by.lower_with_gain(gain, &ph_by, &s_by);
        let (s_by, v_by) = (Vector4::from(s_by) * per_s, Vector4::from(v_by));
        self.noise_score.gradient += s_by * (0.5 * (1.0 - v * v * per_s)) + v_by * (v * per_s);
        self.noise_score.information += s_by * s_by.transpose() * 0.5 + v_by * v_by.transpose() * per_s;
    }
}

/// What one component of a look changes.
#[derive(Clone, Copy)]
struct Update {
    /// What it sees of the pose.
    row: Vector3<f64>,
    gain: Vector3<f64>,
    /// Innovation, the components before it taken into account, and its variance.
    v: f64,
    s: f64,
}
