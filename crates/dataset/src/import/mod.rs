//! Other people's logs: one file a format, and this table of contents.
//!
//! An importer gives [`Dataset`](crate::Dataset)s and changes nothing that was measured: units and signs are
//! brought into the format's, counts are summed, and that is all. [`csv`] is for files of no format: it has
//! to be told what no file says, and so it is none of [`IMPORTERS`].

mod censi;
pub mod csv;
mod optiodom;

use std::path::Path;

use crate::error::DatasetError;
pub use crate::imported::{Imported, Source};

/// A format that can be imported.
#[derive(Debug, Clone, Copy)]
pub struct Importer {
    /// The format's name on the command line.
    pub name: &'static str,
    /// One line: what it is, and what the source has to be.
    pub about: &'static str,
    /// Finds all datasets of a source, in an order that does not depend on the machine.
    ///
    /// # Errors
    /// [`DatasetError`] of the first fault.
    pub open: fn(&Path) -> Result<Vec<Source>, DatasetError>,
}

impl Importer {
    /// Reads all datasets of a source.
    ///
    /// # Errors
    /// [`DatasetError`] of the first fault; nothing is handed out then.
    pub fn read(&self, source: &Path) -> Result<Vec<Imported>, DatasetError> {
        (self.open)(source)?.into_iter().map(Source::read).collect()
    }
}

/// All formats that can be imported; a new one is its file and its line here.
pub const IMPORTERS: &[Importer] = &[
    Importer {
        name: "censi",
        about: "Khepera III with a laser (Censi et al., github.com/AndreaCensi/calibration): one .tuple file",
        open: censi::open,
    },
    Importer {
        name: "optiodom",
        about: "OptiTrack sessions (Sousa et al., github.com/sousarbarb/optiodom): a session's folder, or one that holds several",
        open: optiodom::open,
    },
];

/// The importer of a given name.
#[must_use]
pub fn importer(name: &str) -> Option<&'static Importer> {
    IMPORTERS.iter().find(|importer| importer.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_contents_lists_the_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/import");
        let mut files: Vec<_> = folder
            .read_dir()
            .expect("this folder")
            .map(|entry| entry.expect("an entry").path().file_stem().expect("a name").to_string_lossy().into_owned())
            .filter(|stem| stem != "mod" && stem != "csv")
            .collect();
        files.sort();
        let names: Vec<_> = IMPORTERS.iter().map(|importer| importer.name).collect();
        assert_eq!(names, files);
        assert!(IMPORTERS.iter().all(|entry| importer(entry.name).is_some_and(|found| found.name == entry.name)));
        assert!(importer("matlab").is_none());
    }
}
