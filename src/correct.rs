//! `yair correct DATASET... --calibration FILE --out DIR`

use std::fmt::Write;
use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;

use atomic_file::WorkFolder;
use calib::{CorrectedRun, corrected_run};
use clap::Args;
use dataset::{Dataset, Loaded, RunByRun, Warning};
use kinematics::Pose;
use serde::Serialize;

use crate::calibration_file::GivenCalibration;
use crate::check;
use crate::new_folders::NewFolders;
use crate::simulate::refuse_filled;
use crate::terminal::{Failure, Terminal, datasets_at, folder_name, warn};

/// Write the corrected pose of every row of a log.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets of the robot; a folder of datasets means all of them.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Calibration file from `yair calibrate --out`, or extended model from `yair diagnose --out`.
    #[arg(long = "calibration", value_name = "FILE")]
    calibration: PathBuf,
    /// Folder for RUN.csv and RUN.tum of every run; several datasets get one folder each inside it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Write into a folder that is not empty.
    #[arg(long)]
    force: bool,
}

#[derive(Serialize)]
struct Document {
    calibration: String,
    out: String,
    datasets: Vec<CorrectedDataset>,
}

#[derive(Serialize)]
struct CorrectedDataset {
    dataset: String,
    runs: Vec<RunDocument>,
}

#[derive(Serialize)]
struct RunDocument {
    run: String,
    rows: usize,
    length_m: f64,
    /// `truth` or `identity`.
    starts_at: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    starts_at_identity_why: Option<&'static str>,
    csv: String,
    tum: String,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let calibration = only(GivenCalibration::read(&arguments.calibration)?)?;
    let paths = datasets_at(&arguments.datasets)?;
    let out = &arguments.out;
    refuse_filled(out, arguments.force)?;
    check::before_reading(&paths, terminal);
    // All files are written beside the folder before the first is put into it.
    let beside = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let unwritable = |error: std::io::Error| format!("{}: {}", out.display(), error.kind());
    let _new = NewFolders::to(out);
    atomic_file::create_all(beside).map_err(unwritable)?;
    let waiting = WorkFolder::beside(beside).map_err(unwritable)?;
    let mut files = Files { waiting: waiting.made(), written: Vec::new() };
    let mut datasets = Vec::with_capacity(paths.len());
    for path in &paths {
        let inside = if paths.len() > 1 { PathBuf::from(folder_name(path)) } else { PathBuf::new() };
        if paths.len() > 1 && files.written.iter().any(|file| file.starts_with(&inside)) {
            let why = "two datasets have folders of this name; correct them one by one";
            return Err(format!("{}: {why}", path.display()).into());
        }
        datasets.push(correct(path, &inside, &calibration, out, &mut files, terminal)?);
    }
    for file in &files.written {
        let target = out.join(file);
        let inside = file.parent().unwrap_or(Path::new(""));
        let moved =
            atomic_file::create_inside(out, inside).and_then(|()| std::fs::rename(waiting.made().join(file), &target));
        moved.map_err(|error| format!("{}: {error}", target.display()))?;
    }
    calibration.remark(terminal);
    let runs = || datasets.iter().flat_map(|dataset| &dataset.runs);
    let rows: usize = runs().map(|run| run.rows).sum();
    terminal.note(&format!("{} runs, {rows} corrected poses in {}", runs().count(), out.display()))?;
    let calibration = calibration.calibration().calibration.name.clone();
    terminal.document(&Document { calibration, out: out.display().to_string(), datasets })?;
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn only(calibrations: Vec<GivenCalibration>) -> Result<GivenCalibration, Failure> {
    match <[GivenCalibration; 1]>::try_from(calibrations) {
        Ok([calibration]) => Ok(calibration),
        Err(several) => {
            let names: Vec<&str> = several.iter().map(|of| &of.calibration().calibration.name[..]).collect();
            let place = several.first().map_or("", GivenCalibration::place);
            let why = format!("it holds {} calibrations ({}); give a file with one", names.len(), names.join(", "));
            Err(format!("{place}: {why}: yair calibrate --method M --out FILE").into())
        }
    }
}

/// Files that wait until all are written.
struct Files<'w> {
    waiting: &'w Path,
    written: Vec<PathBuf>,
}

impl Files<'_> {
    fn write(&mut self, file: PathBuf, text: &str) -> Result<(), Failure> {
        let path = self.waiting.join(&file);
        let folder = path.parent().unwrap_or(self.waiting);
        let written = atomic_file::create_all(folder).and_then(|()| atomic_file::write_whole(&path, text.as_bytes()));
        written.map_err(|error| format!("{}: {}", file.display(), error.kind()))?;
        self.written.push(file);
        Ok(())
    }
}

fn correct(
    path: &Path,
    inside: &Path,
    calibration: &GivenCalibration,
    out: &Path,
    files: &mut Files<'_>,
    terminal: &Terminal,
) -> Result<CorrectedDataset, Failure> {
    let warn = |warnings: &[Warning]| warn(path, warnings, terminal);
    let place = path.display().to_string();
    let mut driven_m = 0.0;
    let mut runs = Vec::new();
    let mut corrected = |dataset: &Dataset| -> Result<(), Failure> {
        calibration.check(&dataset.robot, &place)?;
        let session = dataset.session();
        for run in &session.runs {
            let id = &run.info().id;
            let poses = corrected_run(&session, run, calibration.calibration(), &mut driven_m);
            let CorrectedRun { poses, length_m, starts_at_identity_why, depends_on_start } =
                poses.ok_or_else(|| {
                    format!(
                        "{place}: run \"{id}\": its wheels say no motion; counts need ticks_per_rev in dataset.toml"
                    )
                })?;
            if depends_on_start {
                terminal.remark(&format!(
                    "{place}: run \"{id}\": effects depend on heading and place in the room, and nothing measured where it starts"
                ));
            }
            let (csv, tum) = (file_of(inside, id, "csv", &place)?, file_of(inside, id, "tum", &place)?);
            let [csv_path, tum_path] = [&csv, &tum].map(|file| out.join(file).display().to_string());
            files.write(csv, &csv_of(&poses))?;
            files.write(tum, &::export::tum(poses.iter().copied()))?;
            runs.push(RunDocument {
                run: id.clone(),
                rows: poses.len(),
                length_m,
                starts_at: if starts_at_identity_why.is_some() { "identity" } else { "truth" },
                starts_at_identity_why,
                csv: csv_path,
                tum: tum_path,
            });
        }
        Ok(())
    };
    let name;
    if calibration.changes_records() {
        let Loaded { dataset, warnings } = dataset::read(path)?;
        warn(&warnings);
        name = dataset.provenance.name.clone();
        corrected(&*calibration.undone(&dataset, &place, terminal)?)?;
    } else {
        // One run at a time: logs may be larger than the memory.
        let opened = RunByRun::open(path)?;
        warn(opened.warnings());
        name = opened.header().provenance.name.clone();
        for run in opened {
            let Loaded { dataset, warnings } = run?;
            warn(&warnings);
            corrected(&dataset)?;
        }
    }
    Ok(CorrectedDataset { dataset: name.unwrap_or_else(|| folder_name(path)), runs })
}

/// The file of a run; an id that is no name of a file is refused.
pub(crate) fn file_of(inside: &Path, id: &str, extension: &str, place: &str) -> Result<PathBuf, Failure> {
    let mut parts = Path::new(id).components();
    let is_name = matches!((parts.next(), parts.next()), (Some(Component::Normal(name)), None) if name == id);
    if !is_name || id.contains(['/', '\\']) {
        return Err(format!("{place}: run \"{id}\": its id is no name of a file; give the run another one").into());
    }
    Ok(inside.join(format!("{id}.{extension}")))
}

fn csv_of(poses: &[(f64, Pose)]) -> String {
    let mut text = "t_s,x_m,y_m,theta_rad\n".to_owned();
    for (t_s, Pose { x_m, y_m, theta_rad }) in poses {
        let _ = writeln!(text, "{t_s},{x_m},{y_m},{theta_rad}");
    }
    text
}
