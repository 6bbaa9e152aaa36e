//! Measures over cases: shares with their one-sided limits, the power's ratio, gains, calibration; each
//! against its bar.

use std::collections::BTreeMap;

use super::case_kind::CaseKind;
use super::hidden::EffectKind;
use super::instrument::NoiseClass;
use super::measure_value::{Counted, Measure, share};
use super::oracle_view::OracleView;
use super::power_ratio::power;
use super::result::{CaseResult, Planned, Reported};

fn count<'a, T: 'a>(all: impl Iterator<Item = &'a T>, holds: impl Fn(&T) -> bool) -> Counted {
    let (hits, of) = all.fold((0, 0), |(hits, of), one| (hits + usize::from(holds(one)), of + 1));
    Counted { hits, of }
}

/// What was said of one hidden effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum IdentificationOutcome {
    Undetected,
    First,
    InSet,
    Unlisted,
    WrongName,
    WrongSet,
}

fn identification_outcome(hidden: &OracleView, first: Option<&Reported>) -> IdentificationOutcome {
    let Some(reported) = first else { return IdentificationOutcome::Undetected };
    if reported.names[0] == hidden.id {
        IdentificationOutcome::First
    } else if reported.names.contains(&hidden.id) {
        IdentificationOutcome::InSet
    } else if reported.names[0] == "unlisted" {
        IdentificationOutcome::Unlisted
    } else if reported.names.len() == 1 {
        IdentificationOutcome::WrongName
    } else {
        IdentificationOutcome::WrongSet
    }
}

/// Bar on nulls with a finding over all cases, and in each stratum.
const NULLS_OVERALL: f64 = 0.05;
pub(crate) const NULLS_IN_A_STRATUM: f64 = 0.08;

/// All measures, with the bar on nulls with a finding.
pub(crate) fn measures(seed: u64, cases: &[CaseResult]) -> Vec<Measure> {
    measures_with(seed, cases, NULLS_OVERALL)
}

pub(crate) fn measures_with(seed: u64, cases: &[CaseResult], bar_of_nulls: f64) -> Vec<Measure> {
    let of = |case_kind: CaseKind| cases.iter().filter(move |case| case.case_kind == case_kind);
    let has_finding = |case: &CaseResult| case.findings().next().is_some();
    let mut measures = vec![
        share("null_findings", "nulls with a finding", count(of(CaseKind::Null), has_finding), bar_of_nulls, true),
        share(
            "false_alarms",
            "nulls with a false positive",
            count(of(CaseKind::Null).filter(|case| case.noise == NoiseClass::White), has_finding),
            0.05,
            true,
        ),
        share(
            "false_alarms_other_noise",
            "nulls with a false positive, other noise",
            count(of(CaseKind::Null).filter(|case| case.noise != NoiseClass::White), has_finding),
            0.10,
            true,
        ),
        share(
            "nulls_unextended",
            "nulls left unextended",
            count(of(CaseKind::Null), |case: &CaseResult| !case.extended),
            0.95,
            false,
        ),
        power(seed, cases),
        Measure { met: None, ..detected(cases) },
        unresolved(cases),
    ];
    measures.extend(names(cases));
    measures.extend(resolved(cases));
    measures.extend(left_out(cases));
    measures.push(pairs(cases));
    measures.push(gain(
        "gain",
        "gain over the oracle's",
        &of(CaseKind::Single).chain(of(CaseKind::Pair)).collect::<Vec<_>>(),
        0.9,
    ));
    let white = |case: &&CaseResult| case.noise == NoiseClass::White;
    let drawn: Vec<&CaseResult> = of(CaseKind::Single).chain(of(CaseKind::Pair)).filter(white).collect();
    measures.push(Measure { met: None, ..gain("gain_white", "the same under white noise (shown only)", &drawn, 0.9) });
    measures.push(gain(
        "gain_left_out",
        "left out: gain over the oracle's",
        &of(CaseKind::LeftOut).collect::<Vec<_>>(),
        0.7,
    ));
    measures.push(other_session(cases));
    measures.extend(large(cases));
    measures.extend(one_log(cases));
    measures.extend(probabilities(cases));
    measures
}

/// Two-sided 95 % of a normal variable: what a gain must be below zero by to be a loss, in its standard
/// deviations.
const LOSS_SIGMAS: f64 = 1.96;

/// Extended models that do harm where the robot drives otherwise. Those that are not extended count with
/// nobody.
fn other_session(cases: &[CaseResult]) -> Measure {
    let gains: Vec<f64> = cases.iter().filter_map(|case| case.other_session).collect();
    share(
        "other_session",
        "extended models that predict a session of other paths worse than the calibration alone, beyond the interval",
        count(gains.iter(), |gain: &f64| *gain < -LOSS_SIGMAS),
        0.03,
        true,
    )
}

/// What is said of large effects: the right name, and nothing beside it that the effect itself explains.
fn large(cases: &[CaseResult]) -> Vec<Measure> {
    // What another form leaves of the catalogue's is no finding of the effect's size.
    let of_form = |case: &&CaseResult| {
        case.case_kind == CaseKind::Large && case.hidden.first().is_some_and(|hidden| !hidden.other_form)
    };
    let large: Vec<&CaseResult> = cases.iter().filter(of_form).collect();
    if large.is_empty() {
        return Vec::new();
    }
    let named = |case: &CaseResult| {
        let hidden = case.hidden.first().map(|hidden| hidden.id.as_str());
        case.findings().next().is_some_and(|found| found.names.iter().any(|name| Some(name.as_str()) == hidden))
    };
    vec![
        share(
            "large_named",
            "large effects that the first finding names",
            count(large.iter().copied(), named),
            0.95,
            false,
        ),
        share(
            "second_finding",
            "large effects with a second finding",
            count(large.iter().copied(), |case: &CaseResult| case.findings().nth(1).is_some()),
            0.1,
            true,
        ),
    ]
}

/// Whether one long log and the same cut into runs have the same name first, where either has one.
fn one_log(cases: &[CaseResult]) -> Option<Measure> {
    let names: Vec<[Option<&str>; 2]> = cases
        .iter()
        .filter(|case| case.case_kind == CaseKind::OneLog)
        .map(|case| [case.findings().next(), case.findings_of_cut().next()])
        .map(|first| first.map(|found| found.map(|found| found.names[0].as_str())))
        .filter(|[whole, cut]| whole.is_some() || cut.is_some())
        .collect();
    (!names.is_empty()).then(|| {
        share(
            "same_first_name",
            "findings whose first name is the same in one long log and in the same log cut into runs",
            count(names.iter(), |[whole, cut]: &[Option<&str>; 2]| whole == cut),
            0.9,
            false,
        )
    })
}

fn detected(cases: &[CaseResult]) -> Measure {
    let hit = |case: &CaseResult| case.findings().next().is_some();
    let plain = cases.iter().filter(|case| case.is_plain());
    share("detected", "effects of 1.6 limits and more that are detected", count(plain, hit), 0.9, false)
}

/// Whether the right name is first, of a detected single effect without an alias.
pub(crate) fn is_first_name_right(case: &CaseResult) -> Option<bool> {
    let hidden = case.hidden.first().filter(|hidden| case.case_kind == CaseKind::Single && !hidden.is_aliased())?;
    match identification_outcome(hidden, case.findings().next()) {
        IdentificationOutcome::Undetected => None,
        outcome => Some(outcome == IdentificationOutcome::First),
    }
}

/// Robots drawn for a single mean whose encoder does not resolve it: those that were drawn again, and those
/// whose rounding takes nearly all of what there is to see.
fn unresolved(cases: &[CaseResult]) -> Measure {
    let of_means = |case: &&CaseResult| {
        case.case_kind == CaseKind::Single && case.hidden.first().is_some_and(|hidden| hidden.kind == EffectKind::Mean)
    };
    let (mut k, mut n) = (0, 0);
    for case in cases.iter().filter(of_means) {
        let is_resolved = case.hidden.iter().all(OracleView::is_resolved);
        k += case.unresolved_robots + usize::from(!is_resolved);
        n += case.unresolved_robots + 1;
    }
    let measure = share(
        "unresolved",
        "robots whose encoder does not resolve the effect (shown only)",
        Counted { hits: k, of: n },
        1.0,
        true,
    );
    Measure { met: None, ..measure }
}

fn names(cases: &[CaseResult]) -> Vec<Measure> {
    let singles: Vec<(&OracleView, IdentificationOutcome, &CaseResult)> = cases
        .iter()
        .filter(|case| case.case_kind == CaseKind::Single)
        .filter_map(|case| {
            let hidden = case.hidden.first()?;
            Some((hidden, identification_outcome(hidden, case.findings().next()), case))
        })
        .filter(|(_, identification_outcome, _)| *identification_outcome != IdentificationOutcome::Undetected)
        .collect();
    let plain = singles.iter().filter(|(hidden, _, _)| !hidden.is_aliased());
    let aliased = || singles.iter().filter(|(hidden, _, _)| hidden.is_aliased());
    let mut measures = vec![
        share(
            "first_name",
            "right name first",
            count(plain, |(_, identification_outcome, _)| *identification_outcome == IdentificationOutcome::First),
            0.95,
            false,
        ),
        share(
            "set_holds",
            "aliased: the set holds the right name",
            count(aliased(), |(_, identification_outcome, _)| {
                matches!(identification_outcome, IdentificationOutcome::First | IdentificationOutcome::InSet)
            }),
            0.98,
            false,
        ),
        share(
            "single_wrong_name",
            "aliased: a single wrong name",
            count(aliased(), |(_, identification_outcome, _)| {
                *identification_outcome == IdentificationOutcome::WrongName
            }),
            0.01,
            true,
        ),
    ];
    // What the oracle itself does not detect nobody can name.
    let visible = || aliased().filter(|(hidden, ..)| hidden.ratio.is_some_and(|ratio| ratio >= 1.0));
    measures.extend([
        share(
            "set_holds_above_limit",
            "aliased, above the oracle's limit: the set holds the right name",
            count(visible(), |(_, identification_outcome, _)| {
                matches!(identification_outcome, IdentificationOutcome::First | IdentificationOutcome::InSet)
            }),
            0.96,
            false,
        ),
        share(
            "single_wrong_name_above_limit",
            "aliased, above the oracle's limit: a single wrong name",
            count(visible(), |(_, identification_outcome, _)| {
                *identification_outcome == IdentificationOutcome::WrongName
            }),
            0.02,
            true,
        ),
    ]);
    // Of means alone: there the oracle has sets.
    let sizes: Vec<(f64, f64)> = aliased()
        .filter(|(hidden, _, _)| hidden.kind == EffectKind::Mean)
        .filter_map(|(hidden, _, case)| {
            Some((case.findings().next()?.names.len() as f64, 1.0 + hidden.aliases.len() as f64))
        })
        .collect();
    measures.push(ratio_of_sums("set_size", "aliased: size of ambiguity sets over the oracle's", &sizes, 1.2, true));
    measures
}

/// Sets that the planned runs leave with the right name alone, of those of which the oracle could tell it
/// after some runs on that floor and in that time.
fn resolved(cases: &[CaseResult]) -> [Measure; 2] {
    let sets = || cases.iter().filter_map(|case| Some((case, case.planned.as_ref()?)));
    let alone = |(case, planned): &(&CaseResult, &Planned)| {
        planned.reported.iter().any(|reported| reported.names[..] == [case.hidden[0].id.clone()])
    };
    let of: Vec<_> = sets().filter(|(_, planned)| planned.is_resolvable()).collect();
    let can = of.len();
    let detectability = share(
        "sets_that_can_be_told",
        "sets that the oracle could resolve after more runs (shown only)",
        Counted { hits: can, of: sets().count() },
        0.0,
        false,
    );
    [
        share(
            "resolved",
            "sets that can be resolved: the right name alone after the planned runs",
            count(of.iter(), alone),
            0.9,
            false,
        ),
        Measure { met: None, ..detectability },
    ]
}

/// Σa/Σb with its one-sided limit, linearised over cases.
fn ratio_of_sums(id: &'static str, what: &'static str, pairs: &[(f64, f64)], bar: f64, at_most: bool) -> Measure {
    let (a, b) = pairs.iter().fold((0.0, 0.0), |(a, b), pair| (a + pair.0, b + pair.1));
    let value = (b > 0.0 && pairs.len() > 1).then(|| a / b);
    let limit = value.map(|value| {
        let n = pairs.len() as f64;
        let squares: f64 = pairs.iter().map(|pair| (pair.0 - value * pair.1).powi(2)).sum();
        let error = (squares * n / (n - 1.0)).sqrt() / b;
        if at_most { value + 1.645 * error } else { value - 1.645 * error }
    });
    let met = limit.map(|limit| if at_most { limit <= bar } else { limit >= bar });
    Measure { id, what, value, limit, interval: None, count: None, of: pairs.len(), bar, at_most, met }
}

fn left_out(cases: &[CaseResult]) -> Vec<Measure> {
    let reported: Vec<(&OracleView, &CaseResult)> = cases
        .iter()
        .filter(|case| case.case_kind == CaseKind::LeftOut && case.findings().next().is_some())
        .filter_map(|case| Some((case.hidden.first()?, case)))
        .collect();
    let outcome = |(hidden, case): &&(&OracleView, &CaseResult)| without(hidden, case);
    let counted = reported.iter().filter(|one| outcome(one) != Without::Alias);
    vec![
        share(
            "left_out",
            "left out: not given a wrong name",
            count(counted, |one| outcome(&one) == Without::NoName),
            0.9,
            false,
        ),
        Measure {
            met: None,
            ..share(
                "left_out_alias",
                "left out: an alias is named (shown only)",
                count(reported.iter(), |one| outcome(&one) == Without::Alias),
                1.0,
                true,
            )
        },
    ]
}

/// What was said where the effect was left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Without {
    /// Nothing with a name.
    NoName,
    /// Names that this data cannot tell from the missing one.
    Alias,
    /// Another name.
    Wrong,
}

pub(crate) fn without(hidden: &OracleView, case: &CaseResult) -> Without {
    let mut worst = Without::NoName;
    for reported in case.findings() {
        if reported.names.iter().any(|name| name == "unlisted") {
            continue;
        }
        if reported.names.iter().any(|name| hidden.aliases.contains(name)) {
            if worst == Without::NoName {
                worst = Without::Alias;
            }
        } else {
            worst = Without::Wrong;
        }
    }
    worst
}

fn pairs(cases: &[CaseResult]) -> Measure {
    let both_show = |case: &&CaseResult| case.hidden.iter().all(OracleView::is_plain);
    let both = |case: &CaseResult| {
        case.hidden.iter().all(|hidden| case.findings().any(|reported| reported.names.contains(&hidden.id)))
    };
    let counted = cases.iter().filter(|case| case.case_kind == CaseKind::Pair).filter(both_show);
    share("pairs", "pairs: both in the findings", count(counted, both), 0.85, false)
}

fn gain(id: &'static str, what: &'static str, cases: &[&CaseResult], bar: f64) -> Measure {
    let pairs: Vec<(f64, f64)> = cases.iter().filter_map(|case| case.gain).map(|[found, best]| (found, best)).collect();
    ratio_of_sums(id, what, &pairs, bar, false)
}

/// Findings of singles and pairs: is the first name right as often as stated; do intervals cover?
fn probabilities(cases: &[CaseResult]) -> Vec<Measure> {
    let case_kinds = |case: &&CaseResult| matches!(case.case_kind, CaseKind::Single | CaseKind::Pair);
    let findings: Vec<(f64, bool)> = cases
        .iter()
        .filter(case_kinds)
        .flat_map(|case| case.findings().map(move |reported| (case, reported)))
        // That something has no name is no statement of which.
        .filter(|(_, reported)| reported.names[0] != "unlisted")
        .map(|(case, reported)| (reported.probability, case.hidden.iter().any(|hidden| hidden.id == reported.names[0])))
        .collect();
    // Ten bins of equal width.
    let mut bins: BTreeMap<u32, (f64, f64, f64)> = BTreeMap::new();
    for (probability, right) in &findings {
        let bin = bins.entry((probability * 10.0).clamp(0.0, 9.0) as u32).or_default();
        bin.0 += probability;
        bin.1 += f64::from(u8::from(*right));
        bin.2 += 1.0;
    }
    let n = findings.len() as f64;
    let error = (n > 0.0).then(|| bins.values().map(|(stated, right, _)| (stated - right).abs()).sum::<f64>() / n);
    let covered: Vec<bool> = cases
        .iter()
        .filter(case_kinds)
        .flat_map(|case| &case.reported)
        .flat_map(|reported| reported.covered.clone())
        .collect();
    let covers = count(covered.iter(), |covered| *covered);
    vec![
        Measure {
            id: "calibration_error",
            what: "stated probabilities: expected calibration error",
            value: error,
            limit: None,
            interval: None,
            count: None,
            of: findings.len(),
            bar: 0.05,
            at_most: true,
            met: error.map(|error| error <= 0.05),
        },
        share("coverage_low", "95 % intervals cover", covers, 0.93, false),
        share("coverage_high", "95 % intervals cover, not too often", covers, 0.97, true),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_of_sums_knows_its_error() {
        // a = b/2 exactly: no error. Its limit is itself.
        let pairs: Vec<(f64, f64)> = (1..50).map(|k| (0.5 * f64::from(k), f64::from(k))).collect();
        let exact = ratio_of_sums("", "", &pairs, 0.4, false);
        assert_eq!((exact.value, exact.met), (Some(0.5), Some(true)));
        assert!((exact.limit.expect("a limit") - 0.5).abs() < 1e-12);
    }
}
