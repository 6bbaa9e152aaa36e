//! A scan effect by effect: the best variant of each, with the multiplicity correction for all its variants.

use crate::candidate::Choice;
use crate::physical::effect_of;
use crate::scan::Scored;
use crate::statistics::of_trials;

/// One candidate of an effect: its best shape, with its chance after paying for all shapes.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) scored: Scored,
    pub(crate) p_value: f64,
    pub(crate) shapes: usize,
    /// Shapes that can be seen and that the scan gives a size that can be, with their statistics, that which explains most first.
    possible: Vec<(Choice, f64)>,
}

impl Entry {
    /// Those of them beside the best shape that explain enough.
    pub(crate) fn others(&self, least: f64) -> impl Iterator<Item = &Choice> {
        let is_other = move |(choice, statistic): &&(Choice, f64)| *choice != self.scored.choice && *statistic >= least;
        self.possible.iter().filter(is_other).map(|(choice, _)| choice)
    }
}

/// The best shape of every effect.
pub(crate) fn best_shapes(scored: &[Scored]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for scored in scored {
        let id = scored.choice.id();
        let known = entries.iter().position(|entry| entry.scored.choice.id() == id);
        let at = known.unwrap_or(entries.len());
        if known.is_none() {
            entries.push(Entry { p_value: scored.p_value, shapes: 0, scored: scored.clone(), possible: Vec::new() });
        }
        let entry = &mut entries[at];
        let best = &entry.scored;
        if scored.p_value < best.p_value || (scored.p_value == best.p_value && scored.statistic > best.statistic) {
            entry.scored = scored.clone();
        }
        // A shape that cannot be seen is no trial.
        if scored.dimensions > 0 {
            entry.shapes += 1;
            if scored.sizes.is_empty() || effect_of(&scored.choice, &scored.sizes).is_some() {
                entry.possible.push((scored.choice.clone(), scored.statistic));
            }
        }
    }
    for entry in &mut entries {
        entry.possible.sort_by(|a, b| b.1.total_cmp(&a.1));
        entry.p_value = of_trials(entry.scored.p_value, entry.shapes.max(1));
    }
    entries
}

/// How many effects of a scan can be seen at all, each a test: at least one.
#[allow(clippy::cast_precision_loss)] // dozens
pub(crate) fn tests_in(entries: &[Entry]) -> f64 {
    entries.iter().filter(|entry| entry.scored.dimensions > 0).count().max(1) as f64
}
