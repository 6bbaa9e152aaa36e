//! The pages of a plan, of a sweep and of the paper's reproduction.

use std::path::Path;

use ::bench::SweepResult;
use ::diagnose::{Blind, NextExperiment};
use paper_reproduction::Reproduction;
use report_page::{Block, Cell, Report, Section, Table, Tile, Tone};

use super::diagnosis_details::limits_table;
use super::words::count;
use super::{made_by, markdown, next_drive, sweep_charts};
use crate::terminal::Failure;

/// A page of numbers without a judgement.
fn page(command: &str, subject: String, headline: String, lead: &str) -> Report {
    Report {
        command: command.to_owned(),
        subject,
        tone: Tone::Neutral,
        headline,
        lead: lead.to_owned(),
        bars: None,
        tiles: Vec::new(),
        sections: Vec::new(),
        appendix: Vec::new(),
        made_by: made_by(Vec::new()),
    }
}

/// The page of a plan, with what is not detectable under its title.
pub(crate) fn write_plan(
    subject: &str,
    next: &NextExperiment,
    title: &str,
    blind: &[Blind],
    out: &Path,
) -> Result<(), Failure> {
    let lead = format!("Sought {}.", next.within);
    let mut page = page("yair plan", subject.to_owned(), next_drive::headline(next), &lead);
    page.tiles.push(next_drive::tile_of(next));
    page.tiles.push(Tile {
        label: "Runs".to_owned(),
        value: next.runs.to_string(),
        note: "with the handling between them".to_owned(),
        section: "next".to_owned(),
    });
    page.sections.push(next_drive::section_of(next));
    if !blind.is_empty() {
        let section = Section::new("limits", title);
        page.sections.push(section.with(Block::Table(limits_table(blind))));
    }
    super::write(&page, out)
}

/// The page of a sweep, with the picture that stands in its folder.
pub(crate) fn write_sweep(result: &SweepResult, out: &Path) -> Result<(), Failure> {
    let points = count(result.points.len(), "point");
    let headline = format!("How well each method calibrates: {}, {points}.", result.scenario);
    let lead = format!(
        "{} trials a point, seed {}. Errors in per cent of the true value; ± is the Monte-Carlo standard error.",
        result.trials, result.seed
    );
    let mut page = page("yair sweep", result.scenario.clone(), headline, &lead);
    // The same bits whatever the jobs, shards and interruptions: no command line.
    page.made_by.command_line =
        format!("scenario {}, seed {}, {} trials a point", result.scenario, result.seed, result.trials);
    // A sweep without an axis has no picture.
    if let Some(figure) = ::bench::sweep_figure(result) {
        let section = Section::new("picture", "At a glance").text(figure.caption_text());
        let charts = figure.panels().iter().map(sweep_charts::chart).collect();
        page.sections.push(section.with(Block::Charts(charts)));
    }
    page.sections.push(Section::new("table", "Every point").with(Block::Table(sweep_table(result))));
    super::write(&page, out)
}

fn sweep_table(result: &SweepResult) -> Table {
    let headings =
        ["point", "method", "parameter", "bias, %", "standard deviation, %", "RMSE, %", "covers", "RMSE²/bound"];
    let mut table = Table::new("Errors of every method", &headings);
    for (number, point) in result.points.iter().enumerate() {
        let levels: Vec<String> = point.levels.iter().map(|(key, level)| format!("{key} = {level}")).collect();
        let name = if levels.is_empty() { (number + 1).to_string() } else { levels.join(", ") };
        for of in &point.estimators {
            let percent = |value: Option<(f64, f64)>| {
                let shown = |(value, error): (f64, f64)| {
                    super::words::plus_minus(100.0 * value / of.truth, Some((100.0 * error / of.truth).abs()))
                };
                value.map_or_else(|| "–".to_owned(), shown)
            };
            let covers = of.coverage_95.map_or_else(|| "–".to_owned(), |of| format!("{:.1} %", 100.0 * of.share));
            let ratio = of.cramer_rao_ratio.map_or_else(|| "–".to_owned(), |ratio| format!("{ratio:.3}"));
            table.row([
                Cell::text(name.clone()),
                Cell::id(of.method.clone()),
                Cell::id(of.parameter.clone()),
                Cell::number(percent(of.bias.zip(of.bias_mcse))),
                Cell::number(percent(of.std())),
                Cell::number(percent(of.rmse.zip(of.rmse_mcse))),
                Cell::number(covers),
                Cell::number(ratio),
            ]);
        }
    }
    table
}

/// The page of the paper's reproduction: its Markdown with its figures.
pub(crate) fn write_reproduction(reproduction: &Reproduction, markdown: &str, out: &Path) -> Result<(), Failure> {
    const IDS: [&str; 8] = ["summary", "part-1", "part-2", "part-3", "part-4", "part-5", "part-6", "part-7"];
    let headline = "The paper's tables and figures from simulation, with the published values.";
    let mut page = page("yair reproduce", "Navarro, Benet, Ríos, Bueno".to_owned(), headline.to_owned(), "");
    page.sections = markdown::sections(markdown, &IDS, "Summary");
    let mut figures = Section::new("figures", "Figures");
    for (_, alt, figure) in reproduction.pictures() {
        figures = figures.with(Block::Svg(alt.to_owned(), figure.to_svg()?)).text(alt);
    }
    page.sections.push(figures);
    super::write(&page, out)
}
