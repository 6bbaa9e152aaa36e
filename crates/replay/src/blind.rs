//! The blind benchmark's cases as logs with answers.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use blind_benchmark::{CaseKind, CaseLogs, EffectKind, OracleView, Recorded, Scope, case_logs};
use dataset::{Dataset, Existing};
use kinematics::DriveGeometry;

use crate::answer::{ANSWER, Answer, Cause, Question, geometry_m};

/// The folder of a case below a corpus.
#[must_use]
pub fn name(seed: u64, number: u64) -> String {
    format!("blind/{seed}/{number:05}")
}

/// Writes one case of a seed into a folder of its own below `corpus`, unless it stands there; nothing where
/// no robot drawn for an effect shows it. Where the tool `knows_wheels`, rows say what the wheels did and
/// when.
///
/// # Errors
/// A sentence where a case cannot be simulated or written.
pub fn write(corpus: &Path, seed: u64, number: u64, knows_wheels: bool) -> Result<(), String> {
    let folder = corpus.join(name(seed, number));
    if folder.join(ANSWER).exists() {
        return Ok(());
    }
    let recorded = if knows_wheels { Recorded::OfTheWheels } else { Recorded::AsLogged };
    let logs = case_logs(Scope::Whole, seed, number, recorded).map_err(|error| error.to_string())?;
    let Ok(logs) = logs else { return Ok(()) };
    write_log(&folder, &answer(&logs, seed), &logs.sessions, &logs.elsewhere)
}

/// Writes a log.
fn write_log(folder: &Path, answer: &Answer, training: &[Dataset], held_out: &[Dataset]) -> Result<(), String> {
    for (part, sessions) in [("training", training), ("held_out", held_out)] {
        for (number, session) in sessions.iter().enumerate() {
            let dir = folder.join(part).join(format!("session_{number}"));
            fs::create_dir_all(folder.join(part)).map_err(|error| format!("{}: {error}", folder.display()))?;
            dataset::write(session, &dir, Existing::ReplaceDataset).map_err(|error| error.to_string())?;
        }
    }
    answer.write(folder)
}

fn answer(logs: &CaseLogs, seed: u64) -> Answer {
    let known = &logs.known;
    let question = match known.case_kind {
        CaseKind::Null => Question::Null,
        CaseKind::Single | CaseKind::Large | CaseKind::OneLog => Question::One,
        CaseKind::Pair => Question::Two,
        CaseKind::LeftOut => Question::LeftOut,
    };
    let cause = |hidden: &OracleView| Cause {
        right: vec![hidden.id.clone()],
        aliases: hidden.aliases.clone(),
        is_aliased: hidden.is_aliased(),
        is_plain: match question {
            Question::Two => hidden.is_plain(),
            _ => known.is_plain(),
        },
        sizes: if hidden.kind == EffectKind::Mean && !hidden.other_form {
            hidden.values.iter().cloned().collect()
        } else {
            BTreeMap::new()
        },
    };
    Answer {
        corpus: "blind".to_owned(),
        question,
        causes: known.hidden.iter().map(cause).collect(),
        exempt: known.right_findings().into_iter().map(str::to_owned).collect(),
        without: match question {
            Question::LeftOut => known.hidden.iter().map(|hidden| hidden.id.clone()).collect(),
            _ => Vec::new(),
        },
        geometry_m: logs.geometry.map(|geometry| geometry_m(lengths_of(geometry))).unwrap_or_default(),
        seed,
        strata: known.levels().into_iter().collect(),
    }
}

fn lengths_of(geometry: DriveGeometry) -> [f64; 3] {
    let diameter_m = geometry.wheel_diameter_m();
    [diameter_m.left, diameter_m.right, geometry.wheel_separation_m()]
}
