//! `replay OLD NEW`: the same logs through two builds of `yair`, and what each says of them.

mod arguments;
mod draws;

use std::collections::BTreeSet;
use std::error::Error;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use arguments::Arguments;
use clap::Parser;
use draws::{Draw, draws};
use rayon::prelude::*;
use replay::{Build, Comparison, Log, Outcome, Stored, counts, write_real};

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(code) => code,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<ExitCode, Box<dyn Error>> {
    let logs = logs(arguments, false)?;
    let said: Vec<String> = counts(&logs).into_iter().map(|(corpus, count)| format!("{count} of {corpus}")).collect();
    remark(&format!("{} logs: {}", logs.len(), said.join(", ")));
    let (old_build, old) = outcomes(arguments, &arguments.old, &logs)?;
    if let Some(file) = &arguments.store_as {
        let outcomes = logs.iter().map(|log| log.name.clone()).zip(old).collect();
        let mut bytes = serde_json::to_vec_pretty(&Stored { build: old_build, outcomes })?;
        bytes.push(b'\n');
        atomic_file::write_whole(file, &bytes)?;
        return Ok(ExitCode::SUCCESS);
    }
    let new = arguments.new.as_deref().ok_or("NEW is missing, and --store-as as well")?;
    let known = if arguments.knows_wheels { self::logs(arguments, true)? } else { logs.clone() };
    if known.iter().map(|log| &log.name).ne(logs.iter().map(|log| &log.name)) {
        return Err("logs with known wheels are not those without".into());
    }
    let (new_build, new) = outcomes(arguments, new, &known)?;
    remark(&format!("old: {old_build}; new: {new_build}"));
    let comparison = Comparison::of(&logs, &old, &new);
    let mut output = std::io::stdout().lock();
    if arguments.json {
        serde_json::to_writer_pretty(&mut output, &comparison)?;
        writeln!(output)?;
    } else {
        write!(output, "{}", comparison.text())?;
    }
    let lost: Vec<&str> = comparison.lost().iter().map(|paired| paired.measure).collect();
    if arguments.check && !lost.is_empty() {
        remark(&format!("error: lost beyond the margins of CONTRIBUTING.md and beyond chance: {}", lost.join(", ")));
        return Ok(ExitCode::FAILURE);
    }
    Ok(ExitCode::SUCCESS)
}

/// The logs of every corpus; drawn ones are written where they are not there yet.
fn logs(arguments: &Arguments, knows_wheels: bool) -> Result<Vec<Log>, Box<dyn Error>> {
    let drawn = arguments.store.join(if knows_wheels { "known_wheels" } else { "logs" });
    let draws = draws(arguments);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.jobs).build()?;
    let done = progress("logs drawn", draws.len());
    pool.install(|| {
        draws.par_iter().try_for_each(|draw| {
            done();
            draw.write(&drawn, knows_wheels)
        })
    })?;
    let mut logs = if draws.is_empty() { Vec::new() } else { Log::all(&drawn)? };
    let asked: BTreeSet<String> = draws.iter().map(Draw::name).collect();
    logs.retain(|log| asked.contains(&log.name));
    if let Some(data) = &arguments.real {
        let real = arguments.store.join("real");
        write_real(&real, data)?;
        logs.extend(Log::all(&real)?);
    }
    for corpus in &arguments.corpus {
        logs.extend(Log::all(corpus)?);
    }
    if logs.is_empty() {
        return Err("no logs: every number is 0, and neither --real nor --corpus is given".into());
    }
    Ok(logs)
}

/// What a build says of the logs, and which build that is.
fn outcomes(arguments: &Arguments, words: &str, logs: &[Log]) -> Result<(String, Vec<Outcome>), Box<dyn Error>> {
    if Path::new(words).extension().is_some_and(|extension| extension == "json") {
        let stored: Stored = serde_json::from_slice(&fs::read(words)?)?;
        let of = |log: &Log| {
            let outcome = stored.outcomes.get(&log.name).cloned();
            outcome.ok_or_else(|| {
                format!("{}: {words} has no outcome of it; store its outcomes anew (--store-as)", log.name)
            })
        };
        let outcomes: Vec<Outcome> = logs.iter().map(of).collect::<Result<_, _>>()?;
        let others = logs.iter().zip(&outcomes).filter(|(log, outcome)| log.digest != outcome.log).count();
        if others > 0 {
            remark(&format!(
                "{others} of {} logs differ in a byte from those of {words}: drawn on another kind of processor, or by another draw; after a change of the draw store its outcomes anew (--store-as)",
                logs.len()
            ));
        }
        return Ok((stored.build.clone(), outcomes));
    }
    let build = Build::of(words)?;
    let done = progress(&format!("logs through {words}"), logs.len());
    let outcomes = build.outcomes(logs, &arguments.store.join("outcomes"), arguments.jobs, &done)?;
    Ok((build.id, outcomes))
}

fn remark(what: &str) {
    let _ = writeln!(std::io::stderr(), "{what}");
}

/// Says at every tenth how much is done.
fn progress(what: &str, all: usize) -> impl Fn() + Sync + use<> {
    let (what, count) = (what.to_owned(), AtomicUsize::new(0));
    move || {
        let done = count.fetch_add(1, Ordering::Relaxed) + 1;
        if done * 10 / all.max(1) != (done - 1) * 10 / all.max(1) {
            remark(&format!("{done} of {all} {what}"));
        }
    }
}
