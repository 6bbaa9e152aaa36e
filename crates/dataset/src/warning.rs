//! What a reader noticed that is no error, but that a user should know.

use std::path::PathBuf;

use kinematics::Side;

/// What was noticed while reading; each is shown as one line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// A column that no one here knows was left out.
    #[error("{file}: column \"{column}\" is not known and was left out; the columns known are: {known}")]
    UnknownColumn {
        /// The table.
        file: PathBuf,
        /// The column, clipped.
        column: String,
        /// Known columns of this table.
        known: String,
    },
    /// A column says less than others of the same table, and was left out.
    #[error("{file}: column {column} was left out, because the table also has {used}")]
    RedundantColumn {
        /// The table.
        file: PathBuf,
        /// The column.
        column: &'static str,
        /// The columns that were read.
        used: &'static str,
    },
    /// A tick counter jumps as if it were of finite width.
    #[error(
        "run \"{run}\": the {} tick counter jumps as one of {bits} bits does; say counter_bits = {bits} under [robot] in dataset.toml to unwrap it",
        side.name()
    )]
    CounterWraps {
        /// The run's id.
        run: String,
        /// Which wheel.
        side: Side,
        /// Width that the jumps suggest, bits.
        bits: u8,
    },
}
