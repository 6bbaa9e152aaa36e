//! Which measurements the likelihood takes: all of them, or some whose errors are not autocorrelated.
//!
//! The errors of a tracking instrument often last for seconds: lens distortion, the marker's frame, a filter
//! inside. A likelihood that takes such measurements for independent fits the wheels to them. Thinning takes
//! measurements at a spacing. It is repeated in several phases, each shifted by a share of the spacing, and
//! the costs are averaged, so that no measurement is lost (composite likelihood).
//!
//! Poses between two that are taken are passed over, and the motion between these two is whole. A
//! displacement that is passed over is lost to its phase, with its motion; other phases take it.
//! Reference: Varin, Reid & Firth 2011.

use std::ops::Range;

use kinematics::Side;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::covariances::{Covariance, Covariances};
use crate::model::Model;
use crate::noise::NoiseComponent;
use crate::partial_observation::Place;
use crate::partial_records::PartialSegment;
use crate::records::Records;
use crate::segment::{Segment, Start};
use crate::settings::{COMMON, TIME_TOLERANCE_S};

/// How measurements are thinned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thinning {
    /// Least time between two measurements, seconds; 0 for all.
    pub every_s: f64,
    /// In how many phases.
    pub phases: usize,
}

impl Thinning {
    /// Every measurement.
    pub const NONE: Self = Self { every_s: 0.0, phases: 1 };
}

/// The motion from one measurement to the next that is taken.
#[derive(Debug, Clone)]
pub(crate) struct PropagationInterval {
    pub(crate) intervals: Range<usize>,
    /// The measurement before; 0 for a displacement.
    pub(crate) from: usize,
    pub(crate) measurement: usize,
    /// Covariance of the motion, in the frame of the body at its start, for a wheel noise of 1 m²/m and for a
    /// turn noise of 1 rad²/rad.
    pub(crate) noise: Covariances<2>,
    /// Covariance of the motion for what is restored of lost counts; `None` where none is.
    pub(crate) restored: Option<Box<Covariance>>,
}

impl PropagationInterval {
    /// Are both of the same measurements of a segment? Then they are the same.
    fn is_of_same(&self, other: &Self) -> bool {
        (&self.intervals, self.from, self.measurement) == (&other.intervals, other.from, other.measurement)
    }
}

/// The measurements taken in one phase.
#[derive(Debug, Clone)]
pub struct Selection {
    /// For each segment its propagation intervals; without any, the segment has no part in the phase.
    pub(crate) propagations: Vec<Vec<PropagationInterval>>,
    /// For each partial segment its propagation intervals, which lead from place to place; `None` where it
    /// has no part in the phase.
    pub(crate) partial: Vec<Option<Vec<PropagationInterval>>>,
}

impl Selection {
    /// The selections of all phases; propagation noise is that of the `nominal` drive.
    #[must_use]
    pub fn of(records: &Records<'_>, thinning: Thinning, nominal: &Model) -> Vec<Self> {
        let partial: Vec<_> = records.partial.iter().map(|of| Some(between_places(of, nominal))).collect();
        let offset = |phase: usize| phase as f64 / thinning.phases as f64;
        let all_series: Vec<&[Segment<'_>]> = records.segments.chunk_by(Segment::is_in_series_with).collect();
        let of_series = |series: &[Segment<'_>], phase: usize| -> Vec<_> {
            let taken = taken_of_series(series, thinning.every_s, offset(phase));
            series.iter().zip(taken).map(|(segment, taken)| propagations(segment, &taken, nominal)).collect()
        };
        let of_phase = |phase: usize| Self {
            partial: partial.clone(),
            propagations: all_series.par_iter().flat_map_iter(|series| of_series(series, phase)).collect(),
        };
        (0..thinning.phases).into_par_iter().map(of_phase).collect()
    }

    /// One of several blocks of each run: by its segments where it has as many, else by the measurements of
    /// each.
    pub(crate) fn block(&self, records: &Records<'_>, block: usize, blocks: usize) -> Self {
        let mut propagations = vec![Vec::new(); self.propagations.len()];
        let mut first = 0;
        for run in records.segments.chunk_by(|a, b| a.run == b.run) {
            let of = first..first + run.len();
            first = of.end;
            let share = |of: usize| block * of / blocks..(block + 1) * of / blocks;
            if run.len() >= blocks {
                let part = of.start + share(run.len()).start..of.start + share(run.len()).end;
                propagations[part.clone()].clone_from_slice(&self.propagations[part]);
            } else {
                for segment in of {
                    propagations[segment] =
                        self.propagations[segment][share(self.propagations[segment].len())].to_vec();
                }
            }
        }
        // A run's partial measurements hang together: all stand in its first block.
        let partial = if block == 0 { self.partial.clone() } else { vec![None; self.partial.len()] };
        Self { propagations, partial }
    }

    /// How many of the phases, from the first on, take the same measurements of some segments.
    pub(crate) fn times_in_a_row(phases: &[Self], segments: &Range<usize>) -> usize {
        let is_as_first = |phase: &&Self| {
            let mut pairs = segments.clone().map(|at| (&phases[0].propagations[at], &phase.propagations[at]));
            pairs.all(|(a, b)| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.is_of_same(b)))
        };
        phases.iter().take_while(is_as_first).count()
    }

    /// Does it take no measurement?
    pub(crate) fn is_empty(&self) -> bool {
        self.propagations.iter().all(Vec::is_empty) && self.partial.iter().all(Option::is_none)
    }

    /// Whether integrating the propagations, with terms or without, takes so long that caching them is worth
    /// it. With that many intervals a standard deviation is so small a step that cached propagations follow
    /// it to first order.
    pub(crate) fn has_long_propagations(all: &[Self], with_terms: bool) -> bool {
        let propagations = || all.iter().flat_map(|selection| &selection.propagations).flatten();
        let intervals: usize = propagations().map(|propagation| propagation.intervals.len()).sum();
        let least = if with_terms { 1 } else { COMMON.min_intervals_per_cached_propagation };
        intervals >= COMMON.min_cached_intervals && intervals >= least * propagations().count()
    }

    /// Mean number of measurements of a series that has any, without its start. A series is a segment of
    /// poses, or the displacements of one run.
    #[must_use]
    pub fn mean_measurements(&self, records: &Records<'_>) -> f64 {
        let (mut series, mut measurements) = (0.0, 0.0);
        let mut first = 0;
        for segments in records.segments.chunk_by(Segment::is_in_series_with) {
            let of = first..first + segments.len();
            first = of.end;
            let taken = self.propagations[of].iter().map(Vec::len).sum::<usize>();
            if taken > 0 {
                series += 1.0;
                let taken = taken as f64;
                measurements += taken;
            }
        }
        if series > 0.0 { measurements / series } else { 0.0 }
    }
}

/// The measurements taken of each segment of a series.
fn taken_of_series(series: &[Segment<'_>], every_s: f64, offset: f64) -> Vec<Vec<usize>> {
    match series {
        [first, ..] if first.is_displacement() => displacements_taken(series, every_s, offset),
        _ => series.iter().map(|segment| taken(segment, every_s, offset)).collect(),
    }
}

/// The displacements that are taken. None ends sooner than `every_s` after the one before. The first ends
/// later than the run's first by the share `offset` of `every_s`. A run that has none left gives its last.
fn displacements_taken(series: &[Segment<'_>], every_s: f64, offset: f64) -> Vec<Vec<usize>> {
    let end_s = |segment: &Segment<'_>| segment.measurements.first().map(|measurement| measurement.t_s);
    let mut due_s = series.first().and_then(end_s).map_or(0.0, |first_s| first_s + every_s * offset);
    let mut taken: Vec<Vec<usize>> = series
        .iter()
        .map(|segment| match end_s(segment) {
            Some(end_s) if every_s == 0.0 || end_s >= due_s - TIME_TOLERANCE_S => {
                due_s = end_s + every_s;
                vec![0]
            }
            _ => Vec::new(),
        })
        .collect();
    if taken.iter().all(Vec::is_empty)
        && let Some(last) = taken.last_mut()
    {
        last.push(0);
    }
    taken
}

/// The measurements of a segment that are taken after its first. None is nearer than `every_s` to the one
/// before, and the first is later by the share `offset` of `every_s`. The last is always taken, in the place
/// of one that is too near to it.
fn taken(segment: &Segment<'_>, every_s: f64, offset: f64) -> Vec<usize> {
    let (Some(start), Some(last)) = (segment.measurements.first(), segment.measurements.last()) else {
        return Vec::new();
    };
    if every_s == 0.0 {
        return (1..segment.measurements.len()).collect();
    }
    let mut due_s = start.t_s + every_s * (1.0 + offset);
    let mut taken = Vec::new();
    for (number, measurement) in segment.measurements.iter().enumerate().skip(1) {
        if measurement.t_s >= due_s - TIME_TOLERANCE_S {
            taken.push(number);
            due_s = measurement.t_s + every_s;
        }
    }
    while taken.last().is_some_and(|number| last.t_s - segment.measurements[*number].t_s < every_s) {
        taken.pop();
    }
    taken.push(segment.measurements.len() - 1);
    taken
}

fn propagations(segment: &Segment<'_>, taken: &[usize], nominal: &Model) -> Vec<PropagationInterval> {
    let mut before = 0;
    let mut from = if segment.start == Start::MeasuredPose {
        segment.measurements.first().map_or(0, |measurement| measurement.after)
    } else {
        0
    };
    taken
        .iter()
        .map(|&measurement| {
            let intervals = from..segment.measurements[measurement].after;
            from = intervals.end;
            let (noise, restored) = noise(segment, intervals.clone(), nominal);
            let propagation = PropagationInterval { noise, restored, intervals, from: before, measurement };
            before = measurement;
            propagation
        })
        .collect()
}

/// The motions from place to place.
fn between_places(partial: &PartialSegment<'_>, nominal: &Model) -> Vec<PropagationInterval> {
    let between = |(number, pair): (usize, &[Place])| {
        let intervals = pair[0].after..pair[1].after;
        let (noise, restored) = noise(&partial.segment, intervals.clone(), nominal);
        PropagationInterval { noise, restored, intervals, from: number, measurement: number + 1 }
    };
    partial.places.windows(2).enumerate().map(between).collect()
}

/// Covariance of a propagation interval's motion for unit noises, and that for what is restored of lost
/// counts, by the nominal drive: the geometry must not be estimated by its effect on covariances.
fn noise(segment: &Segment<'_>, intervals: Range<usize>, nominal: &Model) -> (Covariances<2>, Option<Box<Covariance>>) {
    let mut noise = Covariances::ZERO;
    let mut restored: Option<Box<Covariance>> = None;
    let mut theta_rad = 0.0;
    for interval in &segment.intervals[intervals] {
        let travel_m = nominal.m_per_rad.zip_with(interval.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
        let (distance_m, turn_rad) =
            (0.5 * (travel_m.left + travel_m.right), (travel_m.right - travel_m.left) / nominal.separation_m);
        let (sin, cos) = (theta_rad + 0.5 * turn_rad).sin_cos();
        let (dx_m, dy_m) = (distance_m * cos, distance_m * sin);
        noise.carry(-dy_m, dx_m);
        if let Some(restored) = &mut restored {
            restored.carry(-dy_m, dx_m);
        }
        // ∂(x, y, θ)/∂(travel of the left and the right wheel) at the middle of the step; the turn acts on
        // half of the distance.
        for (side, sense) in [(Side::Left, -1.0), (Side::Right, 1.0)] {
            let by_turn = sense / nominal.separation_m;
            let column = Vector3::new(0.5 * (cos - dy_m * by_turn), 0.5 * (sin + dx_m * by_turn), by_turn);
            noise.add_outer(NoiseComponent::Wheel as usize, &column, travel_m[side].abs());
            let restored_rad2 = interval.restored_rad2[side];
            if restored_rad2 > 0.0 {
                let variance_m2 = restored_rad2 * nominal.m_per_rad[side].powi(2);
                restored.get_or_insert_with(|| Box::new(Covariance::ZERO)).add_outer(0, &column, variance_m2);
            }
        }
        let column = Vector3::new(-0.5 * dy_m, 0.5 * dx_m, 1.0);
        noise.add_outer(NoiseComponent::Turn as usize, &column, turn_rad.abs());
        theta_rad += turn_rad;
    }
    (noise, restored)
}
