//! One pass over all runs: the filter of every chain, and the sums of what they say.

use dataset::ModelTerm;
use rayon::prelude::*;

use super::apart::Follow;
use super::evidence::Evidence;
use super::filter::{Filter, Innovation, NoiseScore, Trail, Want};
use super::model::{Column, Model};
use super::noise::Noise;
use super::records::{Records, Start};
use super::thinning::{Leg, Selection};

/// From so many legs on, which take a millisecond, chains are filtered on all cores.
const LEGS_AT_ONCE: usize = 4096;

/// The result of a pass.
#[derive(Debug, Clone)]
pub struct Pass {
    /// Each run's normal equation, in the order of sessions and runs; averaged over phases.
    pub runs: Vec<Evidence>,
    /// The whitened innovations, phase by phase, in the order of chains and looks.
    pub innovations: Vec<Vec<Innovation>>,
    /// Looks left out as outliers in the first phase: chain and look.
    pub outliers: Vec<(usize, usize)>,
    /// Score of the cost by the logarithms of the variances.
    pub(crate) noise: NoiseScore,
    /// How the free headings of chains without one follow a step of the parameters.
    pub(crate) headings: Vec<FreeHeading>,
    /// How the instruments that groups have for themselves follow one.
    pub(crate) own: Vec<Follow>,
}

/// How the free start heading of a chain follows a step of the parameters.
#[derive(Debug, Clone)]
pub(crate) struct FreeHeading {
    pub(crate) chain: usize,
    pub(crate) run: (usize, usize),
    /// Without one.
    pub(crate) rest: f64,
    /// By each column.
    pub(crate) by: Vec<f64>,
}

impl Pass {
    /// Of no run.
    pub(crate) fn nothing() -> Self {
        Self {
            runs: Vec::new(),
            innovations: Vec::new(),
            outliers: Vec::new(),
            noise: NoiseScore::zero(),
            headings: Vec::new(),
            own: Vec::new(),
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
    want: Want,
) -> Pass {
    let columns = Column::BASE.len() + terms.iter().map(|term| term.parameters().len()).sum::<usize>();
    let mut result = Pass::nothing();
    #[allow(clippy::cast_precision_loss)] // a handful of phases
    let weight = 1.0 / selections.len() as f64;
    let of_chain = |number: usize, legs: &[Leg], terms: &mut [Box<dyn ModelTerm>], trail: &mut Option<Trail>| {
        let chain = &records.chains[number];
        let mut filter = Filter::new(chain, number, model, noise, columns, terms, want);
        if let Some(trail) = trail.take().filter(|_| chain.goes_on) {
            filter.go_on(trail);
        }
        filter.run(legs, free_headings[number]);
        *trail = Some(filter.trail());
        let Filter { sums, outliers, innovations, noise_score, .. } = filter;
        let (evidence, heading) = sums.eliminated(records.chains[number].run, columns);
        OfChain { evidence, heading, innovations, outliers, noise_score }
    };
    for (phase, selection) in selections.iter().enumerate() {
        let legs = &selection.legs;
        // Terms have a state, and go through the chains one after the other. Sums are taken in the order of the chains either way.
        let at_once = terms.is_empty() && legs.iter().map(Vec::len).sum::<usize>() >= LEGS_AT_ONCE;
        let mut ready: Vec<Option<OfChain>> = if at_once {
            let of = |(number, legs): (usize, &Vec<Leg>)| {
                (!legs.is_empty()).then(|| of_chain(number, legs, &mut [], &mut None))
            };
            legs.par_iter().enumerate().map(of).collect()
        } else {
            Vec::new()
        };
        let known = ready.iter().flatten().map(|chain| chain.innovations.len()).sum();
        let mut innovations = Vec::with_capacity(known);
        let mut position = 0;
        let mut trail: Option<Trail> = None;
        for (number, (chain, legs)) in records.chains.iter().zip(legs).enumerate() {
            if phase == 0 && result.runs.last().is_none_or(|run| run.run != chain.run) {
                result.runs.push(Evidence::new(chain.run, columns));
            }
            while result.runs[position].run != chain.run {
                position += 1;
            }
            let unseen = legs.is_empty();
            // Terms remember what was driven on the way to the next displacement, seen or not.
            if unseen && (terms.is_empty() || chain.start == Start::Seen) {
                continue;
            }
            let found = ready.get_mut(number).and_then(Option::take);
            let found = found.unwrap_or_else(|| of_chain(number, legs, terms, &mut trail));
            if unseen {
                continue;
            }
            if want.innovations {
                innovations.extend(found.innovations);
            }
            if phase == 0 {
                result.outliers.extend(found.outliers.into_iter().map(|look| (number, look)));
            }
            if let (0, Some((rest, by))) = (phase, found.heading) {
                result.headings.push(FreeHeading { chain: number, run: chain.run, rest, by });
            }
            result.runs[position].add(&found.evidence, weight);
            result.noise.add(&found.noise_score, weight);
        }
        if want.innovations {
            result.innovations.push(innovations);
        }
    }
    if let Some(own) = &model.own {
        result.own = own.take_out(&mut result.runs, model);
    }
    result
}

/// What one chain says in one phase.
struct OfChain {
    evidence: Evidence,
    heading: Option<(f64, Vec<f64>)>,
    innovations: Vec<Innovation>,
    outliers: Vec<usize>,
    noise_score: NoiseScore,
}
