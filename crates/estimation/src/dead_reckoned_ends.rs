//! Operations on a fit beside the estimate: normal equations of blocks, decimation, and errors of dead
//! reckoning with terms.

use std::convert::Infallible;
use std::sync::Arc;

use kinematics::{Pose, wrap_to_pi};
use model_term::ModelTerm;
use rayon::prelude::*;

use crate::decimation::Decimated;
use crate::error::EstimationError;
use crate::model::{Instrument, Model};
use crate::model_fit::ModelFit;
use crate::noise::NoiseComponent;
use crate::normal_equations::NormalEquations;
use crate::optimizer::{Solution, settled_from};
use crate::pass::pass;
use crate::pass_options::{OutlierGate, PassOptions};
use crate::propagation::{CarriedState, Propagator};
use crate::segment::{MeasuredPose, Segment};
use crate::sensor_heading::start_heading;
use crate::settings::{COMMON, START_HEADINGS};
use crate::thinning::Selection;
use crate::wheel_angles::WheelInterval;

/// Error of dead reckoning at a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndError {
    /// Which run: session and run in the order given.
    pub run: (usize, usize),
    /// Error of the position, metres.
    pub position_m: f64,
    /// Error of the heading, radians.
    pub heading_rad: f64,
    /// Distance driven by the drive's centre, metres.
    pub length_m: f64,
    /// The dead-reckoned pose of the instrument in the frame of the measured one: ahead, to the left
    /// (metres), turned to the left (radians).
    pub off: Pose,
}

impl ModelFit<'_> {
    /// The normal equations at the values found, each run cut into `blocks` that start anew, for runs too few
    /// to be held out whole.
    #[must_use]
    pub fn in_blocks(&self, terms: &mut [Box<dyn ModelTerm>], blocks: usize) -> Vec<NormalEquations> {
        self.blocks(terms, blocks, self.gate())
    }

    pub(crate) fn blocks(
        &self,
        terms: &mut [Box<dyn ModelTerm>],
        blocks: usize,
        gate: OutlierGate,
    ) -> Vec<NormalEquations> {
        let pass_options = PassOptions { gate, ..PassOptions::default() };
        (0..blocks)
            .flat_map(|block| {
                let part: Vec<_> =
                    self.selections.iter().map(|selection| selection.block(&self.records, block, blocks)).collect();
                self.started_anew(&part, terms, pass_options).into_iter().filter(|run| run.count > 0.0)
            })
            .collect()
    }

    /// The normal equations of selections that begin within segments. Where headings are not measured, each
    /// selection begins with the heading that suits its own measurements best.
    fn started_anew(
        &self,
        selections: &[Selection],
        terms: &mut [Box<dyn ModelTerm>],
        pass_options: PassOptions<'_>,
    ) -> Vec<NormalEquations> {
        let Solution { model, noise, free_headings, .. } = &self.solution;
        if !self.records.segments.iter().any(Segment::has_free_heading) {
            return pass(&self.records, selections, model, noise, free_headings, terms, pass_options).runs;
        }
        let weight = 1.0 / selections.len() as f64;
        let mut sum: Vec<NormalEquations> = Vec::new();
        for selection in selections {
            let of_segment = |(number, segment): (usize, &Segment<'_>)| match selection.propagations[number].first() {
                Some(first) if first.from > 0 => start_heading(segment, model, first.from),
                _ => free_headings[number],
            };
            let rough: Vec<f64> = self.records.segments.iter().enumerate().map(of_segment).collect();
            let own = std::slice::from_ref(selection);
            let settled = |mut headings: Vec<f64>, gate: OutlierGate| {
                let pass_options = PassOptions { gate, ..pass_options };
                let mut found = pass(&self.records, own, model, noise, &headings, terms, pass_options);
                for _ in 0..COMMON.max_ungated_steps {
                    let heads = &found.headings;
                    if heads
                        .iter()
                        .all(|heading| heading.response.rest.abs() < START_HEADINGS.heading_step_tolerance_rad)
                    {
                        break;
                    }
                    heads.iter().for_each(|heading| headings[heading.segment] += heading.response.rest);
                    found = pass(&self.records, own, model, noise, &headings, terms, pass_options);
                }
                Ok::<_, Infallible>((headings, found))
            };
            let Ok((_, found)) = settled_from(rough, pass_options.gate, settled);
            if sum.is_empty() {
                sum = found.runs.iter().map(|run| NormalEquations::new(run.run, run.gradient.len())).collect();
            }
            sum.iter_mut().zip(&found.runs).for_each(|(sum, run)| sum.add(run, weight));
        }
        sum
    }

    /// The same fit on records whose intervals are joined up to `longest_s` seconds, for faster scans.
    /// `terms` are those of the fit. `None` where more than half of the intervals would be left, or where the
    /// innovations change: a term may depend on single rows.
    #[must_use]
    pub fn decimated(&self, terms: &mut [Box<dyn ModelTerm>], longest_s: f64) -> Option<Self> {
        let Decimated { records, selections } = Decimated::of(&self.records, &self.selections, longest_s)?;
        let decimated = Self { records: Arc::new(records), selections: Arc::new(selections), ..self.clone() };
        let runs = decimated.scan_parts(terms, &[]);
        let scanned;
        let own = if self.solution.pass.runs.is_empty() {
            scanned = self.scan_parts(terms, &[]);
            &scanned
        } else {
            &self.solution.pass.runs
        };
        let both = runs.iter().zip(own);
        let same_measurements = both.clone().all(|(run, own)| run.count == own.count);
        // A run's χ² changes by 2 Σ z δ, which has the variance 4 Σ δ².
        let squares: f64 = both.map(|(run, own)| (0.5 * (run.chi_square - own.chi_square)).powi(2)).sum();
        (same_measurements && squares < COMMON.max_decimation_noncentrality).then_some(decimated)
    }

    /// Mahalanobis distance of consecutive displacements, composed, from dead reckoning with the geometry
    /// found, in standard deviations of a measurement. `None` where there is no displacement.
    #[must_use]
    pub fn mahalanobis_distance(&self, segments: std::ops::Range<usize>) -> Option<f64> {
        let (mut measured, mut dead_reckoned) = (None, Pose::IDENTITY);
        for segment in self.records.segments.get(segments)?.iter().filter(|segment| segment.is_displacement()) {
            let (_, _, (_, end)) = segment.ends()?;
            let extrinsics = self.solution.model.instrument(segment.run).body_from_sensor;
            let turned =
                |pose: Pose, interval: &WheelInterval| pose * self.solution.model.increment(interval.wheel_rad).arc();
            let moved = segment.intervals.iter().fold(Pose::IDENTITY, turned);
            measured = Some(measured.unwrap_or(Pose::IDENTITY) * end);
            dead_reckoned = dead_reckoned * (extrinsics.inverse() * moved * extrinsics);
        }
        let off = dead_reckoned.to(measured?);
        let [_, _, xy, theta] = self.solution.noise.variance;
        let off_rad = wrap_to_pi(off.theta_rad);
        Some(((off.x_m * off.x_m + off.y_m * off.y_m) / xy + off_rad * off_rad / theta).sqrt())
    }

    /// The fit, with its terms, with one noise fixed at next to nothing: the loss of likelihood tests that
    /// noise.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn without_noise(
        &self,
        component: NoiseComponent,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Result<Self, EstimationError> {
        let mut without = Self { prior: self.prior.without(component), ..self.clone() };
        let mut from = self.current_values();
        from.noise = from.noise.map(|mut noise| {
            noise.variance[component as usize] = COMMON.min_noise_sigma * COMMON.min_noise_sigma;
            noise
        });
        without.refit(Some(from), terms)?;
        Ok(without)
    }

    /// Dead reckoning of every segment from its first measurement to its last under a model with terms;
    /// segments without measured headings are left out.
    #[must_use]
    pub fn dead_reckoned(&self, model: &Model, terms: &mut [Box<dyn ModelTerm>]) -> Vec<EndError> {
        self.dead_reckoned_of(model, terms, |_| true)
    }

    /// The same of the selected runs: session and run in the order given.
    #[must_use]
    pub fn dead_reckoned_of(
        &self,
        model: &Model,
        terms: &mut [Box<dyn ModelTerm>],
        selected: impl Fn((usize, usize)) -> bool,
    ) -> Vec<EndError> {
        self.dead_reckoned_to(model, terms, selected, |segment| &segment.measurements[segment.measurements.len() - 1..])
    }

    /// Dead reckoning of every segment from its first measurement to each one after it.
    #[must_use]
    pub fn dead_reckoned_measurements(&self, model: &Model, terms: &mut [Box<dyn ModelTerm>]) -> Vec<EndError> {
        self.dead_reckoned_to(
            model,
            terms,
            |_| true,
            |segment| &segment.measurements[usize::from(!segment.is_displacement())..],
        )
    }

    fn dead_reckoned_to<'b>(
        &'b self,
        model: &Model,
        terms: &mut [Box<dyn ModelTerm>],
        selected: impl Fn((usize, usize)) -> bool,
        measurements: impl Fn(&'b Segment<'b>) -> &'b [MeasuredPose] + Sync,
    ) -> Vec<EndError> {
        let of_run = |terms: &mut Vec<Box<dyn ModelTerm>>, run: &'b [Segment<'b>]| {
            dead_reckoned_run(run, model, terms, &measurements)
        };
        let runs = self.records.segments.chunk_by(|a, b| a.run == b.run).filter(|run| selected(run[0].run));
        let found: Vec<Vec<EndError>> =
            runs.collect::<Vec<_>>().into_par_iter().map_init(|| terms.to_vec(), of_run).collect();
        found.into_iter().flatten().collect()
    }
}

/// Dead reckoning of the segments of a run, each from its first measurement to those that are asked for.
fn dead_reckoned_run<'b>(
    run: &'b [Segment<'b>],
    model: &Model,
    terms: &mut [Box<dyn ModelTerm>],
    measurements: &impl Fn(&'b Segment<'b>) -> &'b [MeasuredPose],
) -> Vec<EndError> {
    let mut found = Vec::new();
    // The state at the end of the displacements so far.
    let mut carried: Option<CarriedState> = None;
    for segment in run {
        let Some((start, first, _)) = segment.ends() else { continue };
        let Instrument { body_from_sensor, latency_s } = model.instrument(segment.run);
        let mut propagator = Propagator::new(segment, model, terms);
        if let Some(carried) = carried.take().filter(|_| segment.continues) {
            propagator.carry_on(carried);
        }
        propagator.restart();
        // Where the drive's centre stands at the first measurement, to first order in what the terms add
        // to it.
        let mounted = start * body_from_sensor.inverse();
        let off = propagator.measurement_offset(mounted, first.0, first.1, latency_s);
        let mut pose = mounted * off.inverse();
        let (start_m, mut at) = (propagator.session_m(), first.1);
        for measurement in measurements(segment) {
            pose = propagator.dead_reckon(pose, at..measurement.after);
            at = measurement.after;
            let Some(theta_rad) = measurement.theta_rad else { continue };
            let off = propagator.measurement_offset(pose, measurement.t_s, at, latency_s);
            let measured = pose * off * body_from_sensor;
            let there = Pose::new(measurement.x_m, measurement.y_m, theta_rad);
            let off_rad = wrap_to_pi(measured.theta_rad - theta_rad);
            found.push(EndError {
                run: segment.run,
                position_m: measured.position().distance_m(there.position()),
                heading_rad: off_rad.abs(),
                length_m: propagator.session_m() - start_m,
                off: Pose { theta_rad: off_rad, ..there.to(measured) },
            });
        }
        carried = Some(propagator.carried(pose * body_from_sensor));
    }
    found
}
