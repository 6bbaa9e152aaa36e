//! Logs of real robots, which are no part of the repository: the `yair` beside this program imports them.
//! What is wrong with such a robot nobody knows; the drift of its models in other sessions is measured.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::answer::{ANSWER, Answer, Question};

/// A session: the words of `yair import` without `--out`; names of files begin with `@`, below the data's
/// folder.
type Session = Vec<String>;

/// A log: its robot, its name, the session that is diagnosed, and those driven elsewhere.
struct Real {
    robot: &'static str,
    name: String,
    training: Session,
    held_out: Vec<Session>,
}

const KOBUKI: &str = "--wheel 0.07 --base 0.23 --ticks-per-rev 2578.33 --counter-bits 16";
const WARTHOG: &str = "--wheel 0.6 --base 1.1652 --wheel-unit rad --length-unit m";
const MOCAP_BOT: &str = "--wheel 0.1524 --base 0.6 --wheel-unit mm/s";

/// Kinds of path of the OptiOdom sessions, by their folders.
const OPTIODOM_KINDS: [&str; 3] = ["circular", "ivanjko", "square"];

fn session(words: &str) -> Session {
    words.split_whitespace().map(str::to_owned).collect()
}

/// Sessions of one robot, each diagnosed alone and evaluated on all others.
fn each_on_the_others(robot: &'static str, sessions: &[(&str, String)]) -> Vec<Real> {
    let of = |(name, words): &(&str, String)| Real {
        robot,
        name: (*name).to_owned(),
        training: session(words),
        held_out: sessions.iter().filter(|(other, _)| other != name).map(|(_, words)| session(words)).collect(),
    };
    sessions.iter().map(of).collect()
}

/// A table of wheels and one of poses.
fn tables(name: &str, poses: &str, robot: &str) -> String {
    format!("csv @field/{name}_wheels.csv @field/{name}_{poses}.csv {robot}")
}

/// The sessions of June 2020: each evaluated on the first of every other kind of path.
fn optiodom(data: &Path) -> Result<Vec<Real>, String> {
    let mut of_kinds = Vec::new();
    for kind in OPTIODOM_KINDS {
        let folder = data.join("optiodom/diff").join(kind);
        let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let mut names: Vec<String> = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
        names.sort();
        of_kinds.push((kind, names));
    }
    let words = |kind: &str, name: &str| session(&format!("optiodom @optiodom/diff/{kind}/{name}"));
    let elsewhere = |kind: &str| {
        let others = of_kinds.iter().filter(|(other, _)| *other != kind);
        others.filter_map(|(other, names)| Some(words(other, names.first()?))).collect()
    };
    let of_kind = |(kind, names): &(&str, Vec<String>)| -> Vec<Real> {
        let of = |name: &String| Real {
            robot: "optiodom",
            name: format!("{kind}-{name}"),
            training: words(kind, name),
            held_out: elsewhere(kind),
        };
        names.iter().map(of).collect()
    };
    Ok(of_kinds.iter().flat_map(of_kind).collect())
}

fn all(data: &Path) -> Result<Vec<Real>, String> {
    let khepera = ["l90", "lstraight"].map(|name| (name, format!("censi @khepera/{name}.tuple")));
    let kobuki = ["turtlebot0", "turtlebot1", "turtlebot2", "turtlebot3"];
    let kobuki = kobuki.map(|name| (name, tables(name, "mocap", KOBUKI)));
    let warthog = ["warthog_660", "warthog_720"].map(|name| (name, tables(name, "icp", WARTHOG)));
    let mocap_bot = ["mocapbot0", "mocapbot3"].map(|name| (name, tables(name, "mocap", MOCAP_BOT)));
    let motions = "motions @field/freiburg_odom_motions.txt @field/freiburg_scanmatched_motions.txt";
    let motions = [("freiburg", format!("{motions} --wheel 0.2 --base 0.4"))];
    Ok([
        optiodom(data)?,
        each_on_the_others("khepera", &khepera),
        each_on_the_others("kobuki", &kobuki),
        each_on_the_others("warthog", &warthog),
        each_on_the_others("mocapbot", &mocap_bot),
        each_on_the_others("freiburg", &motions),
    ]
    .into_iter()
    .flatten()
    .collect())
}

/// Writes the logs of real robots in `data` below `corpus`, unless they are there.
///
/// # Errors
/// A sentence where there is no `yair` beside this program, or with the session that it does not import.
pub fn write_real(corpus: &Path, data: &Path) -> Result<(), String> {
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let yair = own.with_file_name("yair");
    for Real { robot, name, training, held_out } in all(data)? {
        let folder = corpus.join(robot).join(&name);
        if folder.join(ANSWER).exists() {
            continue;
        }
        import(&yair, data, &training, &folder.join("training/session_0"))?;
        for (number, session) in held_out.iter().enumerate() {
            import(&yair, data, session, &folder.join(format!("held_out/session_{number}")))?;
        }
        let strata = BTreeMap::from([("robot".to_owned(), robot.to_owned())]);
        Answer { strata, ..Answer::new("real", Question::Unknown, 0) }.write(&folder)?;
    }
    Ok(())
}

fn import(yair: &Path, data: &Path, words: &Session, out: &Path) -> Result<(), String> {
    let parent = out.parent().unwrap_or(out);
    fs::create_dir_all(parent).map_err(|error| format!("{}: {error}", parent.display()))?;
    let path = |word: &String| -> OsString {
        word.strip_prefix('@').map_or_else(|| word.into(), |name| data.join(name).into_os_string())
    };
    let mut command = Command::new(yair);
    command.arg("import").args(words.iter().map(path)).arg("--out").arg(out).args(["--force", "--quiet"]);
    let ran = command.stdin(Stdio::null()).output().map_err(|error| format!("{}: {error}", yair.display()))?;
    if ran.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    Err(format!("yair import {}: {}", words.join(" "), said.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_log_is_evaluated_on_other_sessions_of_its_robot_alone() {
        let data = tempfile::tempdir().expect("a folder");
        for name in ["circular/1", "circular/2", "ivanjko/3", "square/4"] {
            fs::create_dir_all(data.path().join("optiodom/diff").join(name)).expect("made");
        }
        let logs = all(data.path()).expect("logs");
        let of = |robot: &str| logs.iter().filter(|log| log.robot == robot).collect::<Vec<_>>();
        let june: Vec<(&str, usize)> =
            of("optiodom").iter().map(|log| (log.name.as_str(), log.held_out.len())).collect();
        assert_eq!(june, [("circular-1", 2), ("circular-2", 2), ("ivanjko-3", 2), ("square-4", 2)]);
        assert_eq!(of("kobuki").iter().map(|log| log.held_out.len()).collect::<Vec<_>>(), [3; 4]);
        assert!(logs.iter().all(|log| !log.held_out.contains(&log.training)));
        assert!(all(&data.path().join("nowhere")).is_err());
    }
}
