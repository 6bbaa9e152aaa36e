//! `yair export FORMAT CALIBRATION --into FILE`

use std::path::Path;

use ::export::format::{EXPORTERS, Exporter, Place};
use ::export::{CalibratedRobot, Options, into_file};
use robot_files::diff;

use crate::import_robot::read_text;
use crate::simulate::write_whole;
use crate::terminal::{Failure, Terminal};

/// What became of a robot's own file.
pub(crate) struct Put {
    /// The changed lines, as a unified diff; empty where the file has the values already.
    pub(crate) diff: String,
    pub(crate) remarks: Vec<String>,
}

/// Puts the calibrated values into a file, unless nothing is to be written, and shows what changes.
pub(crate) fn run(
    format: &Exporter,
    robot: CalibratedRobot,
    options: &Options,
    file: &Path,
    is_dry: bool,
    terminal: &Terminal,
) -> Result<Put, Failure> {
    if format.place == Place::None {
        let others: Vec<&str> =
            EXPORTERS.iter().filter(|format| format.place != Place::None).map(|format| format.name).collect();
        let why = "is a file of its own, and is put into no other; give --out FILE. --into takes";
        return Err(format!("{} {why} {}", format.name, others.join(", ")).into());
    }
    let place = file.display().to_string();
    let text = read_text(file)?;
    let edited = into_file(format, robot, options, &place, &text)?;
    let diff = diff(&place, &text, &edited.text);
    for remark in &edited.remarks {
        terminal.remark(&format!("warning: {place}: {remark}"));
    }
    if diff.is_empty() {
        terminal.note(&format!("{place}: has these values already; nothing to change"))?;
    } else {
        // Without a file the lines are the result.
        let lines = diff.trim_end_matches('\n');
        if is_dry {
            terminal.say(lines)?;
        } else {
            terminal.note(lines)?;
        }
        if is_dry {
            terminal.remark("nothing was written (--dry-run)");
        } else {
            // A link stays one: what it leads to is edited.
            let target = file.canonicalize().map_err(|error| format!("{place}: {error}"))?;
            let permissions = target.metadata().map_err(|error| format!("{place}: {error}"))?.permissions();
            write_whole(&target, edited.text.as_bytes())?;
            std::fs::set_permissions(&target, permissions).map_err(|error| format!("{place}: {error}"))?;
        }
    }
    Ok(Put { diff, remarks: edited.remarks })
}
