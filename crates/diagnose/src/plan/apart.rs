//! The manoeuvre that tells names apart in the least time.

use std::collections::BTreeMap;

use calib::likelihood::{Column, Evidence};
use calib::methods::joint::JointFit;

use super::library::Manoeuvre;
use super::predict::predictions;
use super::setting::Setting;
use super::weigh::{Candidate, Frame, Rivals, Sure, with_parts, with_runs};
use super::words::Predictions;
use super::{Part, evidences, words};
use crate::candidate::{Choice, terms};
use crate::document::NextExperiment;
use crate::scan::total;
use crate::search::{Found, without};

/// Two kinds of run must save this share of the time against one to be worth the trouble.
const WORTH_TWO_KINDS: f64 = 0.8;
/// More pairs of runs of one kind nobody drives.
const MOST_PAIRS: u32 = 50;

/// What to drive to tell apart the names of one finding; the error says why nothing does.
pub(super) fn tell_apart(
    base: &JointFit<'_>,
    found: &Found<'_>,
    place: usize,
    setting: &Setting,
    manoeuvres: &[Manoeuvre],
    sure: Sure,
) -> Result<NextExperiment, String> {
    let without = without(base, &found.model, place).ok_or("the model without this finding has no fit")?;
    let names: Vec<Choice> = found.names[place].iter().map(|name| name.choice.clone()).collect();
    let all: Vec<Choice> = without.choices.iter().chain(&names).cloned().collect();
    let mut at = Column::BASE.len() + parameters(&without.choices);
    let candidates = names.iter().map(|choice| {
        let columns: Vec<usize> = (at..at + choice.parameters().len()).collect();
        at += columns.len();
        Candidate { choice: choice.clone(), columns }
    });
    let candidates: Vec<Candidate> = candidates.collect();
    let before = total(&without.fit.scan(&mut terms(&all)).runs).ok_or("no run has looks")?;
    let frame = Frame::of(&without.fit, &all);
    let rivals = Rivals::new(frame, candidates, &before, sure).ok_or("the data do not determine the names' sizes")?;
    let options = evidences(&without.fit, &all, setting, manoeuvres);
    let id = |k: usize| rivals.candidates[k].choice.id();

    // A pair that nothing tells apart, however long it is driven, must not hide what tells the others apart.
    let (tellable, never): (Vec<_>, Vec<_>) = rivals.pairs().into_iter().partition(|pair| {
        options
            .iter()
            .any(|option| least_pairs(&rivals, &before, &[*pair], &[option], (setting, setting.minutes)).is_some())
    });
    if tellable.is_empty() {
        let best = options.iter().filter_map(|option| {
            let most = most_pairs(&[option], setting, setting.minutes);
            let evidence = with_runs(&before, &[(&option.1, f64::from(most))]);
            let worst = never.iter().filter_map(|pair| rivals.apart(&evidence, *pair)).map(|apart| apart.sigmas);
            Some((option.0, worst.min_by(f64::total_cmp)?))
        });
        let best = best.max_by(|a, b| a.1.total_cmp(&b.1));
        let names = listed(&names);
        return Err(match best {
            Some((manoeuvre, sigmas)) => format!(
                "nothing that can be driven {} tells {names} apart: the best, {}, leaves them {sigmas:.1} standard deviations from each other",
                setting.within,
                words::manoeuvre(&manoeuvre)
            ),
            None => format!("nothing that can be driven {} tells {names} apart", setting.within),
        });
    }
    let (told, (mut parts, mut minutes)) = match quickest(&rivals, &before, &tellable, &options, setting) {
        Some(plan) => (tellable, plan),
        None => {
            let most = most_told(&rivals, &before, &tellable, &options, setting);
            let plan = quickest(&rivals, &before, &most, &options, setting);
            (
                most,
                plan.ok_or_else(|| {
                    format!("nothing that can be driven {} tells {} apart", setting.within, listed(&names))
                })?,
            )
        }
    };
    let never: Vec<_> = rivals.pairs().into_iter().filter(|pair| !told.contains(pair)).collect();
    if parts.iter().all(|part| part.pairs == 1) && 2.0 * minutes <= setting.minutes {
        // A single run each way leaves nothing to compare it with.
        parts.iter_mut().for_each(|part| part.pairs = 2);
        minutes *= 2.0;
    }
    let after = with_parts(&before, &parts, &options);
    let sigmas = told.iter().filter_map(|pair| rivals.apart(&after, *pair)).map(|apart| apart.sigmas);
    let sigmas = sigmas.fold(f64::INFINITY, f64::min);
    let (what, predicts) = predictions(base, &without, &rivals, &before, &told, &parts, setting)
        .map_or((String::new(), Predictions::Sizes(BTreeMap::new())), |(what, of)| (what, Predictions::Of(of)));
    let pairs = |pairs: &[(usize, usize)]| {
        let each: Vec<String> = pairs.iter().map(|(a, b)| format!("{} from {}", id(*a), id(*b))).collect();
        each.join(", ")
    };
    let (tells, still) = if never.is_empty() {
        (listed(&names), String::new())
    } else {
        (pairs(&told), format!(" It does not tell {}.", pairs(&never)))
    };
    let tell = if sure == Sure::Certain { "tells" } else { "tells, with even chances," };
    let why = format!(
        "it takes {minutes:.1} min and {tell} {tells} by {sigmas:.1} standard deviations or more, sought {}. Diagnose the new runs together with the old ones.{still}{what}",
        setting.within
    );
    Ok(words::next_experiment(&parts, setting, minutes, &why, predicts))
}

fn parameters(choices: &[Choice]) -> usize {
    choices.iter().map(|choice| choice.parameters().len()).sum()
}

fn listed(names: &[Choice]) -> String {
    let ids: Vec<&str> = names.iter().map(Choice::id).collect();
    match ids.split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => String::new(),
    }
}

/// The pairs of names that the one kind of run tells apart that tells most.
fn most_told(
    rivals: &Rivals,
    before: &Evidence,
    names: &[(usize, usize)],
    options: &[Driven],
    setting: &Setting,
) -> Vec<(usize, usize)> {
    let told = |option: &Driven| -> Vec<(usize, usize)> {
        let pairs = f64::from(most_pairs(&[option], setting, setting.minutes));
        let evidence = with_runs(before, &[(&option.1, pairs)]);
        let tells = |pair: &&(usize, usize)| rivals.apart(&evidence, **pair).is_some_and(|apart| apart.margin >= 0.0);
        names.iter().filter(tells).copied().collect()
    };
    // The most probable name counts for more than the others among themselves.
    options
        .iter()
        .map(told)
        .max_by_key(|told| (told.iter().filter(|(a, _)| *a == 0).count(), told.len()))
        .unwrap_or_default()
}

type Driven = (Manoeuvre, Evidence);

/// How many pairs of runs of each of some kinds the time allows.
fn most_pairs(kinds: &[&Driven], setting: &Setting, within_min: f64) -> u32 {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates
    let pairs = (within_min / minutes(kinds, setting)).floor() as u32;
    pairs.min(MOST_PAIRS)
}

/// What a pair of runs of each kind takes.
fn minutes(kinds: &[&Driven], setting: &Setting) -> f64 {
    kinds.iter().map(|(manoeuvre, _)| manoeuvre.cost(setting).minutes).sum()
}

/// The least number of pairs of runs of each of some kinds that tells all given pairs of names apart.
fn least_pairs(
    rivals: &Rivals,
    before: &Evidence,
    names: &[(usize, usize)],
    kinds: &[&Driven],
    (setting, within_min): (&Setting, f64),
) -> Option<u32> {
    let tells = |pairs: u32| {
        let added: Vec<(&Evidence, f64)> = kinds.iter().map(|(_, of)| (of, f64::from(pairs))).collect();
        let evidence = with_runs(before, &added);
        names.iter().all(|pair| rivals.apart(&evidence, *pair).is_some_and(|apart| apart.margin >= 0.0))
    };
    let most = most_pairs(kinds, setting, within_min);
    // More runs can make a name whose form is not known well enough harder to drop: the margin is not monotonous, and all are tried.
    (1..=most).find(|pairs| tells(*pairs))
}

/// The kind of run, or two kinds at one speed, that takes the least time.
fn quickest(
    rivals: &Rivals,
    before: &Evidence,
    names: &[(usize, usize)],
    options: &[Driven],
    setting: &Setting,
) -> Option<(Vec<Part>, f64)> {
    let of = |kinds: &[&Driven], within_min: f64| {
        let pairs = least_pairs(rivals, before, names, kinds, (setting, within_min))?;
        let parts = kinds.iter().map(|(manoeuvre, _)| Part { manoeuvre: *manoeuvre, pairs }).collect::<Vec<_>>();
        Some((parts, f64::from(pairs) * minutes(kinds, setting)))
    };
    let mut best: Option<(Vec<Part>, f64)> = None;
    let mut within_min = setting.minutes;
    for option in options {
        if let Some(found) = of(&[option], within_min)
            && best.as_ref().is_none_or(|best| found.1 < best.1)
        {
            within_min = found.1;
            best = Some(found);
        }
    }
    if best.is_some() {
        within_min *= WORTH_TWO_KINDS;
    }
    for (k, first) in options.iter().enumerate() {
        for second in options[k + 1..].iter().filter(|second| second.0.speed_m_s == first.0.speed_m_s) {
            if let Some(found) = of(&[first, second], within_min)
                && best.as_ref().is_none_or(|best| found.1 < best.1)
            {
                within_min = found.1;
                best = Some(found);
            }
        }
    }
    best
}
