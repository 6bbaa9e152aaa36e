//! A scan effect by effect: the best variant of each, with the multiplicity correction for all its variants.

use crate::candidate::Candidate;
use crate::physical::effect_of;
use crate::scan::Scored;
use crate::statistics::sidak;

/// One candidate of an effect: its best variant, with its chance after paying for all variants.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) scored: Scored,
    pub(crate) p_value: f64,
    pub(crate) variants: usize,
    /// Shapes that can be seen and that the scan gives a size that can be, with their statistics, that which explains most first.
    possible: Vec<(Candidate, f64)>,
}

impl Entry {
    /// Those of them beside the best variant that explain enough.
    pub(crate) fn others(&self, least: f64) -> impl Iterator<Item = &Candidate> {
        let is_other = move |(candidate, statistic): &&(Candidate, f64)| {
            *candidate != self.scored.candidate && *statistic >= least
        };
        self.possible.iter().filter(is_other).map(|(candidate, _)| candidate)
    }
}

/// The best variant of every effect.
pub(crate) fn best_variants(scored: &[Scored]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for scored in scored {
        let id = scored.candidate.id();
        let known = entries.iter().position(|entry| entry.scored.candidate.id() == id);
        let at = known.unwrap_or(entries.len());
        if known.is_none() {
            entries.push(Entry { p_value: scored.p_value, variants: 0, scored: scored.clone(), possible: Vec::new() });
        }
        let entry = &mut entries[at];
        let best = &entry.scored;
        if scored.p_value < best.p_value || (scored.p_value == best.p_value && scored.statistic > best.statistic) {
            entry.scored = scored.clone();
        }
        // A variant that cannot be seen is no trial.
        if scored.dimensions > 0 {
            entry.variants += 1;
            if scored.estimates.is_empty() || effect_of(&scored.candidate, &scored.estimates).is_some() {
                entry.possible.push((scored.candidate.clone(), scored.statistic));
            }
        }
    }
    for entry in &mut entries {
        entry.possible.sort_by(|a, b| b.1.total_cmp(&a.1));
        entry.p_value = sidak(entry.scored.p_value, entry.variants.max(1));
    }
    entries
}

/// How many effects of a scan can be seen at all, each a test: at least one.
pub(crate) fn tests_in(entries: &[Entry]) -> f64 {
    entries.iter().filter(|entry| entry.scored.dimensions > 0).count().max(1) as f64
}
