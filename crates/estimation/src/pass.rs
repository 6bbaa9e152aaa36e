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
use crate::partial_poses::TakenPoses;
use crate::partial_records::PartialSegment;
use crate::pass_options::{OutlierGate, PassOptions};
use crate::products::{HeadingResponse, Products};
use crate::propagation::{CachedPropagation, CarriedState, PropagationSource, SegmentCache};
use crate::records::Records;
use crate::segment::{Segment, Start};
use crate::settings::{MIN_PARALLEL_WORK, MIN_RESTRICTED_SHARE};
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
        let taken = if self.outliers.is_empty() && share > MIN_RESTRICTED_SHARE { share } else { 0.0 };
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
    let products = Products::of(layout, pass_options.parts, free);
    let mut result = Pass::nothing();
    let weight = 1.0 / selections.len() as f64;
    let runs = runs(&records.segments);
    result.runs =
        runs.iter().map(|segments| NormalEquations::new(records.segments[segments.start].run, columns)).collect();
    // Terms and samples remember what was driven before.
    let has_memory = !terms.is_empty() || pass_options.samples;
    let reused = pass_options.by.map(|cached| (cached, cached.change_to(model)));
    let of_segment = |(phase, number): (usize, usize),
                      propagations: &[PropagationInterval],
                      terms: &mut [Box<dyn ModelTerm>],
                      carried: &mut Option<CarriedState>| {
        let segment = &records.segments[number];
        let mut filter = Filter::new(segment, number, model, noise, &products, terms, pass_options);
        if let Some(carried) = carried.take().filter(|_| segment.continues) {
            filter.carry_on(carried);
        }
        if let Some((cached, change)) = &reused {
            filter.take_propagations(cached.reused(phase, number, change));
        } else if pass_options.keep {
            filter.take_propagations(PropagationSource::cached(propagations.len(), parameters));
        }
        let free_heading_rad = free_headings[number];
        // Loops over a dozen columns: eight at a time leave more over than they save.
        InstructionSet::Avx2.run(FilterRun { filter: &mut filter, propagations, free_heading_rad });
        *carried = Some(filter.carried());
        let samples = std::mem::take(&mut filter.samples);
        let timing = filter.timing;
        let (sums, outliers, innovations, noise_score, cached) = filter.into_parts();
        let (equations, heading) = sums.eliminated(segment.run);
        let cached = cached.map(Arc::new);
        (equations, OfSegment { number, heading, innovations, samples, outliers, noise_score, timing, cached })
    };
    let mut phases = Vec::with_capacity(selections.len());
    let mut outliers = Vec::with_capacity(selections.len());
    let mut innovations_by_phase = Vec::new();
    // Of each run in the phase before, where this phase takes the same of it.
    let mut repeated: Vec<Option<Vec<OfSegment>>> = vec![None; runs.len()];
    for (phase, selection) in selections.iter().enumerate() {
        let propagations = &selection.propagations;
        // How many phases from this one on take the same of a run: it is filtered once for them.
        let times: Vec<usize> = runs.iter().map(|run| Selection::times_in_a_row(&selections[phase..], run)).collect();
        let of_run = |number_of_run: usize, equations: &mut NormalEquations, terms: &mut [Box<dyn ModelTerm>]| {
            let mut carried: Option<CarriedState> = None;
            let segments = &runs[number_of_run];
            let (mut found, mut own) = (Vec::with_capacity(segments.len()), Vec::new());
            if repeated[number_of_run].is_some() {
                return found;
            }
            for number in segments.clone() {
                let unobservable = propagations[number].is_empty();
                // The state of terms, and what samples hold, go on over displacements that are not taken.
                let remember = has_memory && pass_options.by.is_none();
                if unobservable && (!remember || records.segments[number].start == Start::MeasuredPose) {
                    continue;
                }
                let (own_equations, of_segment) =
                    of_segment((phase, number), &propagations[number], terms, &mut carried);
                if !unobservable {
                    // Those of many displacements are large: kept only where they are repeated.
                    if times[number_of_run] == 1 {
                        equations.add(&own_equations, weight);
                    } else {
                        own.push(own_equations);
                    }
                    found.push(of_segment);
                }
            }
            for _ in 0..times[number_of_run] {
                own.iter().for_each(|own| equations.add(own, weight));
            }
            found
        };
        // Sums are taken in the order of the segments whichever way they go.
        let work = |propagation: &PropagationInterval| {
            if pass_options.by.is_some() { 1 } else { propagation.intervals.len().max(1) }
        };
        let new = runs.iter().zip(&repeated).filter(|(_, repeated)| repeated.is_none());
        let work_of = |run: &Range<usize>| propagations[run.clone()].iter().flatten().map(work).sum::<usize>();
        let at_once = new.map(|(run, _)| work_of(run)).sum::<usize>() >= MIN_PARALLEL_WORK;
        let mut found: Vec<Vec<OfSegment>> = if at_once && !has_memory {
            let is_repeated = |segment: usize| repeated[runs.partition_point(|run| run.end <= segment)].is_some();
            let of = |number: usize| {
                (!propagations[number].is_empty() && !is_repeated(number))
                    .then(|| of_segment((phase, number), &propagations[number], &mut [], &mut None))
            };
            let mut ready: Vec<_> = (0..propagations.len()).into_par_iter().map(of).collect();
            let in_run = |((segments, equations), times): ((&Range<usize>, &mut NormalEquations), &usize)| {
                let ready = ready[segments.clone()].iter_mut().filter_map(Option::take);
                let (own, found): (Vec<_>, Vec<_>) = ready.unzip();
                for _ in 0..*times {
                    own.iter().for_each(|own| equations.add(own, weight));
                }
                found
            };
            runs.iter().zip(&mut result.runs).zip(&times).map(in_run).collect()
        } else if at_once {
            // Segments of a run follow each other, as terms have a state; each run starts anew.
            let in_run = |terms: &mut Vec<Box<dyn ModelTerm>>, (number, equations): (usize, &mut NormalEquations)| {
                of_run(number, equations, terms)
            };
            result.runs.par_iter_mut().enumerate().map_init(|| terms.to_vec(), in_run).collect()
        } else {
            result.runs.iter_mut().enumerate().map(|(number, equations)| of_run(number, equations, terms)).collect()
        };
        for ((found, repeated), times) in found.iter_mut().zip(&mut repeated).zip(times) {
            if let Some(repeated) = repeated.take() {
                *found = repeated;
            }
            *repeated = (times > 1).then(|| found.clone());
        }
        let reused = found.iter().flatten().map(|of| of.innovations.len()).sum();
        let mut innovations = Vec::with_capacity(reused);
        let mut samples = Vec::new();
        let mut cached = vec![None; if pass_options.keep { propagations.len() } else { 0 }];
        let mut rejected = Vec::new();
        for of in found.into_iter().flatten() {
            if pass_options.keep {
                cached[of.number] = of.cached;
            }
            innovations.extend(of.innovations);
            samples.extend(of.samples);
            rejected.extend(of.outliers.into_iter().map(|measurement| (of.number, measurement)));
            if let (0, Some(response)) = (phase, of.heading) {
                let run = records.segments[of.number].run;
                result.headings.push(FreeHeading { segment: of.number, run, response });
            }
            result.noise.add(&of.noise_score, weight);
            result.timing.add(&of.timing, weight);
        }
        outliers.push(rejected);
        phases.push(cached);
        if pass_options.innovations {
            innovations_by_phase.push(innovations);
        }
        if pass_options.samples {
            result.samples.push(samples);
        }
    }
    let with_partial = selections.iter().zip(&outliers).filter(|_| records.has_partial());
    for (phase, (selection, rejected)) in with_partial.enumerate() {
        let poses = TakenPoses::of(&records.segments, free_headings, &selection.propagations, rejected);
        let part = (records, selection, weight);
        // Partial measurements have derivatives by all columns.
        let products = Products::of(Layout::whole(parameters), pass_options.parts, free);
        let found = add_partial(&mut result, part, (&poses, pass_options.gate), (model, noise), &products, terms);
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

/// Adds the partial measurements to the normal equations of their runs, and what is known of the gyroscope's
/// scale to that of the first run which has one. Gives the outliers.
fn add_partial(
    result: &mut Pass,
    (records, selection, weight): (&Records<'_>, &Selection, f64),
    (poses, gate): (&TakenPoses<'_>, OutlierGate),
    (model, noise): (&Model, &Noise),
    products: &Products,
    terms: &[Box<dyn ModelTerm>],
) -> Vec<(usize, usize)> {
    let columns = Column::BASE.len() + terms.iter().map(|term| term.parameters().len()).sum::<usize>();
    let mut prior = Some(records.gyro_scale_prior_sigma().powi(-2));
    let filtered = |gate: OutlierGate| -> Vec<Option<Filtered>> {
        let of_segment = |terms: &mut Vec<Box<dyn ModelTerm>>,
                          of: (&PartialSegment<'_>, &Option<Vec<PropagationInterval>>)| {
            Some(filter_partial(of.0, (of.1.as_ref()?, gate), poses, (model, noise), products, terms))
        };
        let segments = records.partial.par_iter().zip(&selection.partial);
        segments.map_init(|| terms.to_vec(), of_segment).collect()
    };
    let mut found = filtered(gate);
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
            result.runs[at].gradient[scale] += weight * precision * model.gyro_scale;
            result.runs[at].chi_square += weight * precision * model.gyro_scale.powi(2);
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
struct OfSegment {
    number: usize,
    heading: Option<HeadingResponse>,
    innovations: Vec<InnovationComponent>,
    samples: Vec<KinematicSample>,
    outliers: Vec<usize>,
    noise_score: NoiseScore,
    timing: TimingScore,
    cached: Option<Arc<SegmentCache>>,
}
