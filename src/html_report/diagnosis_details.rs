//! What stands further down in the page of a diagnosis: other causes, what carries over, limits, appendix.

use std::collections::BTreeMap;

use ::diagnose::{Alternative, Blind, Document, Finding, GainLevel, Residuals, Status, Value};
use report_page::{Block, Cell, Section, Table};

use super::residuals;
use super::words::{count, plus_minus};
use crate::diagnosis_page::words::{p_value, question};

/// What an id means.
fn meaning(id: &str) -> String {
    effects::description(id).map_or_else(|| "in no catalogue".to_owned(), |of| of.meaning.to_owned())
}

/// Which other causes were tried, and what speaks against them.
pub(super) fn alternatives(alternatives: &[Alternative], document: &Document) -> Section {
    let detectable = alternatives.iter().filter(|alternative| alternative.status.is_tested());
    let (standing, others): (Vec<_>, Vec<_>) =
        detectable.partition(|alternative| alternative.status != Status::NotSignificant);
    let mut section = Section::new("alternatives", "What else could it be?");
    for finding in document.findings.iter().filter(|finding| finding.names.len() > 1) {
        let names: Vec<String> = finding.names.iter().map(|id| format!("{id} ({})", meaning(id))).collect();
        section = section
            .text("These data cannot tell the following causes apart; the most probable is first.")
            .with(Block::List(names));
    }
    if standing.is_empty() && others.is_empty() {
        return section.text("No other cause was tried.");
    }
    if !standing.is_empty() {
        let headings = ["what it is", "cause", "z", "log odds against the best", "outcome"];
        let mut table = Table::new("Causes that are significant when each is tried alone", &headings);
        for alternative in standing {
            table.row([
                Cell::text(meaning(&alternative.id)),
                Cell::id(alternative.id.clone()),
                Cell::number(format!("{:.1}", alternative.z)),
                Cell::number(format!("{:.1}", alternative.to_the_best)),
                Cell::text(alternative.status.text()),
            ]);
        }
        section = section.with(Block::Table(table));
    }
    if !others.is_empty() {
        let ids: Vec<String> = others.iter().map(|other| format!("{} (z = {:.1})", other.id, other.z)).collect();
        section = section.text(format!("Tried and not significant: {}.", ids.join(", ")));
    }
    section
}

/// Whether what was found holds elsewhere.
pub(super) fn carries_over(document: &Document) -> Option<Section> {
    let of_mean: Vec<&Finding> = document.findings.iter().filter(|finding| finding.is_of_the_mean()).collect();
    if of_mean.is_empty() {
        return None;
    }
    let mut section = Section::new("elsewhere", "Does it hold elsewhere?");
    for finding in of_mean {
        let answer = match finding.carries_over {
            Some(true) => "Yes",
            Some(false) => "No",
            None if finding.in_extended_model == Some(false) => {
                "These data cannot tell, and the extended model does without it, as its cause is not established"
            }
            None => "These data cannot tell",
        };
        section = section.text(format!("{answer}: {} ({}).", finding.carries_over_why, finding.id));
        for (units, what) in [(&finding.by_session, "session"), (&finding.by_kind, "kind of path")] {
            if !units.is_empty() {
                section = section.with(Block::Table(sizes_by(units, &finding.id, what)));
            }
        }
    }
    Some(section)
}

fn sizes_by(units: &BTreeMap<String, BTreeMap<String, Value>>, id: &str, what: &str) -> Table {
    let mut names: Vec<(&String, &str)> =
        units.values().flat_map(|sizes| sizes.iter().map(|(name, value)| (name, value.unit.as_str()))).collect();
    names.sort_unstable();
    names.dedup();
    let mut table = Table::new(
        &format!("Sizes of {id} by {what}: each one's own estimate, in the proportions found in all together"),
        &[what],
    );
    let heading = |(name, unit): &(&String, &str)| {
        if matches!(*unit, "1" | "") { (*name).clone() } else { format!("{name}, {unit}") }
    };
    table.headings.extend(names.iter().map(heading));
    for (unit, sizes) in units {
        let cell = |(name, _): &(&String, &str)| {
            let shown = sizes.get(*name).map_or_else(|| "–".to_owned(), |value| plus_minus(value.value, value.sigma));
            Cell::number(shown)
        };
        table.row(std::iter::once(Cell::id(unit.clone())).chain(names.iter().map(cell)));
    }
    table
}

fn limit(blind: &Blind) -> String {
    blind.smallest_detectable.as_ref().map_or_else(
        || "none".to_owned(),
        |size| {
            let unit = if size.unit == "1" { String::new() } else { format!(" {}", size.unit) };
            format!("{} = {:.1e}{unit}", size.parameter, size.value)
        },
    )
}

/// Causes that would not show, with the sizes that would.
pub(super) fn limits_table(blind: &[Blind]) -> Table {
    let headings = ["what it is", "cause", "smallest size that would show", "why"];
    let mut table = Table::new("Causes that may be there all the same", &headings);
    for of in blind {
        table.row([
            Cell::text(meaning(&of.id)),
            Cell::id(of.id.clone()),
            Cell::text(limit(of)),
            Cell::text(of.why.clone()),
        ]);
    }
    table
}

/// What these data cannot show.
pub(super) fn limits(document: &Document) -> Section {
    let section = Section::new("limits", "What these data cannot show");
    let blind = &document.blind_to;
    if blind.is_empty() {
        section.text(
            "Every known cause that these motions excite would have been detected at a size that is large for a real robot.",
        )
    } else {
        section
            .with(Block::Table(limits_table(blind)))
            .text("Sizes: detected with a probability of 0.9, at a false-positive rate of 1e-3.")
    }
}

/// Causes that would have been detected, and from which size on.
fn sensitivity(document: &Document) -> Option<Section> {
    let blind = &document.blind_to;
    let found = |id: &str| document.findings.iter().any(|finding| finding.id == id);
    let shown = document.sensitivity.iter().filter(|of| of.smallest_detectable.is_some());
    let shown: Vec<&Blind> = shown.filter(|of| blind.iter().all(|blind| blind.id != of.id) && !found(&of.id)).collect();
    if shown.is_empty() {
        return None;
    }
    let mut table = Table::new(
        "Detected with a probability of 0.9, at a false-positive rate of 1e-3",
        &["what it is", "cause", "from this size on"],
    );
    for of in shown {
        table.row([Cell::text(meaning(&of.id)), Cell::id(of.id.clone()), Cell::text(limit(of))]);
    }
    Some(Section::new("sensitivity", "Causes that would have been detected").with(Block::Table(table)))
}

/// What is closed at first.
pub(super) fn appendix(document: &Document, found: &Residuals, extended: bool) -> Vec<Section> {
    let mut appendix = Vec::new();
    let failed = document.checks.iter().filter(|check| !check.passes).count();
    let title = format!("Checks of the residuals: {failed} of {} fail", document.checks.len());
    let level = format!("At {} % for all together (Holm)", 100.0 * ::diagnose::CHECKS_LEVEL);
    let mut checks = Table::new(&level, &["question", "answer", "statistic", "p-value"]);
    for check in &document.checks {
        checks.row([
            Cell::text(question(check)),
            Cell::text(if check.passes { "yes" } else { "no" }),
            Cell::number(format!("{:.2}", check.statistic)),
            Cell::number(p_value(check.p_value)),
        ]);
    }
    appendix.push(Section::new("checks", &title).with(Block::Table(checks)));
    if !document.findings.is_empty() {
        appendix
            .push(Section::new("statistics", "Statistics of what was found").with(Block::Table(statistics(document))));
    }
    appendix.extend(sensitivity(document));
    if let Some(gains) = gains(document) {
        appendix.push(Section::new("gains", "Gain, with more and more held out").with(Block::Table(gains)));
    }
    let [shown, others] = residuals::all_charts(found, extended);
    if !(shown.is_empty() && others.is_empty()) {
        let of = shown.len() + others.len();
        let text = format!(
            "{} measurements. Of {of} pictures {} show something, the strongest first. Each picture has its own scale.",
            found.measurements,
            shown.len()
        );
        let section = Section::new("all-residuals", "Residuals against everything that was recorded");
        let mut section = section.text(residuals::HOW_TO_READ).text(text);
        if !shown.is_empty() {
            section = section.with(Block::Charts(shown));
        }
        if !others.is_empty() {
            let label = format!("{} in which nothing shows", count(others.len(), "picture"));
            section = section.with(Block::Folded(label, vec![Block::Charts(others)]));
        }
        appendix.push(section);
    }
    let words = Section::new("words", "Words").with(Block::Table(glossary()));
    appendix.push(words.text("docs/reading-a-report.md of yair goes through this page part by part."));
    appendix
}

fn statistics(document: &Document) -> Table {
    let mut table = Table::new("Findings", &["cause", "probability", "z", "p-value", "as other pages say it"]);
    for finding in &document.findings {
        table.row([
            Cell::id(finding.id.clone()),
            Cell::number(format!("{:.2}", finding.probability)),
            Cell::number(format!("{:.1}", finding.z)),
            Cell::number(p_value(finding.p_value)),
            Cell::text(finding.sentence.clone()),
        ]);
    }
    table
}

fn gains(document: &Document) -> Option<Table> {
    let gain = document.gain.as_ref()?;
    let headings =
        ["held out in turn", "drift, %", "gain, % of the distance (95 %)", "log density gained a component (95 %)"];
    let mut table = Table::new("Without and with what was found", &headings);
    for level in &gain.levels {
        let what = match level.level {
            GainLevel::Blocks => "blocks of runs",
            GainLevel::Runs => "groups of runs",
            GainLevel::Kinds => "kinds of path",
            GainLevel::Sessions => "sessions",
        };
        let (drift, gained) = level.drift_percent.map_or_else(
            || ("–".to_owned(), "–".to_owned()),
            |of| (format!("{:.3} → {:.3}", of.base, of.extended), format!("{:.3} to {:.3}", of.low, of.high)),
        );
        let score = level.log_score_per_observation;
        table.row([
            Cell::text(format!("{} {what}", level.units)),
            Cell::number(drift),
            Cell::number(gained),
            Cell::number(format!("{:.4} to {:.4}", score.low, score.high)),
        ]);
    }
    (!table.rows.is_empty()).then_some(table)
}

/// The statistical words of the page.
fn glossary() -> Table {
    const WORDS: [(&str, &str); 9] = [
        ("calibrated", "with the wheel diameters and the wheel separation that fit these runs best"),
        ("extended", "calibrated, and with the effect of what was found"),
        ("drift", "how far from the truth runs end, as a share of the distance driven"),
        (
            "± of a size",
            "one standard deviation: the true value is within it in 68 of 100 cases, within twice it in 95",
        ),
        ("95 %", "an interval that has the true value in 95 of 100 cases"),
        ("z", "how many standard deviations from nothing: above 4 is hardly an accident"),
        ("p-value", "the probability of as much by accident, when nothing is wrong"),
        ("log odds", "0 is as probable as the best cause; each −2.3 is ten times less probable"),
        ("held-out runs", "runs that a model is tested on and was not fitted to"),
    ];
    let mut table = Table::new("What the page means by its words", &["word", "meaning"]);
    WORDS.iter().for_each(|(word, meaning)| table.row([Cell::text(*word), Cell::text(*meaning)]));
    table
}
