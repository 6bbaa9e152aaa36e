//! Files and folders under way, and what is left of those whose process was killed.
//!
//! Whatever is being written has a name that begins with [`PREFIX`], beside its final one, and is locked by
//! its process as long as that lives: the file itself, or [`LOCK`] inside of a folder. [`remove_leftovers`]
//! takes away what has that name and no owner any more. A lock that keeps nobody out says nothing of an
//! owner: what is found on a file system without locks stays.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempDir};

use crate::lock::{is_still_at, keeps_others_out, opened};
use crate::under_way::{UnderWay, begun};

/// How the name of a file or folder under way begins.
pub const PREFIX: &str = ".writing-";

/// The file inside of a folder under way that its process has locked.
const LOCK: &str = "lock";

/// The folder that is being made, inside of the folder under way.
const MADE: &str = "made";

/// What is replaced, until that is done.
const REPLACED: &str = "replaced";

/// Times that something is begun anew because another process took it for a leftover before it was locked.
const MAX_TURNS: usize = 16;

/// A folder that is being made, to be renamed into its place. Dropped before, it leaves nothing; killed
/// before, it is taken away by the next [`WorkFolder::beside`] in the same place.
#[derive(Debug)]
pub struct WorkFolder {
    made: PathBuf,
    /// Given up before the folder is taken away: not every system removes a file that is open.
    _lock: Option<File>,
    folder: TempDir,
    /// Dropped last.
    _under_way: UnderWay,
}

impl WorkFolder {
    /// Makes a folder inside of `parent`, and first takes away what killed processes left there.
    ///
    /// # Errors
    /// The system's, when `parent` is not there or cannot be written.
    pub fn beside(parent: &Path) -> io::Result<Self> {
        remove_leftovers(parent);
        for _ in 0..MAX_TURNS {
            // The folder that tempfile makes is private to the user; the one inside gets the usual
            // permissions.
            let mut begun = begun();
            let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
            let under_way = UnderWay::listed(&mut begun, folder.path());
            drop(begun);
            let path = folder.path().join(LOCK);
            let lock = match opened(&path) {
                // Empty still, it has been taken for a leftover.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                lock => lock?,
            };
            // Without locks nobody takes it for a leftover.
            if lock.lock().is_err() || is_still_at(&lock, &path) {
                let made = folder.path().join(MADE);
                fs::create_dir(&made)?;
                return Ok(Self { made, _lock: Some(lock), folder, _under_way: under_way });
            }
        }
        Err(io::Error::other("what is written there is taken away by another process"))
    }

    /// The folder to write into.
    #[must_use]
    pub fn made(&self) -> &Path {
        &self.made
    }

    /// Puts the folder into its place, where nothing is.
    ///
    /// # Errors
    /// The system's.
    pub fn rename_to(self, target: &Path) -> io::Result<()> {
        // Else an end of the process could empty the folder while it is given its name.
        let _begun = begun();
        fs::rename(&self.made, target)
    }

    /// Puts the folder into the place of another one, which is deleted.
    ///
    /// # Errors
    /// The system's; the other one is then as it was.
    pub fn replace(self, target: &Path) -> io::Result<()> {
        let old = self.folder.path().join(REPLACED);
        // No end of the process comes between the two.
        let _begun = begun();
        fs::rename(target, &old)?;
        fs::rename(&self.made, target).inspect_err(|_| {
            // Back as it was; when not even that works, the first reason is still the one to tell.
            let _ = fs::rename(&old, target);
        })
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        empty(self.folder.path());
    }
}

/// Takes away what is in a folder under way, and the lock last: a kill in between leaves what the next one
/// can tell for a leftover.
fn empty(folder: &Path) {
    for inside in [MADE, REPLACED] {
        let _ = fs::remove_dir_all(folder.join(inside));
    }
}

/// A file that is being written, to be renamed into its place. Dropped before, it leaves nothing.
#[derive(Debug)]
pub struct StagedFile {
    file: NamedTempFile,
    /// Dropped last.
    _under_way: UnderWay,
}

impl StagedFile {
    /// The file to write into.
    #[must_use]
    pub fn as_file(&self) -> &File {
        self.file.as_file()
    }

    /// Puts the file into its place; one that was there before is replaced.
    ///
    /// # Errors
    /// The system's; what was there before is then unharmed.
    pub fn persist(self, path: &Path) -> io::Result<()> {
        self.file.persist(path)?;
        Ok(())
    }
}

/// A locked file inside of `folder` under a name of its own.
pub(crate) fn locked_file(folder: &Path) -> io::Result<StagedFile> {
    for _ in 0..MAX_TURNS {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        // As readable as any other file of the user; temporary files are private.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut begun = begun();
        let file = builder.tempfile_in(folder)?;
        let under_way = UnderWay::listed(&mut begun, file.path());
        drop(begun);
        if file.as_file().lock().is_err() || is_still_at(file.as_file(), file.path()) {
            return Ok(StagedFile { file, _under_way: under_way });
        }
    }
    Err(io::Error::other("what is written there is taken away by another process"))
}

/// Takes away what killed processes left in a folder: files and folders under way that nobody has locked.
/// What cannot be read or removed stays, and so does a folder that a kill caught between two renames: it
/// holds what was to be replaced.
pub fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let is_ours = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(PREFIX);
    for entry in entries.flatten().filter(is_ours) {
        let path = entry.path();
        let removed = match entry.file_type() {
            Ok(kind) if kind.is_file() => without_owner(&path, || fs::remove_file(&path)),
            Ok(kind) if kind.is_dir() => remove_folder(&path),
            _ => Ok(()),
        };
        // What stays is in nobody's way.
        drop(removed);
    }
}

/// Takes away a folder under way without an owner, unless it holds what was to be replaced.
fn remove_folder(path: &Path) -> io::Result<()> {
    if path.join(MADE).exists() && path.join(REPLACED).exists() {
        return Ok(());
    }
    // The empty one of a process that has just begun may go too: it then makes another.
    fs::remove_dir(path).or_else(|_| {
        without_owner(&path.join(LOCK), || {
            empty(path);
            fs::remove_dir_all(path)
        })
    })
}

/// Does something while a file is locked, if nobody else has it and locks mean something here.
fn without_owner(file: &Path, act: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
    let handle = File::options().read(true).write(true).open(file)?;
    handle.try_lock()?;
    keeps_others_out(file)?;
    act()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
        let mut names: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn what_has_no_owner_is_taken_away_and_all_else_stays() {
        let temporary = tempfile::tempdir().expect("a folder");
        let here = temporary.path();
        let (mine, file) = (WorkFolder::beside(here).expect("made"), stage(&here.join("a"), b"1").expect("staged"));
        fs::write(here.join(".writing-file"), "half").expect("written");
        fs::create_dir_all(here.join(".writing-dead/made")).expect("made");
        fs::write(here.join(".writing-dead/lock"), "").expect("written");
        fs::create_dir_all(here.join(".writing-empty")).expect("made");
        // No lock: not ours. Both folders: a kill between two renames.
        fs::create_dir_all(here.join(".writing-other/work")).expect("made");
        fs::create_dir_all(here.join(".writing-caught/made")).expect("made");
        fs::create_dir_all(here.join(".writing-caught/replaced")).expect("made");
        fs::write(here.join(".writing-caught/lock"), "").expect("written");
        fs::write(here.join("notes"), "").expect("written");
        remove_leftovers(here);
        let left = names(here);
        assert!([".writing-caught", ".writing-other", "notes"].iter().all(|name| left.contains(&(*name).to_owned())));
        assert_eq!(left.len(), 5, "{left:?}");
        assert!(mine.made().is_dir() && file.file.path().is_file());
        // The next one in the same place does the same, and nothing of these two is left when they end.
        fs::write(here.join(".writing-file"), "half").expect("written");
        drop((WorkFolder::beside(here).expect("made"), mine, file));
        assert_eq!(names(here), [".writing-caught", ".writing-other", "notes"]);
    }

    #[test]
    fn a_folder_replaces_another_or_leaves_it() {
        let temporary = tempfile::tempdir().expect("a folder");
        let target = temporary.path().join("set");
        let begun = |text: &str| {
            let work = WorkFolder::beside(temporary.path()).expect("made");
            fs::write(work.made().join("file"), text).expect("written");
            work
        };
        begun("one").rename_to(&target).expect("renamed");
        begun("two").replace(&target).expect("replaced");
        assert_eq!(fs::read_to_string(target.join("file")).expect("there"), "two");
        let broken = begun("three");
        fs::remove_dir_all(broken.made()).expect("removed");
        broken.replace(&target).expect_err("there is nothing to put in its place");
        assert_eq!(fs::read_to_string(target.join("file")).expect("there"), "two");
        assert_eq!(names(temporary.path()), ["set"]);
    }

    #[test]
    fn regress_no_folder_gets_its_name_while_it_is_taken_away() {
        let temporary = tempfile::tempdir().expect("a folder");
        let target = temporary.path().join("set");
        let work = WorkFolder::beside(temporary.path()).expect("made");
        let taking_away = begun();
        let renaming = std::thread::spawn({
            let target = target.clone();
            move || work.rename_to(&target)
        });
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(!target.exists(), "it could be emptied meanwhile");
        drop(taking_away);
        renaming.join().expect("no panic").expect("renamed");
        assert!(target.is_dir());
    }

    #[test]
    fn regress_no_folder_is_made_anew_that_was_taken_away() {
        let temporary = tempfile::tempdir().expect("a folder");
        let work = WorkFolder::beside(temporary.path()).expect("made");
        let made = work.made().to_owned();
        let taking_away = begun();
        fs::remove_dir_all(work.folder.path()).expect("taken away");
        let making = std::thread::spawn(move || crate::create_folder(&made));
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(names(temporary.path()).is_empty(), "it is left when the process ends");
        drop(taking_away);
        making.join().expect("no panic").expect("made");
    }

    #[cfg(unix)]
    #[test]
    fn links_with_such_a_name_lead_nowhere() {
        let [here, other] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        fs::write(other.path().join("lock"), "").expect("written");
        std::os::unix::fs::symlink(other.path(), here.path().join(".writing-link")).expect("a link");
        std::os::unix::fs::symlink(other.path().join("lock"), here.path().join(".writing-file")).expect("a link");
        remove_leftovers(here.path());
        assert_eq!((names(here.path()).len(), names(other.path()).len()), (2, 1));
    }
}
