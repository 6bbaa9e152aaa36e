//! `yair challenge [--cases N] [--seed S] [--case K [--out DIR]]`

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use blind_benchmark::{CaseResult, ChallengeResult, Measure, challenge, challenge_case, challenge_datasets};
use clap::Args;
use dataset::Existing;

use crate::terminal::{Failure, Terminal, cell, table};

/// The blind benchmark of `diagnose`: random robots with hidden effects, nulls and effects that are left out
/// of the catalogue, against an oracle.
#[derive(Args)]
pub(crate) struct Arguments {
    /// How many cases; the bars are meant for 2000 and more.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=MAX_CASES))]
    cases: u64,
    /// Seed of every random draw.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Drive this case alone and show what was hidden and what was said.
    #[arg(long, value_name = "K", conflicts_with = "cases")]
    case: Option<u64>,
    /// Write the datasets of --case into this folder, one folder a session.
    #[arg(long, value_name = "DIR", requires = "case")]
    out: Option<PathBuf>,
    /// Threads; 0 = one a core. The result does not depend on it.
    #[arg(long, value_name = "J", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024))]
    jobs: u16,
}

/// A week of computing; a typing error beyond.
const MAX_CASES: u64 = 1_000_000;

/// Most lines of confusions that a person reads.
const MAX_SHOWN: usize = 60;

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    if let Some(number) = arguments.case {
        return one(arguments, number, terminal);
    }
    let bar = terminal.progress(arguments.cases, "cases");
    let started = Instant::now();
    let result = challenge(arguments.seed, arguments.cases, arguments.jobs.into(), &|| bar.inc(1))?;
    bar.finish_and_clear();
    show(&result, terminal)?;
    terminal.document(&result)?;
    terminal.remark(&format!("{} cases in {:.1} s", arguments.cases, started.elapsed().as_secs_f64()));
    Ok(ExitCode::SUCCESS)
}

fn one(arguments: &Arguments, number: u64, terminal: &Terminal) -> Result<ExitCode, Failure> {
    match challenge_case(arguments.seed, number)? {
        Ok(result) => {
            terminal.document(&result)?;
            show_case(&result, terminal)?;
        }
        Err(id) => {
            let why = format!("no robot and no path that was drawn for {id} shows it: the case is left out");
            terminal.document(&serde_json::json!({ "case": number, "never_shown": id }))?;
            terminal.say(&why)?;
        }
    }
    if let Some(out) = &arguments.out {
        for (session, dataset) in challenge_datasets(arguments.seed, number)?.iter().enumerate() {
            dataset::write(dataset, &out.join(format!("session_{session}")), Existing::Refuse)?;
        }
        terminal.remark(&format!("datasets in {}", out.display()));
    }
    Ok(ExitCode::SUCCESS)
}

fn show_case(result: &CaseResult, terminal: &Terminal) -> Result<(), Failure> {
    let [sessions, runs, measurements] = result.counts;
    terminal.say(&format!(
        "case {}: {:?}, {:?} paths, {:?} truth, {:?} noise; {sessions} sessions, {runs} runs, {measurements} measurements",
        result.case, result.case_kind, result.paths, result.truth, result.noise
    ))?;
    for hidden in &result.hidden {
        let sizes: Vec<String> = hidden.values.iter().map(|(name, size)| format!("{name} = {size:.3e}")).collect();
        let form = if hidden.other_form { ", in another form" } else { "" };
        terminal.say(&format!("hidden: {}{form}: {}", hidden.id, sizes.join(", ")))?;
        if let Some(ratio) = hidden.ratio {
            let aliases = if hidden.aliases.is_empty() { "none".to_owned() } else { hidden.aliases.join(", ") };
            terminal.say(&format!(
                "  {ratio:.2} times the detection limit; effects that are not discriminated from it: {aliases}"
            ))?;
        }
    }
    if let Some(why) = &result.refused {
        terminal.say(&format!("refused: {why}"))?;
    }
    for reported in &result.reported {
        let names = reported.names.join(", ");
        terminal.say(&format!(
            "said: {names} (probability {:.2}, z = {:.1}): {}",
            reported.probability, reported.z, reported.sentence
        ))?;
    }
    if result.reported.is_empty() && result.refused.is_none() {
        terminal.say("said: nothing")?;
    }
    if !result.failed_checks.is_empty() {
        terminal.say(&format!("fails: {}", result.failed_checks.join(", ")))?;
    }
    if let Some([found, possible]) = result.gain {
        terminal.say(&format!("gain on the held-out log: {found:.1} of {possible:.1}"))?;
    }
    if let Some(planned) = &result.planned {
        let reported: Vec<String> = planned.reported.iter().map(|reported| reported.names.join("|")).collect();
        let reported = if reported.is_empty() { "nothing".to_owned() } else { reported.join(" + ") };
        let can = if planned.is_resolvable() {
            "the right cause can be discriminated"
        } else {
            "no experiment discriminates the right cause"
        };
        terminal.say(&match planned.planned {
            true => format!("after the planned runs: {reported}; by the oracle {can}"),
            false => format!("no planned runs; by the oracle {can}"),
        })?;
    }
    Ok(())
}

fn show(result: &ChallengeResult, terminal: &Terminal) -> Result<(), Failure> {
    let mut rows = table(&["measure", "value", "95 % limit", "bar", "of", "met"], 1);
    for measure in &result.measures {
        let Measure { what, value, limit, of, bar, at_most, met, .. } = measure;
        let sense = if *at_most { "≤" } else { "≥" };
        rows.add_row([
            (*what).to_owned(),
            cell(*value, 1.0, 3),
            cell(*limit, 1.0, 3),
            met.map_or_else(String::new, |_| format!("{sense} {bar:.2}")),
            of.to_string(),
            met.map_or("–", |met| if met { "yes" } else { "no" }).to_owned(),
        ]);
    }
    terminal.say(&rows.to_string())?;
    // What went wrong, the most frequent first.
    let mut wrong: Vec<_> =
        result.confusions.iter().filter(|confusion| confusion.hidden != confusion.reported).collect();
    wrong.retain(|confusion| (confusion.hidden.as_str(), confusion.reported.as_str()) != ("nothing", "nothing"));
    wrong.sort_by(|a, b| b.count.cmp(&a.count).then(a.cmp(b)));
    let mut list = table(&["round", "hidden", "said", "cases", "such as"], 3);
    for confusion in wrong.iter().take(MAX_SHOWN) {
        list.add_row([
            confusion.case_kind.clone(),
            confusion.hidden.clone(),
            confusion.reported.clone(),
            confusion.count.to_string(),
            confusion.cases.iter().take(3).map(u64::to_string).collect::<Vec<_>>().join(", "),
        ]);
    }
    terminal.say(&list.to_string())?;
    if wrong.len() > MAX_SHOWN {
        terminal.say(&format!("and {} more; --json has all", wrong.len() - MAX_SHOWN))?;
    }
    if !result.never_shown.is_empty() {
        let never: Vec<String> = result.never_shown.iter().map(|(id, times)| format!("{id} ({times})")).collect();
        terminal.say(&format!("no robot drawn shows: {}", never.join(", ")))?;
    }
    Ok(())
}
