//! Numbers against those of a file of `tests/golden/`, which YAIR_UPDATE_DOCS=1 writes anew.

#[path = "../../estimation/src/tests/golden_numbers.rs"]
mod golden_numbers;

pub(crate) use golden_numbers::assert_unmoved;
