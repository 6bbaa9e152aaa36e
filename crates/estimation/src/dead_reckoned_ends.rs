//! What whoever extends `joint`'s model needs beside the fit: evidence in blocks, and dead reckoning with terms.

use std::sync::Arc;

use kinematics::{Pose, Twist, wrap_to_pi};
use model_term::ModelTerm;

use crate::decimation::Coarse;
use crate::error::EstimationError;
use crate::filter::{Gate, Want};
use crate::model::{Instrument, Model};
use crate::model_fit::JointFit;
use crate::noise::{LEAST_SIGMA, NoiseComponent};
use crate::normal_equations::Evidence;
use crate::optimizer::Fit;
use crate::pass::pass;
use crate::propagation::{Propagator, Trail};
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
            let mounting = self.fit.model.instrument(chain.run).body_from_sensor;
            let turned = |pose: Pose, piece: &Piece| pose * self.fit.model.increment(piece.wheel_rad).arc();
            let moved = chain.pieces.iter().fold(Pose::IDENTITY, turned);
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
        let mut found = Vec::new();
        // Where the displacements of a run have led.
        let mut trail: Option<Trail> = None;
        for chain in self.records.chains.iter().filter(|chain| asked(chain.run)) {
            let Some((start, first, _)) = chain.ends() else { continue };
            let Instrument { body_from_sensor, latency_s } = model.instrument(chain.run);
            let mut propagator = Propagator::new(chain, model, terms);
            if let Some(trail) = trail.take().filter(|_| chain.goes_on) {
                propagator.go_on(trail);
            }
            propagator.restart();
            // What the terms and the latency add to a measurement, in the frame of the body.
            let seen_from = |propagator: &mut Propagator<'_, '_>, t_s: f64, body: Pose, piece: Option<&Piece>| {
                let Twist { v_m_s, omega_rad_s } =
                    piece.map_or(Twist { v_m_s: 0.0, omega_rad_s: 0.0 }, |piece| propagator.twist(piece));
                propagator.sight(body, 0, t_s, Twist { v_m_s, omega_rad_s });
                let late = Pose::new(-v_m_s * latency_s, 0.0, -omega_rad_s * latency_s);
                add(propagator.from_terms(), late)
            };
            // Where the drive's centre stands at the first look, to first order in what the terms add to it.
            let mounted = start * body_from_sensor.inverse();
            let off = seen_from(&mut propagator, first.0, mounted, chain.pieces.get(first.1));
            let mut pose = mounted * off.inverse();
            let (start_m, mut at) = (propagator.session_m(), first.1);
            for look in looks(chain) {
                pose = propagator.dead_reckon(pose, at..look.after);
                at = look.after;
                let Some(theta_rad) = look.theta_rad else { continue };
                let off = seen_from(&mut propagator, look.t_s, pose, chain.pieces[..at].last());
                let seen = pose * off * body_from_sensor;
                let there = Pose::new(look.x_m, look.y_m, theta_rad);
                let off_rad = wrap_to_pi(seen.theta_rad - theta_rad);
                found.push(EndError {
                    run: chain.run,
                    position_m: seen.position().distance_m(there.position()),
                    heading_rad: off_rad.abs(),
                    length_m: propagator.session_m() - start_m,
                    off: Pose { theta_rad: off_rad, ..there.to(seen) },
                });
            }
            trail = Some(propagator.trail(pose * body_from_sensor));
        }
        found
    }
}

fn add(a: Pose, b: Pose) -> Pose {
    Pose::new(a.x_m + b.x_m, a.y_m + b.y_m, a.theta_rad + b.theta_rad)
}
