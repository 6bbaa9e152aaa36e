//! Where the logs of real robots are, for tests of this crate and of `dataset`: they are no part of the
//! repository.

use std::path::{Path, PathBuf};

/// Real logs, or `None` with a word about it; with `YAIR_REQUIRE_DATA=1` they must be there.
#[allow(clippy::print_stdout)] // how a skipped test is seen
pub(crate) fn real_data(test: &str, part: &str) -> Option<PathBuf> {
    let root = std::env::var_os("YAIR_DATA").map_or_else(|| beside_the_checkout().join("shared/data"), PathBuf::from);
    let folder = root.join(part);
    if folder.is_dir() {
        return Some(folder);
    }
    let required = std::env::var("YAIR_REQUIRE_DATA").is_ok_and(|value| value == "1");
    assert!(!required, "{test}: no real data in {} (YAIR_REQUIRE_DATA=1 is set)", folder.display());
    println!("skipped: {test}: no real data (set YAIR_DATA)");
    None
}

/// The folder that holds the checkout; tests of a crate have their manifest two folders further down.
fn beside_the_checkout() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = manifest.parent().filter(|parent| parent.file_name().is_some_and(|name| name == "crates"));
    crates.map_or_else(|| manifest.join(".."), |crates| crates.join("../.."))
}
