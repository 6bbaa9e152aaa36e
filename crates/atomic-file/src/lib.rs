//! Results written in one piece: a file or a folder is whole under its name, or it is not there; what a
//! killed process leaves is taken away by the next; and files read up to a limit.

mod leftovers;
pub mod lock;
mod under_way;

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

pub use leftovers::{PREFIX, StagedFile, WorkFolder, remove_leftovers};
pub use under_way::{UnderWay, remove_all_under_way};

/// A temporary file beside `path` that holds `bytes` and is to become `path` by `persist`. It has the
/// permissions of any other file of the user.
///
/// # Errors
/// The system's, when the folder of `path` is not there or cannot be written.
pub fn stage(path: &Path, bytes: &[u8]) -> io::Result<StagedFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let file = leftovers::locked_file(folder)?;
    file.as_file().write_all(bytes)?;
    Ok(file)
}

/// Writes a file in one piece; one that was there before is replaced, or unharmed where this fails.
///
/// # Errors
/// As [`stage`].
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    stage(path, bytes)?.persist(path)
}

/// Reads a file of at most `max_bytes`.
///
/// # Errors
/// The system's, and [`io::ErrorKind::FileTooLarge`] with the limit in its message.
pub fn read_at_most(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let too_long = || {
        let why = format!("longer than {max_bytes} bytes; is this the right file?");
        io::Error::new(io::ErrorKind::FileTooLarge, why)
    };
    let file = File::open(path)?;
    // Before it costs memory; a pipe has no length.
    if file.metadata()?.len() > max_bytes {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    file.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes { Err(too_long()) } else { Ok(bytes) }
}

/// Makes a folder of results with its parents; a link in its place, which may lead anywhere, is refused.
///
/// # Errors
/// The system's, and [`io::ErrorKind::AlreadyExists`] where there is a link.
pub fn create_folder(folder: &Path) -> io::Result<()> {
    refuse_link(folder)?;
    create_all(folder)
}

/// Makes a folder with its parents; not while this process is being ended, as what is taken away then would
/// be made anew.
///
/// # Errors
/// The system's.
pub fn create_all(folder: &Path) -> io::Result<()> {
    let _begun = under_way::begun();
    std::fs::create_dir_all(folder)
}

/// Makes a folder inside of `out`; no part of its path, and not `out` itself, may be a link.
///
/// # Errors
/// As [`create_folder`].
pub fn create_inside(out: &Path, folder: &Path) -> io::Result<()> {
    let mut path = out.to_owned();
    create_folder(&path)?;
    for part in folder {
        path.push(part);
        create_folder(&path)?;
    }
    Ok(())
}

/// Refuses a link where a folder of results is to be.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] with what the link leads to.
pub fn refuse_link(folder: &Path) -> io::Result<()> {
    // Without a slash at its end, behind which the system follows a link.
    let folder: PathBuf = folder.components().collect();
    match std::fs::read_link(&folder) {
        Ok(target) => {
            let why = format!(
                "the folder is a link to {}, and results are not written through links; name the folder itself",
                target.display()
            );
            Err(io::Error::new(io::ErrorKind::AlreadyExists, why))
        }
        Err(_) => Ok(()),
    }
}

/// Where a file of a folder leads, if it is a link to outside of that folder: input comes from anywhere, and
/// what it does not hold itself is not read in its name.
///
/// # Errors
/// The system's, when the folder is not there.
pub fn link_outside(folder: &Path, file: &Path) -> io::Result<Option<PathBuf>> {
    if !file.is_symlink() {
        return Ok(None);
    }
    let folder = folder.canonicalize()?;
    Ok(file.canonicalize().ok().filter(|target| !target.starts_with(&folder)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_the_limit_is_read_and_a_longer_one_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("state.json");
        write_whole(&path, b"12345").expect("written");
        assert_eq!(read_at_most(&path, 5).expect("read"), b"12345");
        let refused = read_at_most(&path, 4).expect_err("too long");
        assert!(refused.to_string().contains("longer than 4 bytes"), "{refused}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_among_results_is_not_followed() {
        let [out, other] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
        std::os::unix::fs::symlink(other.path(), out.path().join("sessions")).expect("a link");
        let refused = create_inside(out.path(), Path::new("sessions/deep")).expect_err("a link");
        assert!(refused.to_string().contains("is a link"), "{refused}");
        for link in ["sessions", "sessions/", "sessions/."] {
            let refused = create_folder(&out.path().join(link)).expect_err("a link");
            assert!(refused.to_string().contains(&other.path().display().to_string()), "{refused}");
        }
        assert_eq!(other.path().read_dir().expect("readable").count(), 0);
        create_inside(out.path(), Path::new("plain/deep")).expect("made");
        // A file that is a link is replaced, not written through.
        let (link, target) = (out.path().join("a.json"), other.path().join("target"));
        std::os::unix::fs::symlink(&target, &link).expect("a link");
        write_whole(&link, b"new").expect("written");
        assert!(!target.exists() && !link.is_symlink());
    }

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("result.json");
        write_whole(&path, b"old and long").expect("written");
        write_whole(&path, b"new").expect("replaced");
        drop(stage(&path, b"never finished").expect("staged"));
        assert_eq!(std::fs::read(&path).expect("there"), b"new");
        assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 1);
        assert!(write_whole(&folder.path().join("no/such/folder"), b"").is_err());
    }
}
