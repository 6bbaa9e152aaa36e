//! Logs of [`plain_robot`] with their answers: kinds of ordinary logs, and mixed ones.

use std::collections::BTreeMap;
use std::path::Path;

use plain_robot::{Kind, Mixed, PlainRobot};

use crate::answer::{ANSWER, Answer, Cause, Question, geometry_m};

/// The folder of a robot of a kind below a corpus.
#[must_use]
pub fn kind_name(kind: Kind, seed: u64) -> String {
    let words: String =
        kind.0.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '-' }).collect();
    format!("ordinary/{words}-{seed}")
}

/// The folder of a mixed log below a corpus.
#[must_use]
pub fn mixed_name(seed: u64) -> String {
    format!("mixed/{seed}")
}

/// Writes the log of a robot of a kind into a folder of its own below `corpus`, unless it stands there;
/// `group` is the seed of the campaign. Where the tool `knows_wheels`, rows say what the wheels did and when.
///
/// # Errors
/// A sentence with the answer that cannot be written.
pub fn write_kind(corpus: &Path, kind: Kind, seed: u64, group: u64, knows_wheels: bool) -> Result<(), String> {
    let (name, change, exempt) = kind;
    let mut robot = PlainRobot::ordinary(seed);
    change(&mut robot);
    robot.knows_wheels = knows_wheels;
    let strata = BTreeMap::from([("kind".to_owned(), name.to_owned())]);
    let answer = Answer {
        exempt: exempt.iter().map(|id| (*id).to_owned()).collect(),
        strata,
        ..Answer::new("ordinary", Question::Null, group)
    };
    write(&corpus.join(kind_name(kind, seed)), &robot, answer)
}

/// Writes the mixed log of a seed, likewise.
///
/// # Errors
/// As [`write_kind`].
pub fn write_mixed(corpus: &Path, seed: u64, group: u64) -> Result<(), String> {
    let Mixed { robot, exempt, fault, .. } = Mixed::drawn(seed);
    // How large a fault must be to be seen nobody has computed: none is plain.
    let cause = |fault: &str| Cause { right: vec![fault.to_owned()], ..Cause::default() };
    let question = if fault.is_some() { Question::One } else { Question::Null };
    let answer = Answer {
        causes: fault.map(cause).into_iter().collect(),
        exempt: exempt.into_iter().map(str::to_owned).collect(),
        ..Answer::new("mixed", question, group)
    };
    write(&corpus.join(mixed_name(seed)), &robot, answer)
}

fn write(folder: &Path, robot: &PlainRobot, answer: Answer) -> Result<(), String> {
    if folder.join(ANSWER).exists() {
        return Ok(());
    }
    let geometry_m = geometry_m(robot.write(&folder.join("training/session_0")));
    Answer { geometry_m, ..answer }.write(folder)
}
