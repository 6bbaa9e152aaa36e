//! Which file has the wheels and which the poses: by the user's word, else where one reading is possible.

use std::path::{Path, PathBuf};

use super::options::{FileRole, Options};
use super::runs::Part;
use crate::column_names::Quantity;
use crate::error::DatasetError;

/// All files with what they are read for, in the order of the runs.
///
/// # Errors
/// [`DatasetError::Undecided`] where a file is given without a flag beside `--wheels` and `--truth`.
pub(super) fn given(files: &[PathBuf], options: &Options) -> Result<Vec<(PathBuf, FileRole)>, DatasetError> {
    let Options { wheel_files, truth_files, without_truth, .. } = options;
    // What is given without a flag is what no flag gives.
    let rest = match (wheel_files.is_empty(), truth_files.is_empty() && !without_truth) {
        (true, true) => FileRole::Any,
        (true, false) => FileRole::Wheels,
        (false, true) => FileRole::Truth,
        (false, false) => {
            if let Some(file) = files.first() {
                let flags = format!("--wheels {0} or --truth {0}", file.display());
                return Err(DatasetError::Undecided {
                    file: file.clone(),
                    what: "the file, other than those of --wheels and --truth,".to_owned(),
                    readings: "one of the wheels or of the poses".to_owned(),
                    flag: flags,
                });
            }
            FileRole::Any
        }
    };
    let of = |files: &[PathBuf], role| files.iter().map(|file| (file.clone(), role)).collect::<Vec<_>>();
    Ok([of(files, rest), of(wheel_files, FileRole::Wheels), of(truth_files, FileRole::Truth)].concat())
}

/// Leaves out of each file what another has for it, and says so.
///
/// # Errors
/// [`DatasetError::Undecided`] where the files can be read in more than one way.
pub(super) fn settle(parts: &mut [Part]) -> Result<Vec<String>, DatasetError> {
    let with = |parts: &[Part], has: fn(&Part) -> bool| {
        (0..parts.len()).filter(|&part| has(&parts[part])).collect::<Vec<usize>>()
    };
    let both = with(parts, |part| part.roles.has_wheels() && part.roles.has_pose());
    let wheels = with(parts, |part| part.roles.has_wheels() && !part.roles.has_pose());
    let poses = with(parts, |part| !part.roles.has_wheels() && part.roles.has_pose());
    let mut remarks = Vec::new();
    if both.is_empty() {
        let counts = (wheels.len(), poses.len());
        // A truth that is one file is that of all runs, by their times.
        if counts.1 > 1 && counts.0 != counts.1 {
            return Err(unpaired(parts, &wheels, &poses));
        }
        return Ok(remarks);
    }
    let is_whole = |part: &&usize| {
        let roles = &parts[**part].roles;
        roles.has(Quantity::Left) || roles.of[&Quantity::X].is_outside
    };
    let are_whole = both.iter().all(|part| is_whole(&part));
    match (wheels.len(), poses.len()) {
        // One file, or a run a file: no instrument writes both wheels.
        (0, 0) if both.len() == 1 || are_whole => {}
        (0, of_poses) if of_poses > 0 && (of_poses == 1 || of_poses == both.len()) && !has_outside(parts, &both) => {
            for part in both {
                leave_poses_out(&mut parts[part]);
                remarks.push(said(&parts[part].sheet.file, "poses", "those of the other file are the truth"));
            }
        }
        // A twist beside poses is the instrument's where another file has wheels.
        (of_wheels, 0) if of_wheels == both.len() && both.iter().all(|&part| !is_sided(&parts[part])) => {
            for part in both {
                leave_wheels_out(&mut parts[part]);
                remarks.push(said(&parts[part].sheet.file, "twists", "the other file has the wheels"));
            }
        }
        _ => return Err(ambiguous(parts, &both, &wheels, &poses)),
    }
    Ok(remarks)
}

fn said(file: &Path, what: &str, why: &str) -> String {
    format!("{}: its own {what} are left out: {why} (--wheels, --truth)", file.display())
}

fn is_sided(part: &Part) -> bool {
    part.roles.has(Quantity::Left)
}

fn has_outside(parts: &[Part], of: &[usize]) -> bool {
    of.iter().any(|&part| parts[part].roles.of[&Quantity::X].is_outside)
}

fn file_name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Poses of a file are not read.
fn leave_poses_out(part: &mut Part) {
    part.roles.leave_out(&part.sheet, Quantity::is_of_pose);
    part.log.pose = None;
}

fn leave_wheels_out(part: &mut Part) {
    part.roles.leave_out(&part.sheet, |quantity| quantity.is_of_robot() && quantity != Quantity::Gyro);
    part.log.wheels = None;
}

/// The files in all readings that are possible, with the flags of each.
fn ambiguous(parts: &[Part], both: &[usize], wheels: &[usize], poses: &[usize]) -> DatasetError {
    /// So many readings are shown.
    const SHOWN: usize = 3;
    let file = |part: usize| parts[part].sheet.file.display().to_string();
    let name = |part: usize| file_name(&parts[part].sheet.file);
    let mut readings: Vec<(String, String)> = Vec::new();
    let motions: Vec<usize> = (0..parts.len()).filter(|part| both.contains(part) || wheels.contains(part)).collect();
    for &motion in &motions {
        for truth in (0..parts.len()).filter(|part| *part != motion && (both.contains(part) || poses.contains(part))) {
            let flags = format!("--wheels {} --truth {}", file(motion), file(truth));
            readings.push((format!("the wheels of {} with the poses of {}", name(motion), name(truth)), flags));
        }
    }
    readings.truncate(SHOWN - 1);
    if let [first, ..] = both {
        let flags: Vec<String> = both.iter().map(|&part| format!("--wheels {0} --truth {0}", file(part))).collect();
        let each = if both.len() == 1 { name(*first) } else { "each file".to_owned() };
        readings.push((format!("the wheels of {each} with its own poses"), flags.join(" ")));
    }
    let has = |part: &usize| {
        let what = match (both.contains(part), wheels.contains(part)) {
            (true, _) => "wheels and poses",
            (false, true) => "wheels",
            (false, false) => "poses",
        };
        format!("{} has {what}", name(*part))
    };
    let all: Vec<String> = (0..parts.len()).map(|part| has(&part)).collect();
    let (readings, flags): (Vec<String>, Vec<String>) = readings.into_iter().unzip();
    DatasetError::Undecided {
        file: parts[both[0]].sheet.file.clone(),
        what: format!("the truth ({})", all.join(", ")),
        readings: readings.join(", or "),
        flag: flags.join(", or "),
    }
}

/// Several files of poses, and another number of files of wheels.
fn unpaired(parts: &[Part], wheels: &[usize], poses: &[usize]) -> DatasetError {
    let named = |of: &[usize]| {
        let names: Vec<String> = of.iter().map(|&part| parts[part].sheet.file.display().to_string()).collect();
        names.join(", ")
    };
    let file = parts[poses[0]].sheet.file.clone();
    DatasetError::Undecided {
        what: format!("the truth ({} files have wheels, {} have poses)", wheels.len(), poses.len()),
        readings: named(poses).replace(", ", " or "),
        flag: format!("--truth FILE once, or once for each file of the wheels ({})", named(wheels)),
        file,
    }
}
