//! What a leg comes to by the counts and the terms, and what it depends on; kept from pass to pass where legs are long.
//!
//! A leg of many pieces takes many times as long to be driven as its look to be taken, and it depends on the model alone, not on the noise. Near the model
//! at which it was driven it is, with the derivatives that it has anyway, motion + Σ ∂motion/∂p · Δp, up to squares of Δp. Steps of a fit that are small are taken by
//! kept legs; where they end is settled by legs that are driven.

use std::ops::Range;

use kinematics::{Frame, Increment, Pose, Twist, Wheels, sin_cos, sinc, sinc_derivative};
use model_term::{Interval, Look, ModelTerm};
use nalgebra::Vector3;

use crate::derivatives::Derivatives;
use crate::model::Model;
use crate::records::Chain;
use crate::thinning::Leg;
use crate::wheel_angles::Piece;

/// A leg's motion in the frame of the body at its start, and what it depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moved {
    pub(crate) motion: Pose,
    pub(crate) by_lengths: [Vector3<f64>; 3],
}

/// Where a filter has its legs from.
pub(crate) enum Legs<'f> {
    /// They are driven.
    Driven,
    /// They are driven, and kept.
    Kept(KeptLegs),
    /// They have been kept, by a model that differs from that in force by this.
    Known(&'f KeptLegs, &'f Change),
}

/// What the legs of a chain came to.
#[derive(Debug, Clone)]
pub(crate) struct KeptLegs {
    moved: Vec<Moved>,
    /// How many parameters the terms have.
    parameters: usize,
    /// Derivatives of each leg by them.
    by_terms: Vec<Vector3<f64>>,
    /// What they add to the look at the start, and to that after each leg, in the frame of the body.
    sights: Vec<Pose>,
}

impl Legs<'_> {
    /// So many, to be driven with terms of so many parameters, and kept.
    pub(crate) fn kept(legs: usize, parameters: usize) -> Self {
        Self::Kept(KeptLegs {
            moved: Vec::with_capacity(legs),
            parameters,
            by_terms: Vec::with_capacity(legs * parameters),
            sights: vec![Pose::IDENTITY; (legs + 1) * parameters],
        })
    }

    /// Those that were kept.
    pub(crate) fn into_kept(self) -> Option<KeptLegs> {
        if let Self::Kept(kept) = self { Some(kept) } else { None }
    }
}

impl KeptLegs {
    pub(crate) fn sight(&self, legs: usize) -> &[Pose] {
        &self.sights[legs * self.parameters..][..self.parameters]
    }

    pub(crate) fn keep_sight(&mut self, legs: usize, gradients: &[Pose]) {
        self.sights[legs * self.parameters..][..self.parameters].copy_from_slice(gradients);
    }
}

/// The legs of all chains, phase by phase, and the model by which they were driven.
#[derive(Debug, Clone)]
pub(crate) struct Kept {
    pub(crate) model: Model,
    pub(crate) phases: Vec<Vec<Option<KeptLegs>>>,
}

/// How a model differs from that by which legs were driven.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// Of the lengths, relative: left, right, separation.
    lengths: [f64; 3],
    sizes: Vec<f64>,
}

impl Kept {
    /// How a model differs from theirs.
    pub(crate) fn change_to(&self, model: &Model) -> Change {
        let lengths = |of: &Model| [of.m_per_rad.left, of.m_per_rad.right, of.separation_m];
        let (from, to) = (lengths(&self.model), lengths(model));
        Change {
            lengths: [0, 1, 2].map(|k| f64::ln(to[k] / from[k])),
            sizes: model.sizes.iter().zip(&self.model.sizes).map(|(to, from)| to - from).collect(),
        }
    }

    /// Those of a chain in a phase, for a model that differs so much.
    pub(crate) fn known<'k>(&'k self, phase: usize, chain: usize, change: &'k Change) -> Legs<'k> {
        self.phases[phase][chain].as_ref().map_or(Legs::Driven, |legs| Legs::Known(legs, change))
    }
}

/// Where the displacements of a run have led: the next one's terms go on from there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trail {
    /// The next chain's frame in that of the first.
    pub(crate) run_from_chain: Pose,
    pub(crate) session_m: f64,
    pub(crate) previous: Option<Piece>,
}

/// The mean model along one chain: what counts and terms say of its motion, and what the terms add to its measurements. One for the filter and for dead reckoning.
pub(crate) struct Propagator<'f, 'a> {
    chain: &'f Chain<'a>,
    pub(crate) model: &'f Model,
    terms: &'f mut [Box<dyn ModelTerm>],
    /// The chain's frame in that of the run's displacements; the identity for poses.
    run_from_chain: Pose,
    session_m: f64,
    wheel_rad: Wheels<f64>,
    previous: Option<Piece>,
    goes_on: bool,
    /// What the terms last said, by each of their parameters.
    pub(crate) gradients: Vec<Pose>,
    /// Where legs come from.
    pub(crate) legs: Legs<'f>,
    /// Derivatives of the leg in force by the terms' parameters.
    pub(crate) leg_by_terms: Derivatives,
}

impl<'f, 'a> Propagator<'f, 'a> {
    pub(crate) fn new(chain: &'f Chain<'a>, model: &'f Model, terms: &'f mut [Box<dyn ModelTerm>]) -> Self {
        let parameters = terms.iter().map(|term| term.parameters().len()).sum();
        Self {
            chain,
            model,
            terms,
            run_from_chain: Pose::IDENTITY,
            session_m: chain.session_m,
            wheel_rad: chain.wheel_rad,
            previous: None,
            goes_on: false,
            gradients: vec![Pose::IDENTITY; parameters],
            legs: Legs::Driven,
            leg_by_terms: Derivatives::zeros(parameters),
        }
    }

    /// Goes on where the chain before ended.
    pub(crate) fn go_on(&mut self, Trail { run_from_chain, session_m, previous }: Trail) {
        (self.run_from_chain, self.session_m, self.previous) = (run_from_chain, session_m, previous);
        self.goes_on = true;
    }

    /// How far the centre went in the runs before and in this one, metres.
    pub(crate) const fn session_m(&self) -> f64 {
        self.session_m
    }

    /// Where this chain ended, the instrument standing at a pose of the chain's frame.
    pub(crate) fn trail(&self, chain_from_sensor: Pose) -> Trail {
        let run_from_chain = self.run_from_chain * chain_from_sensor;
        Trail { run_from_chain, session_m: self.session_m, previous: self.previous }
    }

    /// Forgets what terms remember of the run before, unless the chain goes on.
    #[inline(always)]
    pub(crate) fn restart(&mut self) {
        if !self.goes_on {
            for term in self.terms.iter_mut() {
                term.restart(self.chain.info);
            }
        }
    }

    /// Motion of the drive's centre in a piece, per second.
    #[inline(always)]
    pub(crate) fn twist(&self, piece: &Piece) -> Twist {
        let Increment { distance_m, turn_rad } = self.model.increment(piece.wheel_rad);
        Twist { v_m_s: distance_m / piece.dt_s, omega_rad_s: turn_rad / piece.dt_s }
    }

    /// What the terms add to the look after so many legs, at a pose of the drive's centre, in the frame of the body; it stands in [`Self::gradients`].
    #[inline(always)]
    pub(crate) fn sight(&mut self, pose: Pose, legs: usize, t_s: f64, twist: Twist) {
        if self.gradients.is_empty() {
            return;
        }
        if let Legs::Known(kept, _) = self.legs {
            self.gradients.copy_from_slice(kept.sight(legs));
        } else {
            let look = Look { t_s, world_from_body: self.run_from_chain * pose, twist, run: self.chain.info };
            self.ask_terms(|term, own| term.sight(&look, own));
        }
        if let Legs::Kept(kept) = &mut self.legs {
            kept.keep_sight(legs, &self.gradients);
        }
    }

    /// The motion of a leg from a pose of the drive's centre, and in [`Self::leg_by_terms`] how it depends on the terms' sizes.
    #[inline(always)]
    pub(crate) fn moved(&mut self, pose: Pose, number: usize, leg: &Leg) -> Moved {
        if let Legs::Known(kept, change) = self.legs {
            return self.known(kept, change, number);
        }
        let moved = self.driven(pose, leg);
        if let Legs::Kept(kept) = &mut self.legs {
            kept.moved.push(moved);
            kept.by_terms.extend((0..kept.parameters).map(|column| self.leg_by_terms.get(column)));
        }
        moved
    }

    #[inline(always)]
    fn known(&mut self, kept: &KeptLegs, change: &Change, number: usize) -> Moved {
        let Moved { mut motion, by_lengths } = kept.moved[number];
        let mut add = |by: Vector3<f64>, change: f64| {
            motion.x_m += by.x * change;
            motion.y_m += by.y * change;
            motion.theta_rad += by.z * change;
        };
        by_lengths.iter().zip(change.lengths).for_each(|(by, change)| add(*by, change));
        let by_terms = &kept.by_terms[number * kept.parameters..][..kept.parameters];
        for (column, (by, change)) in by_terms.iter().zip(&change.sizes).enumerate() {
            add(*by, *change);
            self.leg_by_terms.set(column, *by);
        }
        Moved { motion, by_lengths }
    }

    /// Asks each term for its gradients by its own parameters.
    #[inline(always)]
    fn ask_terms(&mut self, ask: impl Fn(&mut dyn ModelTerm, &mut [Pose])) {
        self.gradients.fill(Pose::IDENTITY);
        let mut rest = &mut self.gradients[..];
        for term in self.terms.iter_mut() {
            let (own, others) = rest.split_at_mut(term.parameters().len());
            ask(term.as_mut(), own);
            rest = others;
        }
    }

    /// The motion of a leg by the counts and the terms.
    #[inline(always)]
    fn driven(&mut self, pose: Pose, leg: &Leg) -> Moved {
        let Model { m_per_rad, separation_m, .. } = *self.model;
        let mut moved = Moved { motion: Pose::IDENTITY, by_lengths: [Vector3::zeros(); 3] };
        self.leg_by_terms.clear();
        let run_from_start = Frame::from(self.run_from_chain * pose);
        // Those of terms that are only tested have no size, and there are many.
        let sized = self.model.sizes.iter().rposition(|size| *size != 0.0).map_or(0, |last| last + 1);
        for piece in &self.chain.pieces[leg.pieces.clone()] {
            let travel_m = m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
            let Increment { distance_m, turn_rad } = Increment::from_travel(travel_m, separation_m);
            let before = moved.motion;
            let half_rad = 0.5 * turn_rad;
            let (sin, cos) = sin_cos(before.theta_rad + half_rad);
            let chord = sinc(half_rad);
            // In the frame of the step's middle; a turn acts on half of the way.
            let middle = |g: &Pose, by_turn: &Vector3<f64>| {
                Vector3::new(cos * g.x_m - sin * g.y_m, sin * g.x_m + cos * g.y_m, 0.0) + by_turn * g.theta_rad
            };
            let mut step = Vector3::new(distance_m * chord * cos, distance_m * chord * sin, turn_rad);
            let bend = sinc_derivative(half_rad);
            let by_turn = Vector3::new(
                0.5 * distance_m * (bend * cos - chord * sin),
                0.5 * distance_m * (bend * sin + chord * cos),
                1.0,
            );
            let along = Vector3::new(chord * cos, chord * sin, 0.0);
            let per_m = 1.0 / separation_m;
            let steps = [
                along * (0.5 * travel_m.left) - by_turn * (travel_m.left * per_m),
                along * (0.5 * travel_m.right) + by_turn * (travel_m.right * per_m),
                -by_turn * turn_rad,
            ];
            if !self.gradients.is_empty() {
                self.term_gradients(piece, travel_m, run_from_start * before);
                for (gradient, size) in self.gradients.iter().zip(&self.model.sizes[..sized]) {
                    step += *size * middle(gradient, &by_turn);
                }
            }
            for (by, of_step) in moved.by_lengths.iter_mut().zip(steps) {
                *by = turned(*by, step) + of_step;
            }
            moved.motion = Pose::new(before.x_m + step.x, before.y_m + step.y, before.theta_rad + step.z);
            // As if the rest of the leg led back to its start: one turn at the end of the leg then does for those of all pieces.
            let by_turn = by_turn + Vector3::new(moved.motion.y_m, -moved.motion.x_m, 0.0);
            let legs = self.leg_by_terms.x.iter_mut().zip(&mut self.leg_by_terms.y).zip(&mut self.leg_by_terms.theta);
            for (((x, y), theta), gradient) in legs.zip(&self.gradients) {
                *x += cos * gradient.x_m - sin * gradient.y_m + by_turn.x * gradient.theta_rad;
                *y += sin * gradient.x_m + cos * gradient.y_m + by_turn.y * gradient.theta_rad;
                *theta += gradient.theta_rad;
            }
            self.session_m += distance_m.abs();
            self.wheel_rad = self.wheel_rad.zip_with(piece.wheel_rad, |angle, rad| angle + rad);
            self.previous = Some(*piece);
        }
        let end = Vector3::new(moved.motion.x_m, moved.motion.y_m, 0.0);
        self.leg_by_terms.turn(end);
        moved
    }

    /// The pose of the drive's centre after some pieces, by exact arcs of what counts and terms say together; without derivatives.
    pub(crate) fn dead_reckon(&mut self, mut pose: Pose, pieces: Range<usize>) -> Pose {
        let Model { m_per_rad, separation_m, .. } = *self.model;
        for piece in &self.chain.pieces[pieces] {
            let travel_m = m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
            let Increment { distance_m, turn_rad } = Increment::from_travel(travel_m, separation_m);
            self.term_gradients(piece, travel_m, self.run_from_chain * pose);
            let Pose { x_m, y_m, theta_rad } = self.from_terms();
            let arc = Increment { distance_m: distance_m + x_m, turn_rad: turn_rad + theta_rad }.arc();
            pose = pose * arc * Pose::new(0.0, y_m, 0.0);
            self.session_m += distance_m.abs();
            self.wheel_rad = self.wheel_rad.zip_with(piece.wheel_rad, |angle, rad| angle + rad);
            self.previous = Some(*piece);
        }
        pose
    }

    /// What the terms last said, at their parameters' values.
    pub(crate) fn from_terms(&self) -> Pose {
        self.gradients.iter().zip(&self.model.sizes).fold(Pose::IDENTITY, |sum, (gradient, size)| {
            Pose::new(
                sum.x_m + size * gradient.x_m,
                sum.y_m + size * gradient.y_m,
                sum.theta_rad + size * gradient.theta_rad,
            )
        })
    }

    #[inline(always)]
    fn term_gradients(&mut self, piece: &Piece, travel_m: Wheels<f64>, world_from_body: Pose) {
        let m_per_rad = self.model.m_per_rad;
        let previous = self.previous.unwrap_or(Piece { wheel_rad: Wheels::both(0.0), ..*piece });
        let interval = Interval {
            t_s: piece.t_s,
            dt_s: piece.dt_s,
            row_s: piece.row_s,
            travel_m,
            previous_m: m_per_rad.zip_with(previous.wheel_rad, |m_per_rad, rad| m_per_rad * rad),
            previous_dt_s: previous.dt_s,
            wheel_separation_m: self.model.separation_m,
            wheel_rad: self.wheel_rad,
            turned_rad: piece.wheel_rad,
            world_from_body,
            session_m: self.session_m,
            run: self.chain.info,
        };
        self.ask_terms(|term, own| term.motion(&interval, own));
    }
}

/// A derivative carried over a step: a heading that is off turns what comes after.
#[inline(always)]
fn turned(by: Vector3<f64>, step: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(by.x - step.y * by.z, by.y + step.x * by.z, by.z)
}
