//! One pass over all runs: the filter of every chain, and the sums of what they say.

use std::ops::Range;

use model_term::ModelTerm;
use rayon::prelude::*;

use crate::filter::{Filter, Innovation, NoiseScore, Want};
use crate::group_extrinsics::Follow;
use crate::model::{Column, Model};
use crate::noise::Noise;
use crate::normal_equations::Evidence;
use crate::products::Products;
use crate::propagation::{Kept, KeptLegs, Legs, Trail};
use crate::records::{Chain, Records, Start};
use crate::thinning::{Leg, Selection};

/// From so many pieces of legs on, or kept legs, which take a millisecond, runs are filtered on all cores; without terms, all chains.
pub(super) const LEGS_AT_ONCE: usize = 4096;

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
    /// The legs, where they are to be kept.
    pub(crate) kept: Option<Kept>,
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
            kept: None,
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
    want: Want<'_>,
) -> Pass {
    let columns = Column::BASE.len() + terms.iter().map(|term| term.parameters().len()).sum::<usize>();
    let products = Products::of(columns, want.parts);
    let mut result = Pass::nothing();
    #[allow(clippy::cast_precision_loss)] // a handful of phases
    let weight = 1.0 / selections.len() as f64;
    let runs = runs(&records.chains);
    result.runs = runs.iter().map(|chains| Evidence::new(records.chains[chains.start].run, columns)).collect();
    let known = want.by.map(|kept| (kept, kept.change_to(model)));
    let of_chain =
        |(phase, number): (usize, usize), legs: &[Leg], terms: &mut [Box<dyn ModelTerm>], trail: &mut Option<Trail>| {
            let chain = &records.chains[number];
            let mut filter = Filter::new(chain, number, model, noise, &products, terms, want);
            if let Some(trail) = trail.take().filter(|_| chain.goes_on) {
                filter.go_on(trail);
            }
            if let Some((kept, change)) = &known {
                filter.take_legs(kept.known(phase, number, change));
            } else if want.keep {
                filter.take_legs(Legs::kept(legs.len(), columns - Column::BASE.len()));
            }
            filter.run(legs, free_headings[number]);
            *trail = Some(filter.trail());
            let (sums, outliers, innovations, noise_score, kept) = filter.into_parts();
            let (evidence, heading) = sums.eliminated(chain.run, columns);
            (evidence, OfChain { number, heading, innovations, outliers, noise_score, kept })
        };
    let mut phases = Vec::with_capacity(selections.len());
    for (phase, selection) in selections.iter().enumerate() {
        let legs = &selection.legs;
        let of_run = |chains: &Range<usize>, evidence: &mut Evidence, terms: &mut [Box<dyn ModelTerm>]| {
            let mut trail: Option<Trail> = None;
            let mut found = Vec::with_capacity(chains.len());
            for number in chains.clone() {
                let unseen = legs[number].is_empty();
                // Terms remember what was driven on the way to the next displacement, seen or not.
                let remember = !terms.is_empty() && want.by.is_none();
                if unseen && (!remember || records.chains[number].start == Start::Seen) {
                    continue;
                }
                let (own, of_chain) = of_chain((phase, number), &legs[number], terms, &mut trail);
                if !unseen {
                    evidence.add(&own, weight);
                    found.push(of_chain);
                }
            }
            found
        };
        // Sums are taken in the order of the chains whichever way they go.
        let work = |leg: &Leg| if want.by.is_some() { 1 } else { leg.pieces.len().max(1) };
        let at_once = legs.iter().flatten().map(work).sum::<usize>() >= LEGS_AT_ONCE;
        let found: Vec<Vec<OfChain>> = if at_once && terms.is_empty() {
            let of = |number: usize| {
                (!legs[number].is_empty()).then(|| of_chain((phase, number), &legs[number], &mut [], &mut None))
            };
            let mut ready: Vec<_> = (0..legs.len()).into_par_iter().map(of).collect();
            let in_run = |(chains, evidence): (&Range<usize>, &mut Evidence)| {
                let ready = ready[chains.clone()].iter_mut().filter_map(Option::take);
                ready.map(|(own, of_chain)| (evidence.add(&own, weight), of_chain).1).collect()
            };
            runs.iter().zip(&mut result.runs).map(in_run).collect()
        } else if at_once {
            // Chains of a run follow each other, and terms remember; each run starts anew.
            let in_run = |terms: &mut Vec<Box<dyn ModelTerm>>, (chains, evidence): (&Range<usize>, &mut Evidence)| {
                of_run(chains, evidence, terms)
            };
            runs.par_iter().zip(&mut result.runs).map_init(|| terms.to_vec(), in_run).collect()
        } else {
            runs.iter().zip(&mut result.runs).map(|(chains, evidence)| of_run(chains, evidence, terms)).collect()
        };
        let known = found.iter().flatten().map(|of| of.innovations.len()).sum();
        let mut innovations = Vec::with_capacity(known);
        let mut kept = vec![None; if want.keep { legs.len() } else { 0 }];
        for of in found.into_iter().flatten() {
            if want.keep {
                kept[of.number] = of.kept;
            }
            innovations.extend(of.innovations);
            if phase == 0 {
                result.outliers.extend(of.outliers.into_iter().map(|look| (of.number, look)));
            }
            if let (0, Some((rest, by))) = (phase, of.heading) {
                let run = records.chains[of.number].run;
                result.headings.push(FreeHeading { chain: of.number, run, rest, by });
            }
            result.noise.add(&of.noise_score, weight);
        }
        phases.push(kept);
        if want.innovations {
            result.innovations.push(innovations);
        }
    }
    result.kept = want.keep.then(|| Kept { model: model.clone(), phases });
    if let Some(own) = &model.own {
        result.own = own.take_out(&mut result.runs, model);
    }
    result
}

/// The chains of each run, which follow each other.
fn runs(chains: &[Chain<'_>]) -> Vec<Range<usize>> {
    let mut start = 0;
    let of = |chains: &[Chain<'_>]| {
        let run = start..start + chains.len();
        start = run.end;
        run
    };
    chains.chunk_by(|a, b| a.run == b.run).map(of).collect()
}

/// What one chain says in one phase, beside its evidence.
struct OfChain {
    number: usize,
    heading: Option<(f64, Vec<f64>)>,
    innovations: Vec<Innovation>,
    outliers: Vec<usize>,
    noise_score: NoiseScore,
    kept: Option<KeptLegs>,
}
