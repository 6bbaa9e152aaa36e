//! One pass over all runs: the filter of every segment, and the sums of what they say.

use std::mem::{Discriminant, discriminant};
use std::ops::Range;
use std::sync::Arc;

use kinematics::InstructionSet;
use model_term::ModelTerm;
use nalgebra::Vector4;
use rayon::prelude::*;

use crate::filter::{Filter, FilterRun};
use crate::group_extrinsics::GroupResponse;
use crate::innovation::InnovationComponent;
use crate::kinematic_samples::KinematicSample;
use crate::layout::Layout;
use crate::model::{Column, Model};
use crate::noise::Noise;
use crate::noise_score::{NoiseScore, TimingScore};
use crate::normal_equations::NormalEquations;
use crate::partial_filter::{Filtered, filter_partial};
use crate::partial_observation::Quantity;
use crate::partial_poses::{PartialPass, TakenPoses};
use crate::partial_records::PartialSegment;
use crate::pass_options::{OutlierGate, PassOptions};
use crate::products::{HeadingResponse, Products};
use crate::propagation::{CachedPropagation, CarriedState, Change, PropagationSource, SegmentCache};
use crate::records::Records;
use crate::segment::{Segment, Start};
use crate::settings::{COMMON, MIN_PARALLEL_WORK};
use crate::thinning::{PropagationInterval, Selection};

/// The result of a pass.
#[derive(Debug, Clone)]
pub struct Pass {
    /// Each run's normal equation, in the order of sessions and runs; averaged over phases.
    pub runs: Vec<NormalEquations>,
    /// The whitened innovations, phase by phase, in the order of segments and measurements; most of the
    /// memory, which copies of a pass share.
    pub innovations: Arc<Vec<Vec<InnovationComponent>>>,
    /// How the robot moved before each measurement, phase by phase, in the order of the innovations; empty
    /// where it is not asked for.
    pub samples: Vec<Vec<KinematicSample>>,
    /// Outliers of the first phase: segment and measurement.
    pub outliers: Vec<(usize, usize)>,
    /// The same of partial measurements, by the records' parts of runs.
    pub(crate) partial_outliers: Vec<(usize, usize)>,
    /// Score of the cost by the logarithms of the variances.
    pub(crate) noise: NoiseScore,
    /// Score by the variance of the instants of measurements.
    pub(crate) timing: TimingScore,
    /// Response of the free start headings to a step of the parameters.
    pub(crate) headings: Vec<FreeHeading>,
    /// Response of the groups' own instruments to one.
    pub(crate) own: Vec<GroupResponse>,
    /// The propagations, where they were recorded.
    pub(crate) cached: Option<CachedPropagation>,
}

/// Response of a segment's free start heading to a step of the parameters.
#[derive(Debug, Clone)]
pub(crate) struct FreeHeading {
    pub(crate) segment: usize,
    pub(crate) run: (usize, usize),
    pub(crate) response: HeadingResponse,
}

impl Pass {
    /// Steps of the start headings that were not measured: segment, and radians.
    pub fn heading_steps(&self) -> impl Iterator<Item = (usize, f64)> {
        self.headings.iter().map(|heading| (heading.segment, heading.response.rest))
    }

    /// χ² that start headings which were not measured take up.
    #[must_use]
    pub fn chi_square_of_headings(&self) -> f64 {
        self.headings.iter().map(|heading| heading.response.information * heading.response.rest.powi(2)).sum()
    }

    /// Score of the cost by the logarithms of the variances where so many parameters are fitted beside start
    /// headings and the groups' own instruments: they take up a part of the scatter, which the likelihood
    /// counts as none. Restricted likelihood (Patterson & Thompson 1971), exact where one factor scales all
    /// variances: ½ tr S⁻¹ ∂S/∂ln σ² of each counts by the share of the measurements that is not taken up.
    pub(crate) fn restricted_noise_score(&self, parameters: usize) -> Vector4<f64> {
        let (measured, fitted) = self.measured_and_fitted(parameters);
        // Of many measurements the share is below what is known of the noise. Where some are rejected the
        // noise would grow without end.
        let share = (fitted / measured).min(1.0);
        let taken = if self.outliers.is_empty() && share > COMMON.min_restricted_share { share } else { 0.0 };
        // The rows of the information add up to the traces, as the variances do to S.
        self.noise.gradient - self.noise.information * Vector4::repeat(taken)
    }

    /// How many numbers were measured, and how many are fitted to them beside so many parameters: start
    /// headings, and the groups' own instruments.
    fn measured_and_fitted(&self, parameters: usize) -> (f64, f64) {
        let own: usize = self.own.iter().map(GroupResponse::columns).sum();
        let headings = self.headings.len() as f64;
        let measured = self.runs.iter().map(|run| run.count).sum::<f64>() + headings;
        (measured.max(1.0), (parameters + own) as f64 + headings)
    }

    /// Whether so many parameters explain all that was measured, so that no scatter shows.
    pub(crate) fn shows_no_scatter(&self, parameters: usize) -> bool {
        let (measured, fitted) = self.measured_and_fitted(parameters);
        // Numbers are means over phases.
        measured < fitted + 0.5
    }

    /// Of no run.
    pub(crate) fn nothing() -> Self {
        Self {
            runs: Vec::new(),
            innovations: Arc::default(),
            samples: Vec::new(),
            outliers: Vec::new(),
            partial_outliers: Vec::new(),
            noise: NoiseScore::zero(),
            timing: TimingScore::default(),
            headings: Vec::new(),
            own: Vec::new(),
            cached: None,
        }
    }
}

/// Runs the filter over all selections.
pub(crate) fn pass(
    records: &Records<'_>,
    selections: &[Selection],
    model: &Model,
    noise: &Noise,
    free_headings: &[f64],
    terms: &mut [Box<dyn ModelTerm>],
    pass_options: PassOptions<'_>,
) -> Pass {
    let parameters = terms.iter().map(|term| term.parameters().len()).sum::<usize>();
    // Where groups have instruments of their own, these are columns to solve for, too.
    let free = pass_options.free.filter(|_| model.own.is_none());
    let layout = Layout::of(&pass_options, parameters, model.own.is_some());
    let columns = layout.columns_of_equations();
    let segment_filter = SegmentFilter {
        records,
        runs: runs(&records.segments),
        model,
        noise,
        free_headings,
        products: Products::of(layout, pass_options.parts, free),
        reused: pass_options.by.map(|cached| (cached, cached.change_to(model))),
        has_memory: !terms.is_empty() || pass_options.samples,
        weight: 1.0 / selections.len() as f64,
        pass_options,
    };
    let SegmentFilter { runs, weight, .. } = &segment_filter;
    let mut result = Pass::nothing();
    result.runs =
        runs.iter().map(|segments| NormalEquations::new(records.segments[segments.start].run, columns)).collect();
    let mut phases = Vec::with_capacity(selections.len());
    let mut outliers = Vec::with_capacity(selections.len());
    let mut innovations_by_phase = Vec::new();
    let mut repeated: Vec<Option<Vec<FilteredSegment>>> = vec![None; runs.len()];
    for (number, selection) in selections.iter().enumerate() {
        let repetitions = runs.iter().map(|run| Selection::times_in_a_row(&selections[number..], run)).collect();
        let phase = Phase { number, propagations: &selection.propagations, repetitions, repeated: &repeated };
        let mut found = segment_filter.filter(&phase, &mut result.runs, terms);
        let repetitions = phase.repetitions;
        for ((found, repeated), times) in found.iter_mut().zip(&mut repeated).zip(repetitions) {
            if let Some(repeated) = repeated.take() {
                *found = repeated;
            }
            *repeated = (times > 1).then(|| found.clone());
        }
        let PhaseResult { innovations, outliers: rejected, cached } =
            segment_filter.add_phase(&mut result, number, found);
        outliers.push(rejected);
        phases.push(cached);
        if pass_options.innovations {
            innovations_by_phase.push(innovations);
        }
    }
    let with_partial = selections.iter().zip(&outliers).filter(|_| records.has_partial());
    for (phase, (selection, rejected)) in with_partial.enumerate() {
        let poses = TakenPoses::of(&records.segments, free_headings, &selection.propagations, rejected);
        // Partial measurements have derivatives by all columns.
        let products = Products::of(Layout::whole(parameters), pass_options.parts, free);
        let pass = PartialPass { poses: &poses, gate: pass_options.gate, model, noise, products: &products };
        let found = add_partial(&mut result, records, selection, *weight, pass, terms);
        if phase == 0 {
            result.partial_outliers = found;
        }
    }
    result.innovations = Arc::new(innovations_by_phase);
    result.outliers = outliers.into_iter().next().unwrap_or_default();
    result.cached = pass_options.keep.then(|| CachedPropagation { model: model.clone(), phases });
    if let Some(own) = &model.own {
        result.own = own.eliminate(&mut result.runs, model);
    }
    result
}

type Terms = [Box<dyn ModelTerm>];

/// Filters segments: what all of them share.
struct SegmentFilter<'p, 'r> {
    records: &'p Records<'r>,
    /// The segments of each run.
    runs: Vec<Range<usize>>,
    model: &'p Model,
    noise: &'p Noise,
    free_headings: &'p [f64],
    products: Products,
    /// Cached propagations, and how the model has changed since.
    reused: Option<(&'p CachedPropagation, Change)>,
    /// Terms and samples remember what was driven before.
    has_memory: bool,
    /// Of a phase.
    weight: f64,
    pass_options: PassOptions<'p>,
}

/// One phase of a pass.
struct Phase<'s> {
    number: usize,
    propagations: &'s [Vec<PropagationInterval>],
    /// How many phases from this one on take the same of each run: it is filtered once for them.
    repetitions: Vec<usize>,
    /// Of each run in the phase before, where this phase takes the same of it.
    repeated: &'s [Option<Vec<FilteredSegment>>],
}

/// What a phase gives that is not summed over phases.
struct PhaseResult {
    innovations: Vec<InnovationComponent>,
    /// Segment and measurement.
    outliers: Vec<(usize, usize)>,
    /// By segment, where propagations are kept.
    cached: Vec<Option<Arc<SegmentCache>>>,
}

impl SegmentFilter<'_, '_> {
    /// Filters the segments of a phase, each run's with its equations. Sums are taken in the order of the
    /// segments whichever way they go. Runs that are repeated give nothing.
    fn filter(
        &self,
        phase: &Phase<'_>,
        equations: &mut [NormalEquations],
        terms: &mut Terms,
    ) -> Vec<Vec<FilteredSegment>> {
        let Self { runs, weight, .. } = self;
        let work = |propagation: &PropagationInterval| {
            if self.pass_options.by.is_some() { 1 } else { propagation.intervals.len().max(1) }
        };
        let new = runs.iter().zip(phase.repeated).filter(|(_, repeated)| repeated.is_none());
        let work_of = |run: &Range<usize>| phase.propagations[run.clone()].iter().flatten().map(work).sum::<usize>();
        let at_once = new.map(|(run, _)| work_of(run)).sum::<usize>() >= MIN_PARALLEL_WORK;
        if at_once && !self.has_memory {
            let is_repeated = |segment: usize| phase.repeated[runs.partition_point(|run| run.end <= segment)].is_some();
            let of = |number: usize| {
                (!phase.propagations[number].is_empty() && !is_repeated(number))
                    .then(|| self.filter_segment(phase, number, &mut [], &mut None))
            };
            let mut ready: Vec<_> = (0..phase.propagations.len()).into_par_iter().map(of).collect();
            let in_run = |((segments, equations), times): ((&Range<usize>, &mut NormalEquations), &usize)| {
                let ready = ready[segments.clone()].iter_mut().filter_map(Option::take);
                let (summands, found): (Vec<_>, Vec<_>) = ready.unzip();
                for _ in 0..*times {
                    summands.iter().for_each(|summand| equations.add(summand, *weight));
                }
                found
            };
            return runs.iter().zip(equations).zip(&phase.repetitions).map(in_run).collect();
        }
        // Segments of a run follow each other, as terms have a state; each run starts anew.
        let in_run = |terms: &mut Terms, (run, equations): (usize, &mut NormalEquations)| {
            let mut carried: Option<CarriedState> = None;
            let (mut found, mut summands) = (Vec::with_capacity(runs[run].len()), Vec::new());
            if phase.repeated[run].is_some() {
                return found;
            }
            for number in runs[run].clone() {
                let unobservable = phase.propagations[number].is_empty();
                // The state of terms, and what samples hold, go on over displacements that are not taken.
                let remember = self.has_memory && self.pass_options.by.is_none();
                if unobservable && (!remember || self.records.segments[number].start == Start::MeasuredPose) {
                    continue;
                }
                let (summand, filtered) = self.filter_segment(phase, number, terms, &mut carried);
                if unobservable {
                    continue;
                }
                // Those of many displacements are large: kept only where they are repeated.
                if phase.repetitions[run] == 1 {
                    equations.add(&summand, *weight);
                } else {
                    summands.push(summand);
                }
                found.push(filtered);
            }
            for _ in 0..phase.repetitions[run] {
                summands.iter().for_each(|summand| equations.add(summand, *weight));
            }
            found
        };
        if at_once {
            let each = equations.par_iter_mut().enumerate();
            each.map_init(|| terms.to_vec(), |terms, run| in_run(terms, run)).collect()
        } else {
            equations.iter_mut().enumerate().map(|run| in_run(terms, run)).collect()
        }
    }

    /// Filters a segment: its normal equation, and what else it gives.
    fn filter_segment(
        &self,
        phase: &Phase<'_>,
        number: usize,
        terms: &mut Terms,
        carried: &mut Option<CarriedState>,
    ) -> (NormalEquations, FilteredSegment) {
        let segment = &self.records.segments[number];
        let propagations = &phase.propagations[number];
        let mut filter = Filter::new(segment, number, self.model, self.noise, &self.products, terms, self.pass_options);
        if let Some(carried) = carried.take().filter(|_| segment.continues) {
            filter.carry_on(carried);
        }
        if let Some((cached, change)) = &self.reused {
            filter.take_propagations(cached.reused(phase.number, number, change));
        } else if self.pass_options.keep {
            filter.take_propagations(PropagationSource::cached(propagations.len(), self.products.layout().parameters));
        }
        let free_heading_rad = self.free_headings[number];
        // Loops over a dozen columns: eight at a time leave more over than they save.
        InstructionSet::Avx2.run(FilterRun { filter: &mut filter, propagations, free_heading_rad });
        *carried = Some(filter.carried());
        let samples = std::mem::take(&mut filter.samples);
        let timing = filter.timing;
        let (sums, outliers, innovations, noise_score, cached) = filter.into_parts();
        let (equations, heading) = sums.eliminated(segment.run);
        let cached = cached.map(Arc::new);
        (equations, FilteredSegment { number, heading, innovations, samples, outliers, noise_score, timing, cached })
    }

    /// Adds what the segments of a phase give beside their equations.
    fn add_phase(&self, result: &mut Pass, phase: usize, found: Vec<Vec<FilteredSegment>>) -> PhaseResult {
        let Self { records, weight, pass_options: PassOptions { keep, samples: with_samples, .. }, .. } = self;
        let reused = found.iter().flatten().map(|of| of.innovations.len()).sum();
        let mut innovations = Vec::with_capacity(reused);
        let mut samples = Vec::new();
        let mut cached = vec![None; if *keep { records.segments.len() } else { 0 }];
        let mut outliers = Vec::new();
        for of in found.into_iter().flatten() {
            if *keep {
                cached[of.number] = of.cached;
            }
            innovations.extend(of.innovations);
            samples.extend(of.samples);
            outliers.extend(of.outliers.into_iter().map(|measurement| (of.number, measurement)));
            if let (0, Some(response)) = (phase, of.heading) {
                let run = records.segments[of.number].run;
                result.headings.push(FreeHeading { segment: of.number, run, response });
            }
            result.noise.add(&of.noise_score, *weight);
            result.timing.add(&of.timing, *weight);
        }
        if *with_samples {
            result.samples.push(samples);
        }
        PhaseResult { innovations, outliers, cached }
    }
}

/// Adds the partial measurements to the normal equations of their runs, and what is known of the gyroscope's
/// scale to that of the first run which has one. Gives the outliers.
fn add_partial(
    result: &mut Pass,
    records: &Records<'_>,
    selection: &Selection,
    weight: f64,
    pass: PartialPass<'_>,
    terms: &[Box<dyn ModelTerm>],
) -> Vec<(usize, usize)> {
    let columns = Column::BASE.len() + terms.iter().map(|term| term.parameters().len()).sum::<usize>();
    let mut prior = Some(records.gyro_scale_prior_sigma().powi(-2));
    let filtered = |gate: OutlierGate| -> Vec<Option<Filtered>> {
        let of_segment = |terms: &mut Vec<Box<dyn ModelTerm>>,
                          of: (&PartialSegment<'_>, &Option<Vec<PropagationInterval>>)| {
            Some(filter_partial(of.0, of.1.as_ref()?, &PartialPass { gate, ..pass }, terms))
        };
        let segments = records.partial.par_iter().zip(&selection.partial);
        segments.map_init(|| terms.to_vec(), of_segment).collect()
    };
    let mut found = filtered(pass.gate);
    if most_of_a_kind_are_outliers(&records.partial, &found) {
        found = filtered(OutlierGate::Off);
    }
    // Sums are taken in the order of the segments.
    let mut all_outliers = Vec::new();
    for (number, (partial, found)) in records.partial.iter().zip(found).enumerate() {
        let Some(Filtered { equations, score, outliers }) = found else { continue };
        all_outliers.extend(outliers.into_iter().map(|observation| (number, observation)));
        let run = partial.segment.run;
        let at = result.runs.partition_point(|of| of.run < run);
        if result.runs.get(at).is_none_or(|of| of.run != run) {
            result.runs.insert(at, NormalEquations::new(run, columns));
        }
        result.runs[at].add(&equations, weight);
        result.noise.add(&score, weight);
        if let Some(precision) = prior.take_if(|_| partial.has_gyro()) {
            let scale = Column::GyroScale.index();
            result.runs[at].information[(scale, scale)] += weight * precision;
            result.runs[at].gradient[scale] += weight * precision * pass.model.gyro_scale;
            result.runs[at].chi_square += weight * precision * pass.model.gyro_scale.powi(2);
        }
    }
    all_outliers
}

/// Whether more than half of the partial measurements of some kind are outliers. They contradict the model
/// then, and no gate hides it.
fn most_of_a_kind_are_outliers(partial: &[PartialSegment<'_>], found: &[Option<Filtered>]) -> bool {
    // How many there are of a kind, and how many of them are outliers.
    let mut kinds: Vec<(Discriminant<Quantity>, [usize; 2])> = Vec::new();
    let with_outliers = || partial.iter().zip(found).filter_map(|(of, found)| Some((of, &found.as_ref()?.outliers)));
    if with_outliers().all(|(_, outliers)| outliers.is_empty()) {
        return false;
    }
    for (of, outliers) in with_outliers() {
        for (number, observation) in of.observations.iter().enumerate() {
            let kind = discriminant(&observation.quantity);
            let counts = [1, usize::from(outliers.contains(&number))];
            match kinds.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, all)) => (0..2).for_each(|k| all[k] += counts[k]),
                None => kinds.push((kind, counts)),
            }
        }
    }
    kinds.iter().any(|(_, [all, outliers])| 2 * outliers > *all)
}

/// The segments of each run, which are consecutive.
fn runs(segments: &[Segment<'_>]) -> Vec<Range<usize>> {
    let mut start = 0;
    let of = |segments: &[Segment<'_>]| {
        let run = start..start + segments.len();
        start = run.end;
        run
    };
    segments.chunk_by(|a, b| a.run == b.run).map(of).collect()
}

/// What one segment gives in one phase, beside its normal equation.
#[derive(Clone)]
struct FilteredSegment {
    number: usize,
    heading: Option<HeadingResponse>,
    innovations: Vec<InnovationComponent>,
    samples: Vec<KinematicSample>,
    outliers: Vec<usize>,
    noise_score: NoiseScore,
    timing: TimingScore,
    cached: Option<Arc<SegmentCache>>,
}
