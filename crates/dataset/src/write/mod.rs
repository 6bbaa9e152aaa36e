//! Writing a dataset: all of it or nothing, in the shortest numbers that read back to the same bits.
//!
//! The files are made in a temporary sibling of the target, and that folder is renamed into place: whoever
//! looks sees the old state or the new one.

mod check;
mod manifest;
mod tables;

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::mem::{Discriminant, discriminant};
use std::path::{Path, PathBuf};

use atomic_file::WorkFolder;
use tables::{OptionalColumns, Out, TABLES};

use crate::error::{DatasetError, shown};
use crate::read::{DISPLACEMENT, DISTANCE, GYRO, MANIFEST, ODOMETRY, POINTS, REVISIT, TRUTH, WALL, WHEEL_REFERENCE};
use crate::record::{Dataset, Run, RunInfo, WheelLog};
use crate::settings::MANIFEST_LIMIT_BYTES;

/// Every file that a dataset may have; what [`Existing::ReplaceDataset`] may delete.
const FILES: [&str; 10] =
    [MANIFEST, ODOMETRY, TRUTH, DISPLACEMENT, POINTS, WHEEL_REFERENCE, REVISIT, DISTANCE, WALL, GYRO];

/// What to do with something that stands where a dataset is to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Write only where nothing is, or an empty folder.
    Refuse,
    /// Replace a folder that holds a dataset and nothing else.
    ReplaceDataset,
}

/// Writes a dataset into the folder `dir`, which is made together with its parents.
///
/// What was written reads back equal to the last bit. Two things have one form on disk and come back in it: a
/// standard deviation of 0 is unknown, and a run whose samples all have unknown sigmas has no
/// [`Run::truth_sigma`].
///
/// # Errors
/// [`DatasetError::AlreadyExists`] as `existing` says; [`DatasetError::RunNotWritable`] and
/// [`DatasetError::NotWritable`] when the dataset could not be read back (a NaN, unequal columns, a run
/// without truth …); [`DatasetError::Io`]. In each case `dir` is as it was.
pub fn write(dataset: &Dataset, dir: &Path, existing: Existing) -> Result<(), DatasetError> {
    write_with_shift(dataset, dir, existing, None)
}

/// Writes a dataset whose instrument's instants are shifted as it is read: `truth_shift_s` seconds are added
/// to them by `[corrections]`, and the tables keep what was recorded.
///
/// # Errors
/// As [`write()`]; [`DatasetError::NotWritable`] of a shift that is no number.
pub fn write_with_shift(
    dataset: &Dataset,
    dir: &Path,
    existing: Existing,
    truth_shift_s: Option<f64>,
) -> Result<(), DatasetError> {
    // Before anything is made.
    check::check(dataset)?;
    if let Some(shift_s) = truth_shift_s.filter(|shift_s| !shift_s.is_finite()) {
        return Err(DatasetError::NotWritable { what: format!("a shift of {shift_s} s") });
    }
    let header = dataset.header();
    let mut writer = Writer::with_columns(header, OptionalColumns::of(&dataset.runs), dir, existing)?;
    writer.truth_shift_s = truth_shift_s;
    dataset.runs.iter().try_for_each(|run| writer.push(run))?;
    writer.finish()
}

/// Could a dataset be written and read back? [`write()`] asks the same before anything is made.
///
/// # Errors
/// [`DatasetError::RunNotWritable`] and [`DatasetError::NotWritable`], as of [`write()`].
pub fn check_writable(dataset: &Dataset) -> Result<(), DatasetError> {
    check::check(dataset)
}

/// Writes a dataset a run at a time, into a temporary sibling until all is there. Dropped before
/// [`Self::finish`] it leaves nothing.
#[derive(Debug)]
pub struct Writer {
    /// Without runs.
    header: Dataset,
    /// `[corrections] truth_shift_s`.
    truth_shift_s: Option<f64>,
    columns: OptionalColumns,
    target: PathBuf,
    existing: Existing,
    work: WorkFolder,
    infos: Vec<RunInfo>,
    ids: BTreeSet<String>,
    /// The form in which the first run reports its wheels.
    form: Option<Discriminant<WheelLog>>,
    /// Those of [`TABLES`] that some run has rows for.
    tables: [Option<Out>; TABLES.len()],
}

impl Writer {
    /// Begins a dataset in the folder `dir`. The runs of `header` are not written; none of those that are may
    /// have an
    /// [`ExtraChannel`](crate::ExtraChannel) or a [`Run::truth_sigma`].
    ///
    /// # Errors
    /// As [`write()`].
    pub fn create(header: Dataset, dir: &Path, existing: Existing) -> Result<Self, DatasetError> {
        Self::with_columns(header, OptionalColumns::default(), dir, existing)
    }

    fn with_columns(
        header: Dataset,
        columns: OptionalColumns,
        dir: &Path,
        existing: Existing,
    ) -> Result<Self, DatasetError> {
        check::check_header(&header)?;
        let target = resolved(dir)?;
        may_write(&target, existing)?;
        let parent = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        atomic_file::create_all(parent).map_err(|source| io_error(parent, source))?;
        // The name of the folder under way would tell the user nothing: only the kind of the error is shown.
        let work = WorkFolder::beside(parent).map_err(|source| io_error(&target, io::Error::from(source.kind())))?;
        let (infos, ids, tables) = (Vec::new(), BTreeSet::new(), Default::default());
        Ok(Self { header, truth_shift_s: None, columns, target, existing, work, infos, ids, form: None, tables })
    }

    /// Adds a run.
    ///
    /// # Errors
    /// As [`write()`]; the writer is of no use then.
    pub fn push(&mut self, run: &Run) -> Result<(), DatasetError> {
        let form = *self.form.get_or_insert_with(|| discriminant(&run.odometry.wheels));
        check::check_next(&self.header, form, run, &mut self.ids)?;
        if !self.columns.hold(run) {
            let what = "optional columns that the dataset's tables were begun without".to_owned();
            return Err(DatasetError::RunNotWritable { run: shown(run.info.id.as_bytes()), what });
        }
        let made = self.work.made();
        for (kind, out) in TABLES.iter().zip(&mut self.tables) {
            if !(kind.has)(run) {
                continue;
            }
            let (file, columns) = (made.join(kind.file), &self.columns);
            let mut rows = || {
                if out.is_none() {
                    let mut begun = BufWriter::with_capacity(1 << 16, fs::File::create_new(&file)?);
                    writeln!(begun, "{}", (kind.header)(run, columns))?;
                    *out = Some(begun);
                }
                out.as_mut().map_or(Ok(()), |out| (kind.rows)(run, &self.header.points, columns, out))
            };
            rows().map_err(|source| io_error(&self.target.join(kind.file), source))?;
        }
        self.infos.push(run.info.clone());
        Ok(())
    }

    /// Puts the dataset into its place.
    ///
    /// # Errors
    /// As [`write()`].
    pub fn finish(self) -> Result<(), DatasetError> {
        let not_writable = |what| DatasetError::NotWritable { what };
        if self.infos.is_empty() {
            return Err(check::without_runs());
        }
        let toml = manifest::to_toml(&self.header, &self.infos, self.truth_shift_s)
            .map_err(|error| not_writable(error.to_string()))?;
        if toml.len() as u64 > MANIFEST_LIMIT_BYTES {
            let what = format!(
                "{MANIFEST} would be longer than {MANIFEST_LIMIT_BYTES} bytes; write fewer runs in one dataset"
            );
            return Err(not_writable(what));
        }
        let (made, target) = (self.work.made(), &self.target);
        let file = made.join(MANIFEST);
        fs::write(&file, toml).map_err(|source| io_error(&target.join(MANIFEST), source))?;
        for (kind, out) in TABLES.iter().zip(self.tables) {
            out.map_or(Ok(()), |mut out| out.flush()).map_err(|source| io_error(&target.join(kind.file), source))?;
        }
        // Asked again: while the runs were written someone else may have come.
        if !may_write(target, self.existing)? {
            return self.work.rename_to(target).map_err(|source| io_error(target, source));
        }
        self.work.replace(target).map_err(|source| io_error(target, source))
    }
}

fn io_error(path: &Path, source: io::Error) -> DatasetError {
    DatasetError::Io { path: path.to_owned(), source }
}

/// The folder itself where `dir` ends in `..`, as only that can be renamed.
fn resolved(dir: &Path) -> Result<PathBuf, DatasetError> {
    atomic_file::refuse_link(dir).map_err(|source| io_error(dir, source))?;
    match dir.canonicalize() {
        Ok(target) => Ok(target),
        Err(error) if error.kind() == io::ErrorKind::NotFound && dir.file_name().is_some() => Ok(dir.to_owned()),
        Err(source) => Err(io_error(dir, source)),
    }
}

/// Whether something stands at `target` that must be moved away first; an error when it must stay.
fn may_write(target: &Path, existing: Existing) -> Result<bool, DatasetError> {
    let refuse = |why: String| Err(DatasetError::AlreadyExists { path: target.to_owned(), why });
    match target.symlink_metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(source) => return Err(io_error(target, source)),
        Ok(metadata) if !metadata.is_dir() => return refuse("is not a folder".to_owned()),
        Ok(_) => {}
    }
    let (mut is_empty, mut foreign) = (true, None);
    for entry in target.read_dir().map_err(|source| io_error(target, source))? {
        let entry = entry.map_err(|source| io_error(target, source))?;
        is_empty = false;
        // A folder of a table's name may hold anything.
        let is_file = entry.file_type().map_err(|source| io_error(target, source))?.is_file();
        if !is_file || !FILES.iter().any(|file| entry.file_name() == **file) {
            foreign = Some(entry.file_name());
        }
    }
    if is_empty {
        return Ok(true);
    }
    match (existing, foreign) {
        (Existing::Refuse, _) => refuse("is not empty".to_owned()),
        (Existing::ReplaceDataset, _) if !target.join(MANIFEST).is_file() => {
            refuse(format!("is not a dataset: there is no {MANIFEST} in it"))
        }
        (Existing::ReplaceDataset, Some(name)) => {
            refuse(format!("holds more than a dataset: \"{}\"", shown(name.to_string_lossy().as_bytes())))
        }
        (Existing::ReplaceDataset, None) => Ok(true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partial::LidarExtrinsics;
    use crate::record::{
        CovarianceScale, NominalRobot, Odometry, Provenance, RunInfo, TruthNoise, TruthSample, WheelLog,
    };
    use kinematics::Wheels;

    fn dataset(name: &str) -> Dataset {
        let run = Run {
            info: RunInfo { id: "a".into(), ..RunInfo::default() },
            odometry: Odometry {
                t_s: vec![0.0, 0.1].into(),
                wheels: WheelLog::Ticks(Wheels { left: vec![0, 5], right: vec![0, 7] }),
                ..Odometry::default()
            },
            truth: vec![TruthSample::new(0.0, 0.0, 0.0, None)],
            ..Run::default()
        };
        Dataset {
            provenance: Provenance { name: Some(name.into()), ..Provenance::default() },
            robot: NominalRobot {
                left_wheel_diameter_m: 0.1,
                right_wheel_diameter_m: 0.1,
                wheel_separation_m: 0.3,
                ticks_per_rev: Some(1000.0),
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs: vec![run],
        }
    }

    fn name_in(dir: &Path) -> String {
        crate::read(dir).expect("readable").dataset.provenance.name.expect("a name")
    }

    fn entries(dir: &Path) -> Vec<String> {
        let mut names: Vec<_> = dir
            .read_dir()
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn parents_are_made_and_nothing_else_is_left_behind() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let dir = temp.path().join("a/b/c");
        write(&dataset("one"), &dir, Existing::Refuse).expect("written");
        assert_eq!(name_in(&dir), "one");
        assert_eq!(entries(&temp.path().join("a/b")), ["c"]);
        assert_eq!(entries(&dir), ["dataset.toml", "odometry.csv", "truth.csv"]);
    }

    #[test]
    fn an_empty_folder_is_filled_and_a_full_one_refused() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let dir = temp.path().join("set");
        fs::create_dir(&dir).expect("made");
        write(&dataset("one"), &dir, Existing::Refuse).expect("written");
        let refused = write(&dataset("two"), &dir, Existing::Refuse).expect_err("not empty");
        assert!(refused.to_string().contains("already exists and is not empty"), "{refused}");
        assert_eq!(name_in(&dir), "one");
        write(&dataset("two"), &dir, Existing::ReplaceDataset).expect("replaced");
        assert_eq!(name_in(&dir), "two");
        assert_eq!(entries(temp.path()), ["set"]);
    }

    #[test]
    fn only_a_dataset_and_nothing_beside_it_is_replaced() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let dir = temp.path().join("thesis");
        fs::create_dir(&dir).expect("made");
        fs::write(dir.join("chapter.tex"), "years of work").expect("written");
        let refused = write(&dataset("one"), &dir, Existing::ReplaceDataset).expect_err("no dataset");
        assert!(refused.to_string().contains("no dataset.toml"), "{refused}");
        fs::write(dir.join(MANIFEST), "format = 1").expect("written");
        let refused = write(&dataset("one"), &dir, Existing::ReplaceDataset).expect_err("more than a dataset");
        assert!(refused.to_string().contains("chapter.tex"), "{refused}");
        assert_eq!(entries(&dir), ["chapter.tex", "dataset.toml"]);
        let file = temp.path().join("file");
        fs::write(&file, "x").expect("written");
        let refused = write(&dataset("one"), &file, Existing::ReplaceDataset).expect_err("a file");
        assert!(refused.to_string().contains("is not a folder"), "{refused}");
    }

    #[test]
    fn the_scale_of_covariances_and_the_lidar_come_back_as_they_were_written() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let unknown = LidarExtrinsics::default();
        let turned = LidarExtrinsics { yaw_rad: Some(-1.25) };
        let cases = [
            (CovarianceScale::Separate, None, [false; 3]),
            (CovarianceScale::Common, Some(unknown), [true, true, false]),
            (CovarianceScale::Common, Some(turned), [true; 3]),
        ];
        for (number, (covariance_scale, lidar, stands)) in cases.into_iter().enumerate() {
            let mut one = dataset("one");
            one.truth_noise = TruthNoise { covariance_scale, lidar, ..TruthNoise::default() };
            let dir = temp.path().join(number.to_string());
            write(&one, &dir, Existing::Refuse).expect("written");
            let text = fs::read_to_string(dir.join(MANIFEST)).expect("a manifest");
            let words = ["covariance_scale = \"common\"", "[lidar]", "yaw_rad = -1.25"];
            assert_eq!(words.map(|word| text.contains(word)), stands, "{text}");
            assert_eq!(crate::read(&dir).expect("readable").dataset, one);
        }
        // Said in words, and refused with its line where it is another.
        let file = temp.path().join("0").join(MANIFEST);
        let text = fs::read_to_string(&file).expect("a manifest");
        let line = 1 + text.lines().position(|line| line == "[truth]").expect("a table");
        let with = |key: &str| {
            fs::write(&file, text.replace("[truth]", &format!("[truth]\n{key}"))).expect("written");
            crate::read(&temp.path().join("0"))
        };
        let found = with("covariance_scale = \"separate\"").expect("readable").dataset.truth_noise;
        assert_eq!(found.covariance_scale, CovarianceScale::Separate);
        let refused = with("covariance_scale = \"both\"").expect_err("no scale").to_string();
        assert!(refused.contains(&format!("dataset.toml:{}:", line + 1)), "{refused}");
        assert!(refused.contains("separate") && refused.contains("common"), "{refused}");
        let mut wrong = dataset("one");
        wrong.truth_noise.lidar = Some(LidarExtrinsics { yaw_rad: Some(f64::NAN) });
        write(&wrong, &temp.path().join("wrong"), Existing::Refuse).expect_err("NaN");
    }

    #[test]
    fn a_manifest_that_would_be_too_long_to_read_is_not_written() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let mut long = dataset("one");
        long.provenance.notes = Some("word ".repeat(1 << 20));
        let refused = write(&long, &temp.path().join("set"), Existing::Refuse).expect_err("too long");
        assert!(refused.to_string().contains("dataset.toml would be longer than 4194304 bytes"), "{refused}");
        assert!(entries(temp.path()).is_empty());
    }

    #[test]
    fn a_dataset_that_could_not_be_read_back_leaves_no_trace() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let mut wrong = dataset("one");
        wrong.runs[0].odometry.t_s[1] = f64::NAN;
        write(&wrong, &temp.path().join("a/set"), Existing::Refuse).expect_err("NaN");
        assert!(entries(temp.path()).is_empty());
    }

    #[test]
    fn a_writer_that_is_dropped_or_refuses_a_run_leaves_no_trace() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let target = temp.path().join("set");
        let whole = dataset("old");
        let begin = || Writer::create(whole.header(), &target, Existing::Refuse).expect("begun");
        let run = &whole.runs[0];
        let mut writer = begin();
        writer.push(run).expect("sound");
        drop(writer);
        let mut sparse = Run { info: RunInfo { id: "other".to_owned(), ..RunInfo::default() }, ..run.clone() };
        sparse.odometry.extra.insert(crate::ExtraChannel::GyroYawRate, vec![0.0; run.odometry.t_s.len()]);
        for (second, expected) in [(run, "a second run with this id"), (&sparse, "optional columns")] {
            let mut writer = begin();
            writer.push(run).expect("sound");
            let error = writer.push(second).expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}");
        }
        assert!(begin().finish().expect_err("nothing in it").to_string().contains("without runs"));
        assert!(entries(temp.path()).is_empty());
        let mut writer = begin();
        writer.push(run).expect("sound");
        writer.finish().expect("written");
        assert_eq!(crate::read(&target).expect("readable").dataset.runs, std::slice::from_ref(run));
    }
}
