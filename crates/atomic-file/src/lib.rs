//! Results written in one piece: a file or a folder is whole under its name, or it is not there; what a
//! killed process leaves is taken away by the next; and files read up to a limit.

mod leftovers;
pub mod lock;

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

pub use leftovers::{PREFIX, WorkFolder, remove_leftovers};
use tempfile::NamedTempFile;

/// A temporary file beside `path` that holds `bytes` and is to become `path` by `persist`. It has the
/// permissions of any other file of the user.
///
/// # Errors
/// The system's, when the folder of `path` is not there or cannot be written.
pub fn stage(path: &Path, bytes: &[u8]) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = leftovers::locked_file(folder)?;
    file.write_all(bytes)?;
    Ok(file)
}

/// Writes a file in one piece; one that was there before is replaced, or unharmed where this fails.
///
/// # Errors
/// As [`stage`].
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    stage(path, bytes)?.persist(path)?;
    Ok(())
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

/// Makes a folder inside of `out`; a link in its place, which may lead anywhere, is refused.
///
/// # Errors
/// The system's, and [`io::ErrorKind::AlreadyExists`] where there is a link.
pub fn create_inside(out: &Path, folder: &Path) -> io::Result<()> {
    let mut path = out.to_owned();
    std::fs::create_dir_all(&path)?;
    for part in folder {
        path.push(part);
        if path.is_symlink() {
            let why = format!("{} is a link, and results stay inside of {}", path.display(), out.display());
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, why));
        }
        std::fs::create_dir_all(&path)?;
    }
    Ok(())
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
