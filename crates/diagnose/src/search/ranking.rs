//! A scan effect by effect: the best variant of each, with the multiplicity correction for all its variants.

use crate::candidates::candidate::Candidate;
use crate::candidates::physical::effect_of;
use crate::fits::scan::Scored;
use crate::fits::statistics::sidak;

/// An effect of the scan: its best variant, with the p-value corrected for all variants.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) scored: Scored,
    pub(crate) p_value: f64,
    pub(crate) variants: usize,
    /// Detectable variants with physical estimates, with their statistics, the largest first.
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
        // A variant that is not observable is no trial.
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

/// Number of detectable effects of a scan, each a test: at least one.
pub(crate) fn tests_in(entries: &[Entry]) -> f64 {
    entries.iter().filter(|entry| entry.scored.dimensions > 0).count().max(1) as f64
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::fits::statistics::p_of_chi_square;

    /// A score of a first variant: its statistic and log odds along so many directions, without estimates.
    pub(crate) fn scored(id: &'static str, statistic: f64, log_odds: f64, dimensions: usize) -> Scored {
        Scored {
            candidate: Candidate::Effect { id, variant: 0, at: None },
            parameters: Vec::new(),
            information: DMatrix::zeros(0, 0),
            dimensions,
            statistic,
            p_value: if dimensions > 0 { p_of_chi_square(statistic, dimensions as f64) } else { 1.0 },
            estimates: Vec::new(),
            log_odds,
            resolved: true,
        }
    }

    #[test]
    fn an_effect_is_its_best_variant_and_pays_for_all() {
        let second = |statistic| Scored {
            candidate: Candidate::Effect { id: "slip_speed", variant: 1, at: None },
            ..scored("slip_speed", statistic, 0.0, 1)
        };
        let all = [scored("slip_speed", 9.0, 0.0, 1), second(16.0), scored("backlash", 25.0, 0.0, 0)];
        let entries = best_variants(&all);
        assert_eq!((entries.len(), entries[0].scored.statistic, entries[0].variants), (2, 16.0, 2));
        // Šidák: 1 − (1 − p)². Rejects the p-value of the best alone, which is half as large.
        let p = all[1].p_value;
        assert!((entries[0].p_value / (2.0 * p - p * p) - 1.0).abs() < 1e-12);
        // The other one may be tried still; one without a direction is no test.
        assert_eq!(entries[0].others(9.0).collect::<Vec<_>>(), [&all[0].candidate]);
        assert_eq!(tests_in(&entries), 1.0);
    }
}
