//! `yair demo [--fault ID] [--seed N] [--out DIR] [--no-open]`

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use ::diagnose::{Diagnosis, Finding, Options};
use clap::Args;
use dataset::Dataset;
use effects::{Address, CATALOGUE, Effect, HostRobot, Hypothesis, ParameterLaw, ParameterValues, StreamName};
use kinematics::Wheels;
use scenario::Scenario;
use serde::Serialize;

use crate::diagnose_command::write_diagnosis;
use crate::html_report::drift_percents;
use crate::new_folders::NewFolders;
use crate::simulate::{refuse_filled, write_dataset, write_whole};
use crate::terminal::{Failure, Terminal};

/// Show the whole job in a minute: simulate a robot with a hidden fault, calibrate, diagnose and correct it.
///
/// The exit code is 0 only where the hidden fault is among the names that are found.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The fault to hide, by its id in docs/effects.md; without it one that these drives can show is drawn.
    #[arg(long, value_name = "ID")]
    fault: Option<String>,
    /// Seed of the fault and of every run, in place of the shipped scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Folder for the datasets, the reports and the hidden truth.
    #[arg(long, value_name = "DIR", default_value = "yair-demo")]
    out: PathBuf,
    /// Do not open the report in a browser.
    #[arg(long)]
    no_open: bool,
    /// Write into a folder that is not empty, and replace the datasets there.
    #[arg(long)]
    force: bool,
}

/// The robot that is driven: scenarios/motion-capture.toml, its geometry's errors without its faults.
const ROBOT: &str = scenario::MOTION_CAPTURE;

/// How large the hidden fault is, in units of what is large on a real robot (the prior sigma of its
/// estimation model). The blind benchmark draws means up to 3; at 2 some faults hide everything else.
const SCALE: f64 = 1.0;

/// Directions of a fault's sizes that are tried until one is physical.
const MAX_DRAWS: u32 = 20;

/// Trials of the seed: what is fitted, what nobody fits, and the planned sessions from there on.
const FITTED: u64 = 0;
const NEW: u64 = 1;
const PLANNED: u64 = 2;

/// The fault that is hidden.
#[derive(Debug, Serialize)]
struct Hidden {
    id: &'static str,
    meaning: &'static str,
    parameters: BTreeMap<&'static str, f64>,
    #[serde(skip)]
    effect: Effect,
}

#[derive(Serialize)]
struct Drift {
    nominal: Option<f64>,
    calibrated: Option<f64>,
    extended: Option<f64>,
}

#[derive(Serialize)]
struct Document<'d> {
    seed: u64,
    hidden: &'d Hidden,
    found: bool,
    /// The hidden fault is the first name of its finding.
    named_first: bool,
    finding: Option<&'d Finding>,
    /// Of the size that was found from the hidden one.
    size_off_sigmas: Option<f64>,
    findings: Vec<&'d str>,
    new_session_drift_percent: Drift,
    planned: Option<&'d str>,
    report: String,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let out = &arguments.out;
    refuse_filled(out, arguments.force)?;
    let mut robot = Scenario::parse(ROBOT, "motion-capture.toml")?;
    let seed = arguments.seed.unwrap_or(robot.seed);
    robot.effects.retain(|effect| effects::description(effect.id()).is_some_and(|of| of.geometry.is_some()));
    let hidden = hide(arguments.fault.as_deref(), seed, &robot, terminal)?;
    robot.effects.push(hidden.effect.clone());
    let _new = NewFolders::to(out);
    atomic_file::create_folder(out).map_err(|error| format!("{}: {error}", out.display()))?;
    let path = |name: &str| out.join(name);

    let simulated = sim_yair::simulate(&robot, seed, FITTED)?;
    write_whole(&path("truth.json"), &serde_json::to_vec_pretty(&simulated.truth)?)?;
    let mut first = simulated.dataset;
    first.provenance.name = Some("demo".to_owned());
    write_dataset(&first, &path("robot"), arguments.force)?;
    terminal.say(&format!(
        "1. A simulated robot with a hidden fault drives {} runs: {}",
        first.runs.len(),
        path("robot").display()
    ))?;

    let mut datasets = vec![first];
    let mut given = vec![path("robot")];
    let mut diagnosis = diagnosed(&datasets, &given, &path("diagnosis"), arguments.force, terminal)
        .map_err(|why| format!("{} was hidden, and it cannot be diagnosed: {why}", hidden.id))?;
    terminal.say(&format!("2. Calibration and diagnosis: {}.", diagnosis.document.sentence))?;
    tell(&diagnosis, terminal)?;

    let new = driven(&robot, seed, NEW, "new", &path("new-session"), arguments.force)?;
    let drift = drift(&diagnosis, new, terminal)?;

    let mut report = path("diagnosis").join("report.html");
    let planned = diagnosis.document.next_experiment.as_ref().map(|next| next.drive.clone());
    if let Some(next) = diagnosis.document.next_experiment.clone() {
        for (number, session) in (1_u64..).zip(&next.sessions) {
            let mut planned = Scenario { protocols: session.schedules.clone(), budget: None, ..robot.clone() };
            planned.robot.cruise_speed_m_s = session.speed_m_s;
            let name = format!("planned-{number}");
            datasets.push(driven(&planned, seed, PLANNED + number - 1, &name, &path(&name), arguments.force)?);
            given.push(path(&name));
        }
        terminal.say(&format!("4. The robot drives what the diagnosis asks for: {}.", next.drive))?;
        match diagnosed(&datasets, &given, &path("diagnosis-after-plan"), arguments.force, terminal) {
            Ok(after) => {
                diagnosis = after;
                report = path("diagnosis-after-plan").join("report.html");
                terminal.say(&format!("   With these runs: {}.", diagnosis.document.sentence))?;
                tell(&diagnosis, terminal)?;
            }
            Err(why) => {
                terminal.remark(&format!("warning: the first diagnosis remains; these runs have no diagnosis: {why}"));
            }
        }
    } else {
        let why = diagnosis.document.next_experiment_why_null.as_deref().unwrap_or("none was sought");
        terminal.say(&format!("4. There is no next experiment: {why}."))?;
    }
    terminal.say(&format!("5. The report: {}", report.display()))?;
    if !arguments.no_open && !terminal.json && std::io::stdout().is_terminal() {
        open(&report);
    }

    let findings = &diagnosis.document.findings;
    let finding = findings.iter().find(|finding| finding.names.iter().any(|name| name == hidden.id));
    let named_first = finding.is_some_and(|finding| finding.names.first().is_some_and(|name| name == hidden.id));
    verdict(&hidden, finding, named_first, terminal)?;
    let besides: Vec<&str> =
        findings.iter().filter(|of| finding.is_none_or(|it| it.id != of.id)).map(|of| of.id.as_str()).collect();
    if !besides.is_empty() {
        terminal.say(&format!("Found besides, though it was not hidden: {}", besides.join(", ")))?;
    }
    terminal.document(&Document {
        seed,
        hidden: &hidden,
        found: finding.is_some(),
        named_first,
        finding,
        size_off_sigmas: finding.and_then(|finding| sigmas_off(&hidden, finding)),
        findings: findings.iter().map(|finding| finding.id.as_str()).collect(),
        new_session_drift_percent: drift,
        planned: planned.as_deref(),
        report: report.display().to_string(),
    })?;
    Ok(if finding.is_some() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// A simulated session of some name, in a folder.
fn driven(robot: &Scenario, seed: u64, trial: u64, name: &str, folder: &Path, force: bool) -> Result<Dataset, Failure> {
    let mut dataset = sim_yair::simulate(robot, seed, trial)?.dataset;
    dataset.provenance.name = Some(name.to_owned());
    write_dataset(&dataset, folder, force)?;
    Ok(dataset)
}

/// How far dead reckoning drifts in a session that was not fitted.
fn drift(diagnosis: &Diagnosis, new: Dataset, terminal: &Terminal) -> Result<Drift, Failure> {
    let [nominal, calibrated, extended] = drift_percents(diagnosis, &[new]);
    let shown = |percent: Option<f64>| percent.map_or_else(|| "–".to_owned(), |percent| format!("{percent:.3} %"));
    terminal.say(&format!(
        "3. In a new session, dead reckoning drifts {} as configured, {} calibrated, {} with the fault corrected.",
        shown(nominal),
        shown(calibrated),
        shown(extended)
    ))?;
    Ok(Drift { nominal, calibrated, extended })
}

/// Chooses the fault and its sizes.
fn hide(fault: Option<&str>, seed: u64, robot: &Scenario, terminal: &Terminal) -> Result<Hidden, Failure> {
    let draws = Address { seed, point: 0, trial: 0, run: 0 };
    if let Some(id) = fault {
        let id = CATALOGUE
            .iter()
            .find(|known| **known == id)
            .ok_or_else(|| format!("no effect \"{id}\" in the catalogue; known: {}", CATALOGUE.join(", ")))?;
        return drawn(id, robot, draws).map_err(|why| format!("--fault {id}: {why}; choose another").into());
    }
    terminal.remark("drawing a fault among those that these drives can show");
    // What the robot without any fault could not show is no fair question.
    let sound = sim_yair::simulate(robot, seed, FITTED)?.dataset;
    let blind = ::diagnose::diagnose(&[sound], &Options { limits: None, ..Options::default() })?.document.blind_to;
    let mut fair: Vec<Hidden> = CATALOGUE
        .iter()
        .filter(|id| blind.iter().all(|blind| blind.id != **id))
        .filter(|id| matches!(effects::hypothesis(id), Some(Hypothesis::Terms(_))))
        .filter_map(|id| drawn(id, robot, draws).ok())
        .collect();
    if fair.is_empty() {
        return Err("no fault of the catalogue can be hidden; name one with --fault".into());
    }
    let index = draws.stream(StreamName::new("demo_fault")).below(fair.len());
    Ok(fair.swap_remove(index))
}

/// The fault of an id with sizes by the law of the blind benchmark.
fn drawn(id: &'static str, robot: &Scenario, draws: Address) -> Result<Hidden, &'static str> {
    let of = effects::description(id).ok_or("it is not in the catalogue")?;
    if of.geometry.is_some() {
        return Err("every calibration fits it, so that it is no fault");
    }
    if of.benchmark.needs.payload || of.benchmark.needs.jitter {
        return Err("it needs loads or irregular stamps, which this robot does not have");
    }
    if of.benchmark.needs.others {
        return Err(
            "it needs a length that does not come from the instrument, or wheels that skid in turns; this robot has neither",
        );
    }
    let host = HostRobot {
        cruise_speed_m_s: robot.robot.cruise_speed_m_s,
        acceleration_m_s2: robot.robot.acceleration_m_s2,
        wheel_separation_m: robot.robot.wheel_separation_m,
        payload_kg: Vec::new(),
        jitter_s: 0.0,
    };
    let mut stream = draws.stream(StreamName::new("demo_size"));
    for _ in 0..MAX_DRAWS {
        let (values, fixed): (ParameterValues, ParameterValues) = match of.benchmark.values {
            ParameterLaw::Scatter(law) => law(&host, &mut stream),
            ParameterLaw::Fault(law) => (Vec::new(), law(Wheels { left: false, right: true }, &mut stream)),
            ParameterLaw::Direction { fixed, positive } => {
                let Some(Hypothesis::Terms(variants)) = effects::hypothesis(id) else {
                    return Err("it has no sizes to be drawn");
                };
                let variant = &variants[stream.below(variants.len())];
                let fixed = fixed(variant.fixed.clone(), &host, &mut stream);
                let shares: Vec<_> =
                    variant.term.parameters().iter().map(|of| (of.name, of.prior_sigma, stream.normal())).collect();
                let largest = shares.iter().map(|(_, _, share)| share.abs()).fold(f64::MIN_POSITIVE, f64::max);
                let share = |share: f64| if positive { share.abs() / largest } else { share / largest };
                (shares.iter().map(|(name, sigma, of)| (*name, share(*of) * sigma)).collect(), fixed)
            }
        };
        let sizes: ParameterValues =
            values.iter().map(|(name, value)| (*name, SCALE * value)).chain(fixed.iter().copied()).collect();
        if let Some(effect) = effects::effect_at_scale(id, &sizes, SCALE, &host) {
            return Ok(Hidden { id, meaning: of.meaning, parameters: sizes.into_iter().collect(), effect });
        }
    }
    Err("no physical size of it was drawn")
}

fn diagnosed(
    datasets: &[Dataset],
    given: &[PathBuf],
    out: &Path,
    force: bool,
    terminal: &Terminal,
) -> Result<Diagnosis, Failure> {
    terminal.remark(&format!("diagnosing {} runs", datasets.iter().map(|of| of.runs.len()).sum::<usize>()));
    let mut diagnosis = ::diagnose::diagnose(datasets, &Options::default())?;
    write_diagnosis(&mut diagnosis, datasets, given, out, force)?;
    Ok(diagnosis)
}

fn tell(diagnosis: &Diagnosis, terminal: &Terminal) -> Result<(), Failure> {
    diagnosis.document.findings.iter().try_for_each(|finding| terminal.say(&format!("   {}", finding.sentence)))
}

/// What was hidden, and what became of it.
fn verdict(hidden: &Hidden, finding: Option<&Finding>, first: bool, terminal: &Terminal) -> Result<(), Failure> {
    let sizes: Vec<String> = hidden.parameters.iter().map(|(name, value)| format!("{name} = {value:.3e}")).collect();
    terminal.say(&format!("The hidden fault was {} ({}): {}", hidden.id, hidden.meaning, sizes.join(", ")))?;
    let Some(finding) = finding else {
        return terminal.say("It was not found.");
    };
    let sizes: Vec<String> = finding
        .parameters
        .iter()
        .map(|(name, of)| match of.sigma {
            Some(sigma) => format!("{name} = {:.3e} ± {sigma:.1e}", of.value),
            None => format!("{name} = {:.3e}", of.value),
        })
        .collect();
    let named = if first { "and named correctly".to_owned() } else { format!("among {}", finding.names.join(", ")) };
    terminal.say(&format!("It was found {named}: {}", sizes.join(", ")))?;
    match sigmas_off(hidden, finding) {
        Some(sigmas) if sigmas > MAX_SIGMAS => terminal.say(&format!(
            "Its size is off by {sigmas:.0} standard deviations: at this size the fault is not what its linear term says"
        )),
        _ => Ok(()),
    }
}

/// Standard deviations beyond which a size is said to be off; by chance one in 16 000 is.
const MAX_SIGMAS: f64 = 4.0;

/// The largest difference of a size that was found from the hidden one, in standard deviations; `None` where
/// the finding is of another cause or has none.
fn sigmas_off(hidden: &Hidden, finding: &Finding) -> Option<f64> {
    let off = hidden.parameters.iter().filter_map(|(name, value)| {
        let found = finding.parameters.get(*name)?;
        let sigma = found.sigma.filter(|sigma| *sigma > 0.0)?;
        Some((found.value - value).abs() / sigma)
    });
    off.reduce(f64::max).filter(|_| finding.id == hidden.id)
}

/// Opens a page where there is a display; that it cannot be opened is no error.
fn open(page: &Path) {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let (program, arguments): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(target_os = "windows") {
        ("cmd", &["/C", "start", ""])
    } else if set("DISPLAY") || set("WAYLAND_DISPLAY") {
        ("xdg-open", &[])
    } else {
        return;
    };
    let quiet = Stdio::null;
    let _ = Command::new(program).args(arguments).arg(page).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn();
}
