//! The manoeuvre that discriminates causes in the least time.

use std::collections::BTreeMap;

use estimation::{Column, ModelFit, NormalEquations, total};

use super::constraints::Setting;
use super::manoeuvres::{Manoeuvre, Part, equations_of};
use super::predict::predictions;
use super::rival_odds::{Confidence, Frame, RivalColumns, Rivals, with_parts, with_runs};
use super::text;
use super::text::Predictions;
use crate::candidates::candidate::{Candidate, terms};
use crate::document::NextExperiment;
use crate::findings::finding::is_of_low_significance;
use crate::fits::augmented_model::without;
use crate::search::selection::SearchResult;
use crate::settings::{LEVELS, PLAN};

/// What to drive to discriminate the causes of one finding; the error says why nothing does.
pub(super) fn discriminate(
    base: &ModelFit<'_>,
    found: &SearchResult<'_>,
    index: usize,
    setting: &Setting,
    manoeuvres: &[Manoeuvre],
) -> Result<NextExperiment, String> {
    let without = without(base, &found.model, index).ok_or("the model without this finding has no fit")?;
    let names: Vec<Candidate> = found.names[index].iter().map(|name| name.candidate.clone()).collect();
    let all: Vec<Candidate> = without.candidates.iter().chain(&names).cloned().collect();
    let mut at = Column::BASE.len() + parameters(&without.candidates);
    let candidates = names.iter().map(|candidate| {
        let columns: Vec<usize> = (at..at + candidate.parameters().len()).collect();
        at += columns.len();
        RivalColumns { candidate: candidate.clone(), columns }
    });
    let candidates: Vec<RivalColumns> = candidates.collect();
    let before = total(&without.fit.scan(&mut terms(&all)).runs).ok_or("no run has measurements")?;
    let frame = Frame::of(&without.fit, &all);
    let rivals =
        Rivals::new(frame, candidates, &before).ok_or("the data do not determine the candidates' parameters")?;
    let options = equations_of(&without.fit, &all, setting, manoeuvres);
    // Causes of low significance must become significant as well, where that can be.
    let both =
        is_of_low_significance(found, index).then(|| rivals.clone().significant_by(LEVELS.low_significance_sigmas));
    let id = |k: usize| rivals.rival_columns[k].candidate.id();

    let search = |rivals| DiscriminationSearch { rivals, before: &before, options: &options, setting };
    // What discriminates them as likely as not is worth driving where nothing does for certain.
    let searches =
        both.iter().chain([&rivals]).flat_map(|rivals| [(rivals, Confidence::P95), (rivals, Confidence::P50)]);
    let plan = searches.into_iter().find_map(|(rivals, confidence)| search(rivals).plan(confidence));
    let Discrimination { confidence, discriminated, mut parts, mut minutes } =
        plan.ok_or_else(|| search(&rivals).why_nothing(&names))?;
    let never: Vec<_> = rivals.pairs().into_iter().filter(|pair| !discriminated.contains(pair)).collect();
    if parts.iter().all(|part| part.pairs == 1) && 2.0 * minutes <= setting.minutes {
        // A single run each way leaves nothing to compare it with.
        parts.iter_mut().for_each(|part| part.pairs = 2);
        minutes *= 2.0;
    }
    let after = with_parts(&before, &parts, &options);
    let sigmas = discriminated
        .iter()
        .filter_map(|pair| rivals.discrimination(&after, pair.0, pair.1))
        .map(|discrimination| discrimination.sigmas);
    let sigmas = sigmas.fold(f64::INFINITY, f64::min);
    let (what, predicts) = predictions(base, &without, &rivals, &before, &discriminated, &parts, setting)
        .map_or((String::new(), Predictions::Sizes(BTreeMap::new())), |(what, of)| (what, Predictions::Of(of)));
    let pairs = |pairs: &[(usize, usize)]| {
        let each: Vec<String> = pairs.iter().map(|(a, b)| format!("{} from {}", id(*a), id(*b))).collect();
        each.join(", ")
    };
    let (tells, still) = if never.is_empty() {
        (listed(&names), String::new())
    } else {
        (pairs(&discriminated), format!(" It does not discriminate {}.", pairs(&never)))
    };
    let tell = if confidence == Confidence::P95 { "discriminates" } else { "discriminates, at even odds," };
    let why = format!(
        "it takes {minutes:.1} min and {tell} {tells} by {sigmas:.1} standard deviations or more, sought {}. Diagnose the new runs together with the old ones.{still}{what}",
        setting.within
    );
    Ok(text::next_experiment(&parts, setting, minutes, &why, predicts))
}

fn parameters(candidates: &[Candidate]) -> usize {
    candidates.iter().map(|candidate| candidate.parameters().len()).sum()
}

fn listed(names: &[Candidate]) -> String {
    let ids: Vec<&str> = names.iter().map(Candidate::id).collect();
    match ids.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => String::new(),
    }
}

/// A pair of names, by their places.
type Pair = (usize, usize);

/// Kinds of run, each with the normal equations of a pair of them.
type Driven = (Manoeuvre, NormalEquations);

/// Which pairs of causes are discriminated, at what confidence, and by what.
struct Discrimination {
    confidence: Confidence,
    discriminated: Vec<Pair>,
    parts: Vec<Part>,
    minutes: f64,
}

/// Names, what is known of them, and what can be driven.
struct DiscriminationSearch<'a> {
    rivals: &'a Rivals,
    before: &'a NormalEquations,
    options: &'a [Driven],
    setting: &'a Setting,
}

impl DiscriminationSearch<'_> {
    /// For certain, what takes the least time; else what discriminates them best within the time.
    fn plan(&self, confidence: Confidence) -> Option<Discrimination> {
        // A pair that nothing discriminates, however long it is driven, must not hide what discriminates the
        // others.
        let tellable: Vec<Pair> = self
            .rivals
            .pairs()
            .into_iter()
            .filter(|pair| {
                let tells = |option| self.least_pairs(&[*pair], &[option], confidence, self.setting.minutes).is_some();
                self.options.iter().any(tells)
            })
            .collect();
        if tellable.is_empty() {
            return None;
        }
        let of = |discriminated: Vec<Pair>| {
            let (parts, minutes) = match confidence {
                Confidence::P95 => self.quickest(&discriminated)?,
                Confidence::P50 => self.farthest(&discriminated)?,
            };
            Some(Discrimination { confidence, discriminated, parts, minutes })
        };
        of(tellable.clone()).or_else(|| of(self.most_discriminated(&tellable, confidence)))
    }

    /// Says that nothing discriminates the causes, and how far the best manoeuvre gets.
    fn why_nothing(&self, names: &[Candidate]) -> String {
        let pairs = self.rivals.pairs();
        let best = self.options.iter().filter_map(|option| {
            let equations = self.after(&[option], self.most_pairs(&[option], self.setting.minutes));
            let worst = pairs
                .iter()
                .filter_map(|pair| self.rivals.discrimination(&equations, pair.0, pair.1))
                .map(|discrimination| discrimination.sigmas);
            Some((option.0, worst.min_by(f64::total_cmp)?))
        });
        let what = format!("nothing that can be driven {} discriminates {}", self.setting.within, listed(names));
        match best.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((manoeuvre, sigmas)) => format!(
                "{what}: the best, {}, leaves them {sigmas:.1} standard deviations from each other",
                text::manoeuvre(&manoeuvre)
            ),
            None => what,
        }
    }

    /// The normal equations with so many pairs of runs of each of some kinds.
    fn after(&self, kinds: &[&Driven], pairs: u32) -> NormalEquations {
        let added: Vec<(&NormalEquations, f64)> = kinds.iter().map(|(_, of)| (of, f64::from(pairs))).collect();
        with_runs(self.before, &added)
    }

    /// The margin by which so many pairs of runs of each of some kinds discriminate the closest of some pairs
    /// of causes.
    fn margin(&self, names: &[Pair], kinds: &[&Driven], pairs: u32, confidence: Confidence) -> f64 {
        let equations = self.after(kinds, pairs);
        let margin = |pair: &Pair| {
            self.rivals
                .discrimination(&equations, pair.0, pair.1)
                .map_or(f64::NEG_INFINITY, |discrimination| discrimination.margin(confidence))
        };
        names.iter().map(margin).fold(f64::INFINITY, f64::min)
    }

    /// The pairs of names that the one kind of run, driven so many times, discriminates that discriminates
    /// most. Of causes that some kind discriminates, at least one.
    fn most_discriminated(&self, names: &[Pair], confidence: Confidence) -> Vec<Pair> {
        let discriminated = |(option, pairs): (&Driven, u32)| -> Vec<Pair> {
            names.iter().filter(|pair| self.margin(&[**pair], &[option], pairs, confidence) >= 0.0).copied().collect()
        };
        let runs = |option| (1..=self.most_pairs(&[option], self.setting.minutes)).map(move |pairs| (option, pairs));
        // The most probable name counts for more than the others among themselves.
        self.options
            .iter()
            .flat_map(runs)
            .map(discriminated)
            .max_by_key(|discriminated| (discriminated.iter().filter(|(a, _)| *a == 0).count(), discriminated.len()))
            .unwrap_or_default()
    }

    /// How many pairs of runs of each of some kinds the time allows.
    fn most_pairs(&self, kinds: &[&Driven], within_min: f64) -> u32 {
        let pairs = (within_min / self.minutes(kinds)).floor() as u32;
        pairs.min(PLAN.max_run_pairs)
    }

    /// What a pair of runs of each kind takes.
    fn minutes(&self, kinds: &[&Driven]) -> f64 {
        kinds.iter().map(|(manoeuvre, _)| manoeuvre.cost(self.setting).minutes).sum()
    }

    /// The least number of pairs of runs of each of some kinds that discriminates all given pairs of names.
    fn least_pairs(&self, names: &[Pair], kinds: &[&Driven], confidence: Confidence, within_min: f64) -> Option<u32> {
        let most = self.most_pairs(kinds, within_min);
        // More runs can make a name whose form is not known well enough harder to drop: the margin is not
        // monotonous, and all are tried.
        (1..=most).find(|pairs| self.margin(names, kinds, *pairs, confidence) >= 0.0)
    }

    fn parts(&self, kinds: &[&Driven], pairs: u32) -> (Vec<Part>, f64) {
        let parts = kinds.iter().map(|(manoeuvre, _)| Part { manoeuvre: *manoeuvre, pairs }).collect();
        (parts, f64::from(pairs) * self.minutes(kinds))
    }

    /// Every two kinds of run; one kind at two speeds is two.
    fn twos(&self) -> impl Iterator<Item = [&Driven; 2]> {
        let firsts = self.options.iter().enumerate();
        firsts.flat_map(|(k, first)| self.options[k + 1..].iter().map(move |second| [first, second]))
    }

    /// The kind of run, or the two kinds, that takes the least time.
    fn quickest(&self, names: &[Pair]) -> Option<(Vec<Part>, f64)> {
        let quicker = |best: Option<(Vec<Part>, f64)>, kinds: &[&Driven], within_min: f64| {
            let least = best.as_ref().map_or(f64::INFINITY, |(_, minutes)| *minutes);
            let pairs = self.least_pairs(names, kinds, Confidence::P95, within_min.min(least));
            pairs.map(|pairs| self.parts(kinds, pairs)).filter(|(_, minutes)| *minutes < least).or(best)
        };
        let one = self.options.iter().fold(None, |best, option| quicker(best, &[option], self.setting.minutes));
        let within_min =
            one.as_ref().map_or(self.setting.minutes, |(_, minutes)| PLAN.two_manoeuvres_time_ratio * minutes);
        self.twos().fold(one, |best, two| quicker(best, &two, within_min))
    }

    /// The manoeuvre, or the two, that discriminates causes best within the time, with probability
    /// 0.5 at least.
    fn farthest(&self, names: &[Pair]) -> Option<(Vec<Part>, f64)> {
        let singles = self.options.iter().map(|option| vec![option]);
        let kinds = singles.chain(self.twos().map(|two| two.to_vec()));
        let most = |kinds: Vec<&Driven>| {
            let all = self.most_pairs(&kinds, self.setting.minutes);
            let of = |pairs: u32| (self.margin(names, &kinds, pairs, Confidence::P50), pairs);
            let (margin, pairs) = (1..=all).map(of).max_by(|a, b| a.0.total_cmp(&b.0))?;
            Some((margin, self.parts(&kinds, pairs)))
        };
        let (margin, plan) = kinds.filter_map(most).max_by(|a, b| a.0.total_cmp(&b.0))?;
        (margin >= 0.0).then_some(plan)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::plan::manoeuvres::library;
    use crate::plan::manoeuvres::tests::setting;
    use crate::plan::rival_odds::tests::{normal_equations, rivals};

    /// Where a kind of run says much of what both names have in common, each run raises what is asked of
    /// them by more than it discriminates them: few runs tell, many do not.
    #[test]
    fn what_few_runs_discriminate_and_many_do_not_is_discriminated() {
        // Both names say 10, and differ by λ/2 = 2.5.
        let difference = 0.05_f64.sqrt();
        let old = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, difference, 0.0]);
        let before = normal_equations(&old, &DVector::from_column_slice(&[0.3, 10.0, 10.0 * difference]));
        let rivals = rivals(&before);
        // A pair of runs adds 1 to that, of 3 at least that are asked, and 150 to what both explain, of
        // which a hundredth is asked.
        let (common, difference) = (3.0_f64.sqrt(), 0.02_f64.sqrt());
        let new = normal_equations(
            &DMatrix::from_row_slice(2, 3, &[0.0, common, common, 0.0, difference, 0.0]),
            &DVector::zeros(2),
        );
        let setting = Setting { minutes: 1e4, ..setting() };
        let options = [(library(&setting)[0], new)];
        let search = DiscriminationSearch { rivals: &rivals, before: &before, options: &options, setting: &setting };
        let margin = |pairs| search.margin(&[(0, 1)], &[&options[0]], pairs, Confidence::P50);
        assert!(margin(1) > 0.0 && margin(PLAN.max_run_pairs) < 0.0, "{} {}", margin(1), margin(PLAN.max_run_pairs));
        assert_eq!(search.most_discriminated(&[(0, 1)], Confidence::P50), [(0, 1)]);
        assert_eq!(search.plan(Confidence::P50).map(|plan| plan.discriminated), Some(vec![(0, 1)]));
    }
}
