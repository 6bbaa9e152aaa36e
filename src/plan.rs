//! `yair plan DATASET...|SCENARIO [--room X,Y] [--minutes M] [--speed V] [--out DIR]`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use ::diagnose::{Diagnosis, Limits, NextExperiment, Options, Verdict, plan_scenario};
use clap::Args;
use scenario::{Budget, Scenario};
use serde::Serialize;

use crate::diagnose_command::shown_on;
use crate::html_report::write_plan;
use crate::log::Log;
use crate::new_folders::NewFolders;
use crate::plan_instruments::{Expected, expected, show as show_instruments};
use crate::simulate::{refuse_filled, write_whole};
use crate::terminal::{Failure, Terminal, advance, table};

/// Plan the next drive: one that separates the remaining causes, or shows what the data could not show.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets of one robot, or a folder of them, or a scenario file.
    #[arg(required = true, value_name = "DATASET|SCENARIO")]
    sources: Vec<PathBuf>,
    /// Sides of the floor, metres; without it what the robot moved over so far, or the scenario's budget.
    #[arg(long, value_name = "X,Y", value_parser = room, allow_hyphen_values = true)]
    room: Option<[f64; 2]>,
    /// Time for driving and placing the robot; without it the scenario's budget, or 10.
    #[arg(long, value_name = "M", value_parser = positive)]
    minutes: Option<f64>,
    /// Fastest wheel that may be commanded, m/s; without it how fast the robot cruised so far.
    #[arg(long, value_name = "V", value_parser = positive)]
    speed: Option<f64>,
    /// Take an effect out of the catalogue; may be given several times.
    #[arg(long = "without", value_name = "ID")]
    without: Vec<String>,
    /// Folder for report.html, and plan.toml, a scenario that drives the plan with the robot as it is known;
    /// one for each speed.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    force: bool,
}

/// Time of a plan where nobody says another, minutes, as `--minutes` has it.
const MINUTES: f64 = 10.0;

/// What a person needs for each run where nobody says, seconds, as a plan has it.
const HANDLING_S: f64 = 20.0;

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err("it must be positive".to_owned()) }
}

fn room(text: &str) -> Result<[f64; 2], String> {
    let expected = |_| "expected the two sides of the floor in metres, both positive, as 4,3".to_owned();
    let sides: Vec<f64> =
        text.split(',').map(|side| positive(side.trim())).collect::<Result<_, _>>().map_err(expected)?;
    <[f64; 2]>::try_from(sides).map_err(|sides| expected(format!("{sides:?}")))
}

#[derive(Serialize)]
struct OfData {
    dataset: calib::Names,
    verdict: Verdict,
    sentence: String,
    next_experiment: Option<NextExperiment>,
    #[serde(skip_serializing_if = "Option::is_none")]
    next_experiment_why_null: Option<String>,
    scenarios: Vec<String>,
    /// What other instruments would leave of ±; empty without `--room`.
    instruments: Vec<Expected>,
}

#[derive(Serialize)]
struct OfScenario {
    #[serde(flatten)]
    plan: ::diagnose::ScenarioPlan,
    scenarios: Vec<String>,
    /// What other instruments would leave of ±.
    instruments: Vec<Expected>,
}

/// What other instruments would leave of ± of a robot, in a room and a time.
fn instruments(
    robot: &Scenario,
    room_m: [f64; 2],
    minutes: f64,
    terminal: &Terminal,
) -> Result<Vec<Expected>, Failure> {
    let own = robot.budget;
    let budget = Budget {
        room_x_m: room_m[0],
        room_y_m: room_m[1],
        // Without a budget the robot's own width on either side.
        clearance_m: own.map_or(2.0 * robot.robot.wheel_separation_m, |own| own.clearance_m),
        minutes: Some(minutes),
        metres: None,
        handling_s: Some(own.and_then(|own| own.handling_s).unwrap_or(HANDLING_S)),
    };
    let all = expected(robot, budget)?;
    show_instruments(&all, budget, terminal)?;
    Ok(all)
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let limits = Limits { room_m: arguments.room, minutes: arguments.minutes, top_speed_m_s: arguments.speed };
    if let Some(out) = &arguments.out {
        refuse_filled(out, arguments.force)?;
    }
    match &arguments.sources[..] {
        [file] if file.is_file() => of_scenario(file, &limits, arguments, terminal),
        sources => of_data(sources, &limits, arguments, terminal),
    }
}

fn of_data(
    sources: &[PathBuf],
    limits: &Limits,
    arguments: &Arguments,
    terminal: &Terminal,
) -> Result<ExitCode, Failure> {
    let log = Log::read(sources, terminal)?;
    let bar = terminal.stages("plan");
    let options = Options {
        without: arguments.without.clone(),
        limits: Some(*limits),
        on_stage: shown_on(bar.clone()),
        ..Options::default()
    };
    let diagnosis = ::diagnose::diagnose(&log, &options);
    bar.finish_and_clear();
    let Diagnosis { document, extended, .. } = diagnosis?;
    terminal.say(&document.sentence)?;
    if let Some(subsample) = &document.subsample {
        terminal.say(&subsample.sentence)?;
    }
    let (mut scenarios, mut of_instruments) = (Vec::new(), Vec::new());
    match &document.next_experiment {
        Some(next) => {
            show(next, terminal)?;
            if let (Some(room_m), Ok(robot)) = (arguments.room, &extended) {
                of_instruments = instruments(robot, room_m, arguments.minutes.unwrap_or(MINUTES), terminal)?;
            }
            if let Some(out) = &arguments.out {
                let scenario = extended.map_err(|why| format!("{}: no plan.toml: {why}", out.display()))?;
                scenarios = write_scenarios(out, &scenario, next, terminal)?;
                let names = log.datasets().iter().filter_map(|dataset| dataset.provenance.name.as_deref());
                write_plan(
                    &names.collect::<Vec<_>>().join(", "),
                    next,
                    "What the data so far could not show",
                    &document.blind_to,
                    out,
                )?;
            }
        }
        None => {
            terminal
                .say(&format!("no next experiment: {}", document.next_experiment_why_null.as_deref().unwrap_or("–")))?;
        }
    }
    terminal.document(&OfData {
        dataset: document.dataset,
        verdict: document.verdict,
        sentence: document.sentence,
        next_experiment: document.next_experiment,
        next_experiment_why_null: document.next_experiment_why_null,
        scenarios,
        instruments: of_instruments,
    })?;
    Ok(ExitCode::SUCCESS)
}

fn of_scenario(file: &Path, limits: &Limits, arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let scenario = Scenario::read(file)?;
    let bar = terminal.stages("plan");
    advance(&bar, "what each cause would show", 0.0);
    let plan = plan_scenario(&scenario, limits);
    bar.finish_and_clear();
    let plan = plan?;
    show(&plan.next_experiment, terminal)?;
    let blind: Vec<&str> = plan.blind_to.iter().map(|blind| &blind.id[..]).collect();
    if !blind.is_empty() {
        terminal.say(&format!("will not show, though it were large: {}", blind.join(", ")))?;
    }
    let scenarios = match &arguments.out {
        Some(out) => {
            let scenarios = write_scenarios(out, &scenario, &plan.next_experiment, terminal)?;
            write_plan(
                &scenario.name,
                &plan.next_experiment,
                "What it will not show, though it were large",
                &plan.blind_to,
                out,
            )?;
            scenarios
        }
        None => Vec::new(),
    };
    let own = scenario.budget;
    let room_m = limits.room_m.or_else(|| own.map(|own| [own.room_x_m, own.room_y_m]));
    let minutes = limits.minutes.or_else(|| own.and_then(|own| own.minutes)).unwrap_or(MINUTES);
    let instruments = match room_m {
        Some(room_m) => instruments(&scenario, room_m, minutes, terminal)?,
        None => Vec::new(),
    };
    terminal.document(&OfScenario { plan, scenarios, instruments })?;
    Ok(ExitCode::SUCCESS)
}

/// The plan for people.
pub(crate) fn show(next: &NextExperiment, terminal: &Terminal) -> Result<(), Failure> {
    terminal.say(&format!("next experiment: {}", next.why))?;
    let mut predicts = table(&["effect", "predicts"], 2);
    for (id, prediction) in &next.predicts {
        predicts.add_row([id, prediction]);
    }
    terminal.say(&predicts.to_string())?;
    terminal.say(next.protocol.trim_end())
}

/// A scenario for each speed of a plan.
fn write_scenarios(
    out: &Path,
    robot: &Scenario,
    next: &NextExperiment,
    terminal: &Terminal,
) -> Result<Vec<String>, Failure> {
    let _new = NewFolders::to(out);
    atomic_file::create_folder(out).map_err(|error| format!("{}: {error}", out.display()))?;
    let mut written = Vec::new();
    for (number, session) in next.sessions.iter().enumerate() {
        let mut scenario =
            Scenario { protocols: session.schedules.clone(), budget: None, sweep: None, ..robot.clone() };
        scenario.name = format!("{}, planned", robot.name);
        scenario.robot.cruise_speed_m_s = session.speed_m_s;
        let name = if next.sessions.len() == 1 { "plan.toml".to_owned() } else { format!("plan-{}.toml", number + 1) };
        let path = out.join(name);
        write_whole(&path, scenario.to_toml()?.as_bytes())?;
        terminal.remark(&format!("plan in {}", path.display()));
        written.push(path.display().to_string());
    }
    Ok(written)
}
