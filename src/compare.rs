//! `yair compare DATASET... [--method M]...`

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;

use calib::{AugmentedCalibration, ComparedMethod, Comparison, KindMean, METHODS, Method};
use clap::Args;
use clap::builder::PossibleValuesParser;
use dataset::Session;
use estimation::refuse_wrapped_counters;

use crate::calibration_file::GivenCalibration;
use crate::html_report;
use crate::terminal::{Failure, Terminal, cell, read_datasets, table};

/// Compare calibrations on sessions that were not used for them.
///
/// Calibrates one robot on each of its sessions with every method, and evaluates on every other session.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets, each one a session of the same robot; a folder of datasets means all of them.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Method; may be given several times. Without it, every one.
    #[arg(long = "method", value_name = "M", value_parser = PossibleValuesParser::new(METHODS.iter().map(|method| method.name())))]
    methods: Vec<String>,
    /// Calibration file, or extended model from `yair diagnose --out`, to be evaluated on every session; may
    /// be given several times.
    #[arg(long = "calibration", value_name = "FILE")]
    calibrations: Vec<PathBuf>,
    /// Folder for report.html: the table of all methods and kinds of path. A report.html there is replaced.
    #[arg(long, value_name = "DIR")]
    out_dir: Option<PathBuf>,
}

/// Kinds of path beside each other in 100 columns.
const KINDS_A_TABLE: usize = 3;

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    html_report::refuse_file(arguments.out_dir.as_deref())?;
    let datasets = read_datasets(&arguments.datasets, terminal)?;
    let sessions: Vec<Session<'_>> = datasets.iter().map(dataset::Dataset::session).collect();
    crate::check::before(&datasets, terminal);
    refuse_wrapped_counters(&sessions)?;
    let chosen = |method: &&dyn Method| {
        arguments.methods.is_empty() || arguments.methods.iter().any(|name| name == method.name())
    };
    let methods: Vec<&dyn Method> = METHODS.iter().copied().filter(chosen).collect();
    let given = given(arguments, &sessions, terminal)?;
    let bar = terminal.progress((sessions.len() * methods.len()) as u64, "calibrations");
    let comparison = calib::compare(&sessions, &given, &methods, || bar.inc(1))?;
    bar.finish_and_clear();
    let robots: BTreeSet<String> = sessions
        .iter()
        .map(|session| {
            let robot = session.robot;
            let geometry_m = [robot.left_wheel_diameter_m, robot.right_wheel_diameter_m, robot.wheel_separation_m];
            geometry_m.map(|length_m| format!("{:.3}", 1e3 * length_m)).join(", ")
        })
        .collect();
    if let Some(out) = &arguments.out_dir {
        html_report::write_comparison(&comparison, &datasets, out)?;
        terminal.remark(&format!("report.html in {}", out.display()));
    }
    show(&comparison, given.len(), terminal)?;
    if robots.len() > 1 {
        let robots: Vec<&str> = robots.iter().map(String::as_str).collect();
        terminal.say("sessions state different nominal values, and what a method is blind to stays nominal")?;
        terminal.say(&format!("  left, right, separation in mm: {}", robots.join("; ")))?;
    }
    terminal.document(&comparison)?;
    Ok(ExitCode::SUCCESS)
}

/// The calibrations of the files.
fn given(
    arguments: &Arguments,
    sessions: &[Session<'_>],
    terminal: &Terminal,
) -> Result<Vec<AugmentedCalibration>, Failure> {
    let mut all = Vec::new();
    for path in &arguments.calibrations {
        for given in GivenCalibration::read(path)? {
            if given.changes_records() {
                let why = "it has faults of the records, which methods would not have undone; use yair evaluate";
                return Err(format!("{}: {why}", given.place()).into());
            }
            sessions.iter().try_for_each(|session| given.check(session.robot, session.name))?;
            given.remark(terminal);
            all.push(given.calibration().clone());
        }
    }
    Ok(all)
}

fn show(comparison: &Comparison, given: usize, terminal: &Terminal) -> Result<(), Failure> {
    let Some(nominal) = comparison.methods.first() else { return Ok(()) };
    let sessions_of = |kind: &str| comparison.sessions.iter().filter(|session| session.path_kind == kind).count();
    let kinds: Vec<(&str, usize)> =
        nominal.kinds.iter().map(|mean| (mean.evaluated_on.as_str(), sessions_of(&mean.evaluated_on))).collect();
    let counts: Vec<String> = kinds.iter().map(|(kind, count)| format!("{count} of {kind}")).collect();
    terminal.say(&format!("{} sessions: {}", comparison.sessions.len(), counts.join(", ")))?;
    terminal
        .say("mean error at the ends of runs that the calibration was not fitted to; n = ordered pairs of sessions")?;
    for evaluated in kinds.chunks(KINDS_A_TABLE) {
        // Units stand in the last line, a kind's name as low above them as it goes.
        let lines = evaluated.iter().map(|(kind, _)| kind.split(" + ").count()).max().unwrap_or(1);
        let above = |lines: usize| "\n".repeat(lines);
        let mut headers = vec![format!("{}trained on", above(lines)), format!("{}method", above(lines))];
        for (kind, _) in evaluated {
            let name = kind.replace(" + ", "\n+ ");
            let gap = above(lines - kind.split(" + ").count());
            headers.extend([format!("{gap}{name}\nmm"), format!("{}deg", above(lines)), format!("{}n", above(lines))]);
        }
        let mut rows = table(&headers.iter().map(String::as_str).collect::<Vec<_>>(), 2);
        for untrained in &comparison.methods[..=given] {
            rows.add_row(row("–", untrained, None, evaluated));
        }
        for (trained, _) in &kinds {
            // A kind is printed where it begins, so that the eye finds the blocks.
            let mut label = *trained;
            for method in &comparison.methods[1 + given..] {
                let refused = method.refusals.iter().filter(|refusal| refusal.path_kind == *trained).count();
                if refused < sessions_of(trained) {
                    rows.add_row(row(label, method, Some(trained), evaluated));
                    label = "";
                }
            }
        }
        terminal.say(&rows.to_string())?;
    }
    for pair in &nominal.pairs {
        if let Some(why) = &pair.why_null {
            terminal.say(&format!("nothing is evaluated on {}: {why}", pair.evaluated_on))?;
        }
    }
    let refusals = refusals(comparison, &kinds);
    if !refusals.is_empty() {
        let mut rows = table(&["method", "refused", "why"], 3);
        for refusal in refusals {
            rows.add_row(refusal);
        }
        terminal.say(&rows.to_string())?;
    }
    Ok(())
}

fn row(label: &str, method: &ComparedMethod, trained: Option<&str>, evaluated: &[(&str, usize)]) -> Vec<String> {
    let mut row = vec![label.to_owned(), method.method.clone()];
    for (kind, _) in evaluated {
        let of = |mean: &&KindMean| mean.trained_on.as_deref() == trained && mean.evaluated_on == *kind;
        let mean = method.kinds.iter().find(of);
        row.extend([
            cell(mean.and_then(|mean| mean.mean_final_position_m), 1e3, 2),
            cell(mean.and_then(|mean| mean.mean_final_heading_rad), 180.0 / std::f64::consts::PI, 3),
            mean.map_or_else(String::new, |mean| mean.pairs.to_string()),
        ]);
    }
    row
}

/// Method, which sessions it refused, and why: the reason of the first one, by name where others have their
/// own.
fn refusals(comparison: &Comparison, kinds: &[(&str, usize)]) -> Vec<[String; 3]> {
    let mut rows = Vec::new();
    for method in &comparison.methods {
        // The method stands beside it.
        let reason = |why: &str| {
            let why = why.trim_start_matches(method.method.as_str()).trim_start_matches(':');
            why.trim_start().to_owned()
        };
        let mut groups: Vec<(String, Vec<String>)> = Vec::new();
        for (kind, sessions) in kinds {
            let refused: Vec<_> = method.refusals.iter().filter(|refusal| refusal.path_kind == *kind).collect();
            let Some(first) = refused.first() else { continue };
            let own = refused.iter().any(|refusal| refusal.why != first.why);
            let why = if own { format!("{}: {}", first.dataset, reason(&first.why)) } else { reason(&first.why) };
            let of = format!("{} of {sessions} {kind}", refused.len());
            match groups.iter_mut().find(|(known, _)| *known == why) {
                Some((_, kinds)) => kinds.push(of),
                None => groups.push((why, vec![of])),
            }
        }
        rows.extend(groups.into_iter().map(|(why, of)| [method.method.clone(), of.join(", "), why]));
    }
    rows
}
