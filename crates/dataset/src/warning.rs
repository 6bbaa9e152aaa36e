//! What a reader noticed that is no error, but that a user should know.

use std::path::PathBuf;

use kinematics::Side;

/// What was noticed while reading; each is shown as one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
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
    /// A column says less than others of the table or of another one, and was left out.
    #[error("{file}: column {column} was left out, because the dataset also has {used}")]
    RedundantColumn {
        /// The table.
        file: PathBuf,
        /// The column.
        column: &'static str,
        /// The columns that were read.
        used: &'static str,
    },
    /// A length of the robot that is likely in another unit.
    #[error("{file}: {key} = {value_m} is in metres; is it {} m, written in millimetres?", value_m / 1e3)]
    NotMetres {
        /// `dataset.toml`.
        file: PathBuf,
        /// The key.
        key: &'static str,
        /// Its value, metres.
        value_m: f64,
    },
    /// A counter leaves its place for one row.
    #[error(
        "run \"{run}\": the {} tick counter reads {ticks} at {t_s} s, row {row} of the run, and is back in the row after: a spike; take that row out",
        side.name()
    )]
    CounterSpike {
        /// The run's id.
        run: String,
        /// Which wheel.
        side: Side,
        /// Row within the run, from 1.
        row: usize,
        /// The row's time, seconds.
        t_s: f64,
        /// What it reads.
        ticks: i64,
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
