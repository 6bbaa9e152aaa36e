//! A build of the command: what it is run as, and what it says of logs. Outcomes are stored by the digest of
//! the executable, so that a build need not run again.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::corpus::{Log, hexadecimal};
use crate::outcome::{Outcome, drift};

/// A command may take so long; then it is stopped, and that is its outcome.
const LIMIT: Duration = Duration::from_secs(600);

/// How often a running command is looked at.
const LOOK: Duration = Duration::from_millis(5);

/// A build of the command.
#[derive(Debug, Clone)]
pub struct Build {
    /// The executable, or the file of outcomes.
    pub executable: PathBuf,
    /// Words put before those of every diagnosis, such as another file of settings.
    pub arguments: Vec<String>,
    /// Twelve digits of the SHA-256 of executable and arguments.
    pub id: String,
}

impl Build {
    /// A build from an executable and the words behind it, as one would type them.
    ///
    /// # Errors
    /// A sentence where the executable cannot be read.
    pub fn of(words: &str) -> Result<Self, String> {
        let mut split = words.split_whitespace();
        let executable = PathBuf::from(split.next().ok_or("a build is an executable and nothing was given")?);
        let arguments: Vec<String> = split.map(str::to_owned).collect();
        let bytes = fs::read(&executable).map_err(|error| format!("{}: {error}", executable.display()))?;
        let mut hash = Sha256::new();
        hash.update(bytes);
        arguments.iter().for_each(|argument| hash.update(argument.as_bytes()));
        let id = hexadecimal(&hash.finalize())[..12].to_owned();
        Ok(Self { executable, arguments, id })
    }

    /// What the build says of each log, from the store where it stands there of the same log, and else anew
    /// on so many threads.
    ///
    /// # Errors
    /// A sentence where the store cannot be written or the command cannot be started.
    pub fn outcomes(
        &self,
        logs: &[Log],
        store: &Path,
        jobs: usize,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<Outcome>, String> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build().map_err(|error| error.to_string())?;
        let one = |log: &Log| {
            let outcome = self.stored(log, store);
            done();
            outcome
        };
        pool.install(|| logs.par_iter().map(one).collect())
    }

    fn stored(&self, log: &Log, store: &Path) -> Result<Outcome, String> {
        let file = store.join(&self.id).join(format!("{}.json", log.digest));
        if let Some(outcome) = fs::read(&file).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
            return Ok(outcome);
        }
        let outcome = self.outcome(log).map_err(|error| format!("{}: {error}", log.name))?;
        let folder = file.parent().unwrap_or(store);
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let bytes = serde_json::to_vec(&outcome).map_err(|error| error.to_string())?;
        atomic_file::write_whole(&file, &bytes).map_err(|error| format!("{}: {error}", file.display()))?;
        Ok(outcome)
    }

    fn outcome(&self, log: &Log) -> Result<Outcome, String> {
        let scratch = tempfile::tempdir().map_err(|error| error.to_string())?;
        let out = scratch.path().join("diagnosis");
        let mut diagnose = Command::new(&self.executable);
        diagnose.arg("diagnose").args(&self.arguments).args(log.training());
        diagnose.arg("--json").arg("--quiet").arg("--out").arg(&out);
        log.answer.without.iter().for_each(|id| {
            diagnose.arg("--without").arg(id);
        });
        let Ran { printed, said, is_result, seconds } = run(diagnose, scratch.path())?;
        if !is_result {
            return Ok(Outcome::refusal(&log.digest, said, seconds));
        }
        let outcome = Outcome::read(&log.digest, &printed, seconds);
        let mut outcome = match outcome {
            Ok(outcome) => outcome,
            Err(error) => return Ok(Outcome::refusal(&log.digest, format!("its JSON: {error}"), seconds)),
        };
        let mut evaluations = Vec::new();
        for session in log.held_out() {
            let mut evaluate = Command::new(&self.executable);
            evaluate.arg("evaluate").arg(session).arg("--json").arg("--quiet");
            for model in ["calibration.toml", "extended.toml"] {
                evaluate.arg("--calibration").arg(out.join(model));
            }
            let ran = run(evaluate, scratch.path())?;
            evaluations.push(ran.printed);
        }
        outcome.drift_percent = drift(&evaluations);
        Ok(outcome)
    }
}

/// What came of a command.
struct Ran {
    printed: Vec<u8>,
    /// The last line on standard error.
    said: String,
    is_result: bool,
    seconds: f64,
}

/// Exit codes at which a result was printed: a finding is one.
fn is_result(code: Option<i32>) -> bool {
    matches!(code, Some(0 | 3))
}

fn run(mut command: Command, scratch: &Path) -> Result<Ran, String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let (output, errors) = (scratch.join("output"), scratch.join("errors"));
    let create = |path: &Path| File::create(path).map(Stdio::from);
    let (to_output, to_errors) =
        (create(&output).map_err(|error| error.to_string())?, create(&errors).map_err(|error| error.to_string())?);
    // One log a thread: threads of the command's own would be counted in the seconds of its neighbours.
    let prepared = command.stdin(Stdio::null()).stdout(to_output).stderr(to_errors).env("RAYON_NUM_THREADS", "1");
    let started = Instant::now();
    let mut child = prepared.spawn().map_err(|error| format!("{program}: {error}"))?;
    let status = loop {
        match child.try_wait().map_err(|error| error.to_string())? {
            Some(status) => break Some(status),
            None if started.elapsed() > LIMIT => {
                child.kill().and_then(|()| child.wait()).map_err(|error| error.to_string())?;
                break None;
            }
            None => thread::sleep(LOOK),
        }
    };
    let seconds = started.elapsed().as_secs_f64();
    let printed = fs::read(&output).map_err(|error| error.to_string())?;
    let said = fs::read(&errors).map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&said).lines().last().unwrap_or("nothing is said").to_owned();
    let Some(status) = status else {
        let said = format!("no result in {} s", LIMIT.as_secs());
        return Ok(Ran { printed, said, is_result: false, seconds });
    };
    Ok(Ran { printed, said, is_result: is_result(status.code()), seconds })
}
