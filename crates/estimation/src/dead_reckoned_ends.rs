//! What whoever extends `joint`'s model needs beside the fit: evidence in blocks, and dead reckoning with terms.

use std::sync::Arc;

use kinematics::{Increment, Pose, Twist, Wheels, wrap_to_pi};
use model_term::{Interval, Look, ModelTerm};

use crate::decimation::Coarse;
use crate::error::EstimationError;
use crate::filter::{Gate, Want};
use crate::group_extrinsics::Instrument;
use crate::model::Model;
use crate::model_fit::JointFit;
use crate::noise::{LEAST_SIGMA, NoiseComponent};
use crate::normal_equations::Evidence;
use crate::optimizer::Fit;
use crate::pass::pass;
use crate::records::{Chain, Seen};
use crate::wheel_angles::Piece;

/// How far off dead reckoning ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndError {
    /// Which run: session and run in the order given.
    pub run: (usize, usize),
    /// Of the position, metres.
    pub position_m: f64,
    /// Of the heading, radians.
    pub heading_rad: f64,
    /// Way of the drive's centre, metres.
    pub length_m: f64,
    /// Where dead reckoning ends, in the frame of where the instrument saw the end: ahead, to the left, turned to the left.
    pub off: Pose,
}

impl JointFit<'_> {
    /// The evidence at the values found, each run cut into so many blocks that start anew; for runs too few to be held out whole.
    #[must_use]
    pub fn in_blocks(&self, terms: &mut [Box<dyn ModelTerm>], blocks: usize) -> Vec<Evidence> {
        self.blocks(terms, blocks, self.gate())
    }

    pub(crate) fn blocks(&self, terms: &mut [Box<dyn ModelTerm>], blocks: usize, gate: Gate) -> Vec<Evidence> {
        let want = Want { gate, ..Want::default() };
        (0..blocks)
            .flat_map(|block| {
                let part: Vec<_> =
                    self.selections.iter().map(|selection| selection.block(&self.records, block, blocks)).collect();
                let Fit { model, noise, free_headings, .. } = &self.fit;
                let found = pass(&self.records, &part, model, noise, free_headings, terms, want);
                found.runs.into_iter().filter(|run| run.count > 0.0)
            })
            .collect()
    }

    /// The same fit on counts put together in steps of up to so long, for scans: what they ask goes over fewer pieces. `terms` are those of the fit. `None` where that
    /// would leave more than half of the pieces, or by longer steps the fit is another one: looks then lie elsewhere, or a term goes with single rows.
    #[must_use]
    pub fn in_longer_steps(&self, terms: &mut [Box<dyn ModelTerm>], longest_s: f64) -> Option<Self> {
        /// Looks that lie elsewhere by δ of their standard deviations make Σδ² at the most of what is not there: less than chance does.
        const SAME: f64 = 1.0;
        let Coarse { records, selections } = Coarse::of(&self.records, &self.selections, longest_s)?;
        let coarse = Self { records: Arc::new(records), selections: Arc::new(selections), ..self.clone() };
        let runs = coarse.scan_parts(terms, &[]);
        let both = runs.iter().zip(&self.fit.pass.runs);
        let same_looks = both.clone().all(|(run, own)| run.count == own.count);
        // A run's χ² changes by 2 Σ z δ, which has the variance 4 Σ δ².
        let squares: f64 = both.map(|(run, own)| (0.5 * (run.chi_square - own.chi_square)).powi(2)).sum();
        (same_looks && squares < SAME).then_some(coarse)
    }

    /// How far displacements that follow each other, taken together, lie from dead reckoning with the lengths found, in standard deviations of a look; `None` where
    /// there is none.
    #[must_use]
    pub fn displaced(&self, chains: std::ops::Range<usize>) -> Option<f64> {
        let (mut seen, mut reckoned) = (None, Pose::IDENTITY);
        for chain in self.records.chains.get(chains)?.iter().filter(|chain| chain.is_displacement()) {
            let (_, _, (_, end)) = chain.ends()?;
            let Model { m_per_rad, separation_m, .. } = self.fit.model;
            let mounting = self.fit.model.instrument(chain.run).body_from_sensor;
            let moved = chain.pieces.iter().fold(Pose::IDENTITY, |pose, piece| {
                let travel_m = m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
                pose * Increment::from_travel(travel_m, separation_m).arc()
            });
            seen = Some(seen.unwrap_or(Pose::IDENTITY) * end);
            reckoned = reckoned * (mounting.inverse() * moved * mounting);
        }
        let off = reckoned.to(seen?);
        let [_, _, xy, theta] = self.fit.noise.variance;
        let off_rad = wrap_to_pi(off.theta_rad);
        Some(((off.x_m * off.x_m + off.y_m * off.y_m) / xy + off_rad * off_rad / theta).sqrt())
    }

    /// The fit, with the terms that are in it, with next to no noise of one kind: what the data lose by it says whether they need it.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn without_noise(
        &self,
        component: NoiseComponent,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Result<Self, EstimationError> {
        let mut without = Self { prior: self.prior.without(component), ..self.clone() };
        let mut from = self.here();
        from.noise = from.noise.map(|mut noise| {
            noise.variance[component as usize] = LEAST_SIGMA * LEAST_SIGMA;
            noise
        });
        without.refit_with(Some(from), terms)?;
        Ok(without)
    }

    /// Dead reckoning of every chain from its first look to its last under a model with terms; chains that are seen without headings are left out.
    #[must_use]
    pub fn reckoned(&self, model: &Model, terms: &mut [Box<dyn ModelTerm>]) -> Vec<EndError> {
        self.reckoned_of(model, terms, |_| true)
    }

    /// The same of some runs: session and run in the order given.
    #[must_use]
    pub fn reckoned_of(
        &self,
        model: &Model,
        terms: &mut [Box<dyn ModelTerm>],
        asked: impl Fn((usize, usize)) -> bool,
    ) -> Vec<EndError> {
        self.reckoned_to(model, terms, asked, |chain| &chain.looks[chain.looks.len() - 1..])
    }

    /// Dead reckoning of every chain from its first look to each one after it.
    #[must_use]
    pub fn reckoned_looks(&self, model: &Model, terms: &mut [Box<dyn ModelTerm>]) -> Vec<EndError> {
        self.reckoned_to(model, terms, |_| true, |chain| &chain.looks[usize::from(!chain.is_displacement())..])
    }

    fn reckoned_to<'b>(
        &'b self,
        model: &Model,
        terms: &mut [Box<dyn ModelTerm>],
        asked: impl Fn((usize, usize)) -> bool,
        looks: impl Fn(&'b Chain<'b>) -> &'b [Seen],
    ) -> Vec<EndError> {
        let parameters: usize = terms.iter().map(|term| term.parameters().len()).sum();
        let mut gradient = vec![Pose::IDENTITY; parameters];
        let mut found = Vec::new();
        // Where the displacements of a run have led, the last piece, and the way of the session.
        let mut trail: Option<(Pose, Option<Piece>, f64)> = None;
        for chain in self.records.chains.iter().filter(|chain| asked(chain.run)) {
            let Some((start, first, _)) = chain.ends() else { continue };
            let Instrument { body_from_sensor, latency_s } = model.instrument(chain.run);
            let (run_from_chain, mut previous, mut session_m) =
                trail.take().filter(|_| chain.goes_on).unwrap_or((Pose::IDENTITY, None, chain.session_m));
            if !chain.goes_on {
                for term in terms.iter_mut() {
                    term.restart(chain.info);
                }
            }
            let twist = |piece: &Piece| {
                let travel_m = model.m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
                let Increment { distance_m, turn_rad } = Increment::from_travel(travel_m, model.separation_m);
                Twist { v_m_s: distance_m / piece.dt_s, omega_rad_s: turn_rad / piece.dt_s }
            };
            let seen_from = |terms: &mut [Box<dyn ModelTerm>],
                             t_s: f64,
                             body: Pose,
                             piece: Option<&Piece>,
                             gradient: &mut [Pose]| {
                let twist = piece.map_or(Twist { v_m_s: 0.0, omega_rad_s: 0.0 }, twist);
                let look = Look { t_s, world_from_body: run_from_chain * body, twist, run: chain.info };
                gradient.fill(Pose::IDENTITY);
                each(terms, gradient, |term, own| term.sight(&look, own));
                let off = weighed(gradient, &model.sizes);
                let late = Increment { distance_m: twist.v_m_s, turn_rad: twist.omega_rad_s };
                (off, Pose::new(-late.distance_m * latency_s, 0.0, -late.turn_rad * latency_s))
            };
            // Where the drive's centre stands at the first look, to first order in what the terms add to it.
            let mounted = start * body_from_sensor.inverse();
            let (off, late) = seen_from(terms, first.0, mounted, chain.pieces.get(first.1), &mut gradient);
            let mut pose = mounted * add(off, late).inverse();
            let (mut wheel_rad, mut length_m) = (chain.wheel_rad, 0.0);
            let mut at = first.1;
            for look in looks(chain) {
                for piece in &chain.pieces[at..look.after] {
                    let travel_m = model.m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
                    let mut increment = Increment::from_travel(travel_m, model.separation_m);
                    let before = previous.unwrap_or(Piece { wheel_rad: Wheels::both(0.0), ..*piece });
                    let interval = Interval {
                        t_s: piece.t_s,
                        dt_s: piece.dt_s,
                        row_s: piece.row_s,
                        travel_m,
                        previous_m: model.m_per_rad.zip_with(before.wheel_rad, |m_per_rad, rad| m_per_rad * rad),
                        previous_dt_s: before.dt_s,
                        wheel_separation_m: model.separation_m,
                        wheel_rad,
                        turned_rad: piece.wheel_rad,
                        world_from_body: run_from_chain * pose,
                        session_m,
                        run: chain.info,
                    };
                    gradient.fill(Pose::IDENTITY);
                    each(terms, &mut gradient, |term, own| term.motion(&interval, own));
                    let change = weighed(&gradient, &model.sizes);
                    session_m += increment.distance_m.abs();
                    length_m += increment.distance_m.abs();
                    wheel_rad = wheel_rad.zip_with(piece.wheel_rad, |angle, rad| angle + rad);
                    increment.distance_m += change.x_m;
                    increment.turn_rad += change.theta_rad;
                    pose = pose * increment.arc() * Pose::new(0.0, change.y_m, 0.0);
                    previous = Some(*piece);
                }
                at = look.after;
                let Some(theta_rad) = look.theta_rad else { continue };
                let (off, late) = seen_from(terms, look.t_s, pose, chain.pieces[..at].last(), &mut gradient);
                let seen = pose * add(off, late) * body_from_sensor;
                let there = Pose::new(look.x_m, look.y_m, theta_rad);
                let off_rad = wrap_to_pi(seen.theta_rad - theta_rad);
                found.push(EndError {
                    run: chain.run,
                    position_m: seen.position().distance_m(there.position()),
                    heading_rad: off_rad.abs(),
                    length_m,
                    off: Pose { theta_rad: off_rad, ..there.to(seen) },
                });
            }
            trail = Some((run_from_chain * pose * body_from_sensor, previous, session_m));
        }
        found
    }
}

fn add(a: Pose, b: Pose) -> Pose {
    Pose::new(a.x_m + b.x_m, a.y_m + b.y_m, a.theta_rad + b.theta_rad)
}

fn each(
    terms: &mut [Box<dyn ModelTerm>],
    gradient: &mut [Pose],
    mut visit: impl FnMut(&mut dyn ModelTerm, &mut [Pose]),
) {
    let mut rest = gradient;
    for term in terms {
        let (own, others) = rest.split_at_mut(term.parameters().len());
        visit(term.as_mut(), own);
        rest = others;
    }
}

fn weighed(gradient: &[Pose], sizes: &[f64]) -> Pose {
    gradient.iter().zip(sizes).fold(Pose::IDENTITY, |sum, (gradient, size)| {
        Pose::new(
            sum.x_m + size * gradient.x_m,
            sum.y_m + size * gradient.y_m,
            sum.theta_rad + size * gradient.theta_rad,
        )
    })
}
