//! The dataset format: written and read without loss, bad input refused by line and column, blocks of runs,
//! and real robots' logs.

mod bad_input;
mod blocks;
mod partial;
mod real_data;
mod round_trip;
#[path = "../../../../tests/support/real_data.rs"]
mod support;
