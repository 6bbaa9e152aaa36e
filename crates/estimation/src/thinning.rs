//! Which looks the likelihood takes: all, or looks so far apart that their errors have nothing to do with each other.
//!
//! The errors of an instrument that tracks the robot often last for seconds: lens distortion, a marker's own frame, a filter inside. A likelihood that takes such
//! looks one by one believes each, and fits the wheels to the instrument's errors. Thinned looks are honest. What the looks in between know is not thrown away:
//! the same is done in several phases, each shifted by a share of the spacing, and the costs are averaged (a composite likelihood; Varin, Reid & Firth 2011).
//!
//! Of looks, those in between are passed over, and the way from one taken to the next is whole. A displacement cannot be lengthened, as its instrument would err twice:
//! displacements in between are left out, way and all. The other phases take those, all of them where each phase takes one in as many as there are phases, or more.

use nalgebra::Vector3;

use crate::covariances::Covariances;
use crate::model::Model;
use crate::records::{Chain, Records, Start};

/// How looks are thinned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thinning {
    /// Least time between two looks, seconds; 0 for all.
    pub every_s: f64,
    /// In how many phases.
    pub phases: usize,
}

impl Thinning {
    /// Every look.
    pub const NONE: Self = Self { every_s: 0.0, phases: 1 };
}

/// From one look to the next that is taken.
#[derive(Debug, Clone)]
pub(crate) struct Leg {
    pub(crate) pieces: std::ops::Range<usize>,
    /// The look before; 0 for a displacement.
    pub(crate) from: usize,
    pub(crate) look: usize,
    /// Covariance of the motion, in the frame of the body at its start, for a wheel noise of 1 m²/m and for a turn noise of 1 rad²/rad.
    pub(crate) noise: Covariances<2>,
}

/// The looks taken in one phase.
#[derive(Debug, Clone)]
pub struct Selection {
    /// For each chain its legs; without any, the chain has no part in the phase.
    pub(crate) legs: Vec<Vec<Leg>>,
}

impl Selection {
    /// The selections of all phases.
    #[must_use]
    pub fn of(records: &Records<'_>, thinning: Thinning, nominal: &Model) -> Vec<Self> {
        #[allow(clippy::cast_precision_loss)] // a handful of phases
        let offset = |phase: usize| phase as f64 / thinning.phases as f64;
        (0..thinning.phases)
            .map(|phase| Self {
                legs: records
                    .chains
                    .chunk_by(Chain::is_in_series_with)
                    .flat_map(|series| {
                        let taken = taken_of_series(series, thinning.every_s, offset(phase));
                        series.iter().zip(taken).map(|(chain, taken)| legs(chain, &taken, nominal))
                    })
                    .collect(),
            })
            .collect()
    }

    /// One of several blocks of each run: by its chains where it has as many, else by the looks of each.
    pub(crate) fn block(&self, records: &Records<'_>, block: usize, blocks: usize) -> Self {
        let mut legs = vec![Vec::new(); self.legs.len()];
        let mut first = 0;
        for run in records.chains.chunk_by(|a, b| a.run == b.run) {
            let of = first..first + run.len();
            first = of.end;
            let share = |of: usize| block * of / blocks..(block + 1) * of / blocks;
            if run.len() >= blocks {
                let part = of.start + share(run.len()).start..of.start + share(run.len()).end;
                legs[part.clone()].clone_from_slice(&self.legs[part]);
            } else {
                for chain in of {
                    legs[chain] = self.legs[chain][share(self.legs[chain].len())].to_vec();
                }
            }
        }
        Self { legs }
    }

    /// Whether driving the legs takes long, and longer than all else in a pass. So many pieces leave errors so small that legs follow a step of that size to first
    /// order; where few looks are followed over a few pieces, they need not.
    pub(crate) fn has_long_legs(all: &[Self]) -> bool {
        /// Pieces of a leg, on average.
        const LONG: usize = 3;
        /// Pieces in all: some ten milliseconds.
        const MANY: usize = 100_000;
        let legs = || all.iter().flat_map(|selection| &selection.legs).flatten();
        let pieces: usize = legs().map(|leg| leg.pieces.len()).sum();
        pieces >= MANY && pieces >= LONG * legs().count()
    }

    /// How many looks it takes of a series that has any, on average; starts left out. A series is a chain of looks, or the displacements of one run.
    #[must_use]
    pub fn mean_looks(&self, records: &Records<'_>) -> f64 {
        let (mut series, mut looks) = (0.0, 0.0);
        let mut first = 0;
        for chains in records.chains.chunk_by(Chain::is_in_series_with) {
            let of = first..first + chains.len();
            first = of.end;
            let taken = self.legs[of].iter().map(Vec::len).sum::<usize>();
            if taken > 0 {
                series += 1.0;
                #[allow(clippy::cast_precision_loss)]
                let taken = taken as f64;
                looks += taken;
            }
        }
        if series > 0.0 { looks / series } else { 0.0 }
    }
}

/// The looks taken of each chain of a series.
fn taken_of_series(series: &[Chain<'_>], every_s: f64, offset: f64) -> Vec<Vec<usize>> {
    match series {
        [first, ..] if first.is_displacement() => displacements_taken(series, every_s, offset),
        _ => series.iter().map(|chain| taken(chain, every_s, offset)).collect(),
    }
}

/// The displacements that are taken: none ends sooner than `every_s` after the end of the one before, the first later than that of the run by a share of
/// that. A run so short that it has none left gives its last: it is as good as that of any other.
fn displacements_taken(series: &[Chain<'_>], every_s: f64, offset: f64) -> Vec<Vec<usize>> {
    let end_s = |chain: &Chain<'_>| chain.looks.first().map(|look| look.t_s);
    let mut due_s = series.first().and_then(end_s).map_or(0.0, |first_s| first_s + every_s * offset);
    let mut taken: Vec<Vec<usize>> = series
        .iter()
        .map(|chain| match end_s(chain) {
            Some(end_s) if every_s == 0.0 || end_s >= due_s - 1e-9 => {
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

/// The looks of a chain after its first that are taken: none nearer than `every_s` to the one before, the first later by a share of that, and always the last, which takes the
/// place of one that is too near to it.
fn taken(chain: &Chain<'_>, every_s: f64, offset: f64) -> Vec<usize> {
    let (Some(start), Some(last)) = (chain.looks.first(), chain.looks.last()) else { return Vec::new() };
    if every_s == 0.0 {
        return (1..chain.looks.len()).collect();
    }
    let mut due_s = start.t_s + every_s * (1.0 + offset);
    let mut taken = Vec::new();
    for (number, look) in chain.looks.iter().enumerate().skip(1) {
        if look.t_s >= due_s - 1e-9 {
            taken.push(number);
            due_s = look.t_s + every_s;
        }
    }
    while taken.last().is_some_and(|number| last.t_s - chain.looks[*number].t_s < every_s) {
        taken.pop();
    }
    taken.push(chain.looks.len() - 1);
    taken
}

fn legs(chain: &Chain<'_>, taken: &[usize], nominal: &Model) -> Vec<Leg> {
    let mut before = 0;
    let mut from = if chain.start == Start::Seen { chain.looks.first().map_or(0, |look| look.after) } else { 0 };
    taken
        .iter()
        .map(|&look| {
            let pieces = from..chain.looks[look].after;
            from = pieces.end;
            let leg = Leg { noise: noise(chain, pieces.clone(), nominal), pieces, from: before, look };
            before = look;
            leg
        })
        .collect()
}

/// The covariance of a leg's motion for unit noises. It is that of the nominal drive: an estimate of the lengths must not gain by what it does to covariances.
fn noise(chain: &Chain<'_>, pieces: std::ops::Range<usize>, nominal: &Model) -> Covariances<2> {
    const WHEEL: usize = 0;
    const TURN: usize = 1;
    let mut noise = Covariances::ZERO;
    let mut theta_rad = 0.0;
    for piece in &chain.pieces[pieces] {
        let travel_m = nominal.m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
        let (way_m, turn_rad) =
            (0.5 * (travel_m.left + travel_m.right), (travel_m.right - travel_m.left) / nominal.separation_m);
        let (sin, cos) = (theta_rad + 0.5 * turn_rad).sin_cos();
        let (dx_m, dy_m) = (way_m * cos, way_m * sin);
        noise.carry(-dy_m, dx_m);
        // ∂(x, y, θ)/∂(travel of the left and the right wheel) at the middle of the step; the turn acts on half of the way.
        for (side, travel_m) in [(-1.0, travel_m.left), (1.0, travel_m.right)] {
            let by_turn = side / nominal.separation_m;
            let column = Vector3::new(0.5 * (cos - dy_m * by_turn), 0.5 * (sin + dx_m * by_turn), by_turn);
            noise.add_outer(WHEEL, &column, travel_m.abs());
        }
        let column = Vector3::new(-0.5 * dy_m, 0.5 * dx_m, 1.0);
        noise.add_outer(TURN, &column, turn_rad.abs());
        theta_rad += turn_rad;
    }
    noise
}
