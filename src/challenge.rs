//! `yair challenge [--cases N] [--seed S] [--instrument NAME] [--case K [--out DIR]] [--shard I/N --out DIR]
//! [--merge DIR...] [--check BASELINE [--update]]`

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use blind_benchmark::{
    CaseInstrument, CaseResult, ChallengeResult, DiagnosisBaseline, DiagnosisCheck, Measure, Scope, challenge_case,
    challenge_datasets, challenge_outcomes,
};
use clap::Args;
use dataset::Existing;
use serde::Serialize;

use crate::challenge_shard::{ChallengeCampaign, ChallengeShard, merged};
use crate::new_folders::NewFolders;
use crate::shard::{ShardChoice, locked};
use crate::terminal::{Failure, Terminal, cell, table};

/// Challenge `diagnose` by the blind benchmark: random robots with hidden effects, against an oracle.
#[derive(Args)]
pub(crate) struct Arguments {
    /// How many cases; the bars are meant for 2000 and more, and a case takes seconds of a core. Without it
    /// 200, and with --check 440, as the stored baseline.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_CASES))]
    cases: Option<u64>,
    /// Seed of every random draw.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Drive this case alone and show what was hidden and what was said.
    #[arg(long, value_name = "K", conflicts_with = "cases", group = "writes")]
    case: Option<u64>,
    /// Hide large effects alone: one of the mean in each case, at ten to a hundred of its detection limits.
    #[arg(long, conflicts_with = "check")]
    large: bool,
    /// Hide one effect of the mean in one long log each, and diagnose it as it is and cut into runs at its
    /// stops.
    #[arg(long, conflicts_with_all = ["check", "large"])]
    one_log: bool,
    /// See every case by one instrument: capture, slam, gyro-tape, wall or revisit. Even cases are nulls, odd
    /// ones hide one effect that the instrument can show.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["check", "large", "one_log"])]
    instrument: Option<CaseInstrument>,
    /// Drive part I of N only and leave it in the folder of --out; --merge puts the parts together. auto: as
    /// of yair sweep.
    #[arg(long, value_name = "I/N|auto", requires = "out", group = "writes")]
    shard: Option<ShardChoice>,
    /// Put the parts of a campaign in these folders together, in any order; the result is that of one
    /// machine, to the bit.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["cases", "seed", "case", "large", "one_log", "instrument", "shard", "out", "jobs"])]
    merge: Vec<PathBuf>,
    /// Write the datasets of --case, one folder a session, or the part of --shard into this folder.
    #[arg(long, value_name = "DIR", requires = "writes")]
    out: Option<PathBuf>,
    /// Compare with a stored campaign; exit 1 when any kind of failure got more frequent. Driven are
    /// nulls, and the single effects of every second block of twenty.
    #[arg(long, value_name = "BASELINE", conflicts_with = "case")]
    check: Option<PathBuf>,
    /// Write the baseline of --check anew.
    #[arg(long, requires = "check")]
    update: bool,
    /// Threads; 0 = one a core. The result does not depend on it.
    #[arg(long, value_name = "J", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024))]
    jobs: u16,
}

/// Cases where none are asked for: an idea of the measures in minutes.
const DEFAULT_CASES: u64 = 200;

/// Cases of the stored baseline.
const CHECKED_CASES: u64 = 440;

/// What a case takes on a core at the most, in the optimised build: 2400 cases took 13 min 27 s on two cores
/// (docs/performance.md), three quarters of this.
const SECONDS_A_CASE: f64 = 0.9;

/// A week of computing; a typing error beyond.
const MAX_CASES: u64 = 1_000_000;

/// Most lines of confusions that a person reads.
const MAX_SHOWN: usize = 60;

impl Arguments {
    fn scope(&self) -> Scope {
        if let Some(instrument) = self.instrument {
            return Scope::Instrument(instrument);
        }
        if self.one_log {
            return Scope::OneLog;
        }
        match (self.large, self.check.is_some()) {
            (true, _) => Scope::Large,
            (false, true) => Scope::Guarded,
            (false, false) => Scope::Whole,
        }
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    if let Some(number) = arguments.case {
        return one(arguments, number, terminal);
    }
    // Whatever can go wrong at the end is looked at before the cases.
    let baseline = match &arguments.check {
        Some(path) if !arguments.update => Some(DiagnosisBaseline::read(path)?),
        _ => None,
    };
    if !arguments.merge.is_empty() {
        let (campaign, outcomes) = merged(&arguments.merge)?;
        if arguments.check.is_some() && campaign.scope != Scope::Guarded {
            return Err("these parts are of a campaign without --check, which drives other cases".into());
        }
        let result = ChallengeResult::of(campaign.seed, outcomes);
        return tell(arguments, campaign.seed, campaign.cases, &result, baseline.as_ref(), terminal);
    }
    let cases = arguments.cases.unwrap_or(if arguments.check.is_some() { CHECKED_CASES } else { DEFAULT_CASES });
    let shard = arguments.shard.map(|shard| shard.resolved(terminal)).transpose()?;
    let numbers = shard.map_or(0..cases, |shard| shard.share(cases));
    let _new = arguments.out.as_deref().map(NewFolders::to);
    let _lock = arguments.out.as_deref().map(|out| locked(out, terminal)).transpose()?;
    let count = numbers.end - numbers.start;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = if arguments.jobs == 0 { cores } else { arguments.jobs.into() };
    let minutes = count as f64 * SECONDS_A_CASE / (60.0 * jobs as f64);
    terminal.remark(&format!("{count} cases on {jobs} threads: about {:.0} minutes", minutes.max(1.0)));
    let bar = terminal.progress(count, "cases");
    let started = Instant::now();
    let scope = arguments.scope();
    let outcomes = challenge_outcomes(arguments.seed, numbers, scope, arguments.jobs.into(), &|| bar.inc(1))?;
    bar.finish_and_clear();
    terminal.remark(&format!("{} cases in {:.1} s", outcomes.len(), started.elapsed().as_secs_f64()));
    if let Some(shard) = shard {
        let out = arguments.out.as_deref().unwrap_or(Path::new("."));
        ChallengeShard::new(ChallengeCampaign::new(arguments.seed, cases, scope), shard, outcomes).write(out)?;
        terminal.remark(&format!("part {shard} is in {}; --merge combines the parts", out.display()));
        return Ok(ExitCode::SUCCESS);
    }
    let result = ChallengeResult::of(arguments.seed, outcomes);
    tell(arguments, arguments.seed, cases, &result, baseline.as_ref(), terminal)
}

/// Shows a campaign, and holds it against the baseline or makes it one.
fn tell(
    arguments: &Arguments,
    seed: u64,
    cases: u64,
    result: &ChallengeResult,
    baseline: Option<&DiagnosisBaseline>,
    terminal: &Terminal,
) -> Result<ExitCode, Failure> {
    let now = DiagnosisBaseline::of(seed, cases, &result.cases);
    let check = baseline.map(|baseline| baseline.check(&now));
    show(result, terminal)?;
    terminal.document(&Document { result, check: check.as_ref() })?;
    if let Some(path) = arguments.check.as_ref().filter(|_| arguments.update) {
        let mut bytes = serde_json::to_vec_pretty(&now)?;
        bytes.push(b'\n');
        atomic_file::write_whole(path, &bytes).map_err(|error| format!("{}: {error}", path.display()))?;
        terminal.remark(&format!("baseline {} is written", path.display()));
    }
    check.map_or(Ok(ExitCode::SUCCESS), |check| conclude(&check, terminal))
}

/// A campaign's document with what a check adds.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    result: &'a ChallengeResult,
    #[serde(skip_serializing_if = "Option::is_none")]
    check: Option<&'a DiagnosisCheck>,
}

/// Says what the comparison with the baseline gave.
fn conclude(check: &DiagnosisCheck, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let mut rows = table(&["failures", "was", "is", "new", "mended", "p"], 1);
    let of = |(failures, of): (usize, usize)| format!("{failures} of {of}");
    let number = |cases: &Option<Vec<u64>>| cases.as_ref().map_or("–".to_owned(), |cases| cases.len().to_string());
    for guarded in &check.guarded {
        let p_value = format!("{:.2e}", guarded.p_value);
        let counts = [of(guarded.was), of(guarded.is), number(&guarded.new_failures), number(&guarded.mended), p_value];
        rows.add_row([guarded.what.clone()].into_iter().chain(counts));
    }
    terminal.say(&rows.to_string())?;
    let worse: Vec<String> = check
        .worse()
        .iter()
        .map(|guarded| {
            let (is, was, p_value) = (of(guarded.is), of(guarded.was), guarded.p_value);
            let such_as = guarded.new_failures.iter().flatten().take(3).map(u64::to_string).collect::<Vec<_>>();
            let such_as =
                if such_as.is_empty() { String::new() } else { format!(", such as cases {}", such_as.join(", ")) };
            format!("{}: {is}, where the baseline has {was} (p = {p_value:.1e}){such_as}", guarded.what)
        })
        .collect();
    if worse.is_empty() {
        terminal.say(&format!(
            "diagnosis: {} kinds of failure compared, none more frequent at p < {:.4} (false-alarm budget {})",
            check.guarded.len(),
            check.level,
            check.false_alarm_budget
        ))?;
        return Ok(ExitCode::SUCCESS);
    }
    Err(format!("diagnosis got worse: {}", worse.join("; ")).into())
}

fn one(arguments: &Arguments, number: u64, terminal: &Terminal) -> Result<ExitCode, Failure> {
    match challenge_case(arguments.scope(), arguments.seed, number)? {
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
        let _new = NewFolders::to(out);
        for (session, dataset) in challenge_datasets(arguments.scope(), arguments.seed, number)?.iter().enumerate() {
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
    let drawn = &result.drawn;
    terminal.say(&format!(
        "wheelbase {:.0} mm, {:.0} ticks a turn ({:.3} mm), {:.0} rows/s, stamps {:?}, {:.1} measurements/s of {:.1} mm, {:?} wheels",
        1e3 * drawn.wheel_separation_m,
        drawn.ticks_per_turn,
        1e3 * drawn.tick_m,
        drawn.log_rate_hz,
        result.strata.stamps,
        drawn.truth_rate_hz,
        1e3 * drawn.sigma_xy_m,
        result.strata.wheels
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

/// The shares of a stratum that a person reads; --json has all, each with its interval.
const SHOWN_IN_STRATA: [(&str, &str); 5] = [
    ("detected", "detected"),
    ("first_name", "first name"),
    ("set_holds", "set holds"),
    ("left_out", "left out"),
    ("coverage_low", "covers"),
];

fn show_strata(result: &ChallengeResult, terminal: &Terminal) -> Result<(), Failure> {
    let mut headers = vec!["stratum", "level", "nulls with a finding", "95 % interval"];
    headers.extend(SHOWN_IN_STRATA.map(|(_, header)| header));
    let mut rows = table(&headers, 2);
    for stratum in &result.strata {
        let measure = |id: &str| stratum.measures.iter().find(|measure| measure.id == id && measure.of > 0);
        let share = |id: &str| {
            let of = |measure: &Measure| measure.count.map(|count| format!("{count}/{}", measure.of));
            measure(id).and_then(of).unwrap_or_else(|| "–".to_owned())
        };
        let interval = measure("null_findings").and_then(|measure| measure.interval);
        let interval = interval
            .map_or_else(|| "–".to_owned(), |[low, high]| format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high));
        let names = [stratum.stratum.clone(), stratum.level.clone(), share("null_findings"), interval];
        rows.add_row(names.into_iter().chain(SHOWN_IN_STRATA.map(|(id, _)| share(id))));
    }
    terminal.say("by stratum, with Clopper and Pearson's two-sided interval:")?;
    terminal.say(&rows.to_string())
}

fn show(result: &ChallengeResult, terminal: &Terminal) -> Result<(), Failure> {
    let mut rows = table(&["measure", "value", "95 % limit", "bar", "of", "met"], 1);
    for measure in result.measures.iter().filter(|measure| measure.of > 0) {
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
    show_strata(result, terminal)?;
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
