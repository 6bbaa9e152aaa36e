//! `yair diagnose DATASET... [--out DIR] [--without ID]...`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use ::diagnose::{
    Diagnosis, Document, Finding, GainLevel, LevelGain, NestedGain, OnStage, Options, Stage, nested_gains,
};
use calib::{CalibrationReport, TrainedOn};
use clap::Args;
use dataset::Dataset;
use indicatif::ProgressBar;

use crate::check;
use crate::diagnosis_page::Page;
use crate::html_report::DiagnosisPage;
use crate::log::Log;
use crate::plain_text::one_line;
use crate::simulate::{refuse_filled, write_folder, write_whole};
use crate::terminal::{Failure, Terminal, advance, cell, table};

/// Find what a calibration leaves: the cause, its size, and what its correction gains on held-out runs.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets; several are one robot's sessions, diagnosed together. A folder of datasets means all of
    /// them.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Folder for report.html, report.md with its pictures, findings.json, calibration.toml, and
    /// extended.toml, a scenario of the robot as found.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Take an effect out of the catalogue; may be given several times.
    #[arg(long = "without", value_name = "ID")]
    without: Vec<String>,
    /// Diagnose again without each session and each kind of path, and show what these models gain on it.
    /// Costs a diagnosis for each.
    #[arg(long)]
    nested: bool,
    /// Write into a folder that is not empty.
    #[arg(long)]
    force: bool,
    /// File for models of an experiment, a line of JSON each (docs/one-model.md).
    #[arg(long, value_name = "FILE", hide = true)]
    beam: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    if let Some(out) = &arguments.out {
        refuse_filled(out, arguments.force)?;
    }
    let log = Log::read(&arguments.datasets, terminal)?;
    check::before(log.datasets(), terminal);
    let bar = terminal.stages("diagnose");
    let (without, on_stage) = (arguments.without.clone(), shown_on(bar.clone()));
    let mut options = Options { without, on_stage, beam: arguments.beam.is_some(), ..Options::default() };
    options.limits = options.limits.filter(|_| !options.beam);
    let diagnosis = ::diagnose::diagnose(&log, &options);
    bar.finish_and_clear();
    let mut diagnosis = diagnosis?;
    if let Some(file) = &arguments.beam {
        let lines: Result<Vec<String>, _> = diagnosis.beam.iter().map(serde_json::to_string).collect();
        write_whole(file, lines?.join("\n").as_bytes())?;
    }
    if arguments.nested {
        let options = Options { without: arguments.without.clone(), ..Options::default() };
        diagnosis.document.nested = nested_gains(log.datasets(), &options)?;
        if diagnosis.document.nested.is_empty() {
            terminal.remark("--nested: one session and one kind of path leave nothing to be held out");
        }
    }
    if let Some(out) = &arguments.out {
        write_diagnosis(&mut diagnosis, log.datasets(), &arguments.datasets, out, arguments.force)?;
        terminal.remark(&format!(
            "findings in {}; report.html is to be looked at, report.md has the same text",
            out.display()
        ));
    } else if diagnosis.extended.is_ok() {
        diagnosis.document.extended_model_why_null = Some("it is written where --out says".to_owned());
    }
    let document = &diagnosis.document;
    show(document, terminal)?;
    terminal.document(document)?;
    Ok(ExitCode::SUCCESS)
}

/// Stages of a diagnosis on a bar.
pub(crate) fn shown_on(bar: ProgressBar) -> OnStage {
    OnStage::call(move |stage: Stage| advance(&bar, stage.name, stage.done))
}

/// Writes the files of a diagnosis into a folder, which is made where it is not there; into one with files in
/// it where that is forced.
pub(crate) fn write_diagnosis(
    diagnosis: &mut Diagnosis,
    datasets: &[Dataset],
    given: &[PathBuf],
    out: &Path,
    force: bool,
) -> Result<(), Failure> {
    write_folder(out, force, |folder| {
        if let Ok(scenario) = &diagnosis.extended {
            let name = "extended.toml";
            let text = [reservations(&diagnosis.document), scenario.to_toml()?].concat();
            write_whole(&folder.join(name), text.as_bytes())?;
            diagnosis.document.extended_model = Some(out.join(name).display().to_string());
        }
        if let Some(geometry) = &diagnosis.geometry_alone {
            let name = "calibration.toml";
            let trained_on = datasets.iter().map(|dataset| TrainedOn::of(&dataset.session())).collect();
            let report = CalibrationReport { trained_on, ..geometry.clone() };
            write_whole(&folder.join(name), report.to_toml()?.as_bytes())?;
            diagnosis.document.calibration_file = Some(out.join(name).display().to_string());
        }
        let Diagnosis { document, residuals, alternatives, .. } = &*diagnosis;
        write_whole(&folder.join("findings.json"), &serde_json::to_vec_pretty(document)?)?;
        Page { document, residuals, alternatives }.write(folder)?;
        DiagnosisPage { diagnosis, datasets, given, out }.write(folder)
    })
}

/// What the extended model does not say of itself: terms of which nobody can tell whether they hold
/// elsewhere, and those that were left out because they do not.
fn reservations(document: &Document) -> String {
    let of = |finding: &Finding| {
        let what = match (finding.carries_over, finding.in_extended_model) {
            (Some(true), _) => return None,
            (Some(false), _) => "is left out, as it does not hold elsewhere",
            (None, Some(false)) => "is left out, as its cause is not established",
            (None, _) => "may not hold in other sessions and kinds of path",
        };
        finding
            .is_of_the_mean()
            .then(|| format!("# {} {what}: {}\n", finding.names.join(" or "), one_line(&finding.carries_over_why)))
    };
    document.findings.iter().filter_map(of).collect()
}

/// What models gain whose effects were chosen without what they are measured on.
fn show_nested(nested: &NestedGain, terminal: &Terminal) -> Result<(), Failure> {
    let (whole, unit) = match nested.level {
        GainLevel::Kinds => ("kinds of path", "kind of path"),
        _ => ("sessions", "session"),
    };
    terminal.say(&format!(
        "with whole {whole} left out of the diagnosis, {} in turn ({} without an extension):",
        nested.units, nested.abstained
    ))?;
    let mut rows = table(&[unit, "found by the others", "ends off, mm", "extended", "gain, 95 %"], 2);
    for held in &nested.held_out {
        let found = match (&held.found, &held.why_null) {
            (Some(found), _) if found.is_empty() => "nothing".to_owned(),
            (Some(found), _) => found.join(", "),
            (None, why) => why.clone().unwrap_or_default(),
        };
        let ends = held.final_position_m.as_ref();
        let mm = |metres: f64| 1e3 * metres;
        let interval = ends.map(|ends| format!("{:.1} to {:.1}", mm(ends.low), mm(ends.high)));
        rows.add_row([
            held.unit.clone(),
            found,
            cell(ends.map(|ends| ends.base), 1e3, 1),
            cell(ends.map(|ends| ends.extended), 1e3, 1),
            interval.unwrap_or_else(|| "–".to_owned()),
        ]);
    }
    terminal.say(&rows.to_string())?;
    if let Some(drift) = &nested.drift_percent {
        terminal.say(&format!(
            "over all: drift {:.3} % → {:.3} % (gain {:.3} to {:.3})",
            drift.base, drift.extended, drift.low, drift.high
        ))?;
    }
    Ok(())
}

fn show(document: &Document, terminal: &Terminal) -> Result<(), Failure> {
    terminal.say(&document.sentence)?;
    if let Some(subsample) = &document.subsample {
        terminal.say(&subsample.sentence)?;
    }
    if !document.findings.is_empty() {
        let mut findings = table(&["finding", "names", "probability", "z"], 2);
        for finding in &document.findings {
            findings.add_row([
                finding.id.clone(),
                finding.names.join(", "),
                cell(Some(finding.probability), 1.0, 2),
                cell(Some(finding.z), 1.0, 1),
            ]);
        }
        terminal.say(&findings.to_string())?;
        for finding in &document.findings {
            terminal.say(&finding.sentence)?;
            if finding.is_of_the_mean() && finding.carries_over != Some(false) {
                let carries = match (finding.carries_over, finding.in_extended_model) {
                    (Some(_), _) => "consistent",
                    (None, Some(false)) => {
                        "not in the extended model, as its cause is not established; whether it holds elsewhere is open"
                    }
                    (None, _) => "whether it holds elsewhere is open",
                };
                terminal.say(&format!("  {carries}: {}", finding.carries_over_why))?;
            }
        }
    }
    for check in document.checks.iter().filter(|check| !check.passes) {
        terminal.say(&format!("fails: {} (p = {:.1e})", check.name, check.p_value))?;
    }
    if let Some(gain) = &document.gain {
        let score = gain.log_score_per_observation;
        terminal.say(&format!(
            "cross-validated over {} runs: mean log predictive density {:.4} → {:.4} (gain {:.4} to {:.4})",
            gain.held_out_runs, score.base, score.extended, score.low, score.high
        ))?;
        if let Some(drift) = gain.drift_percent {
            terminal.say(&format!(
                "cross-validated drift {:.3} % → {:.3} % (gain {:.3} to {:.3})",
                drift.base, drift.extended, drift.low, drift.high
            ))?;
        }
    }
    for LevelGain { level, units, drift_percent, .. } in document.gain.iter().flat_map(|gain| &gain.levels) {
        let (GainLevel::Kinds | GainLevel::Sessions, Some(drift)) = (level, drift_percent) else { continue };
        let whole = if *level == GainLevel::Kinds { "kinds of path" } else { "sessions" };
        terminal.say(&format!(
            "with whole {whole} held out, {units} in turn: drift {:.3} % → {:.3} % (gain {:.3} to {:.3})",
            drift.base, drift.extended, drift.low, drift.high
        ))?;
    }
    for nested in &document.nested {
        show_nested(nested, terminal)?;
    }
    if let Some(next) = &document.next_experiment {
        terminal.say(&format!("next experiment (details: yair plan): {}", next.drive))?;
    }
    let blind: Vec<&str> = document.blind_to.iter().map(|blind| blind.id.as_str()).collect();
    if !blind.is_empty() {
        terminal.say(&format!("not detectable in this data: {}", blind.join(", ")))?;
    }
    Ok(())
}
