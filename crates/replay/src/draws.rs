//! The logs that are drawn by their seeds.

use std::path::Path;

use plain_robot::{KINDS, Kind};
use replay::{blind_name, kind_name, mixed_name, write_blind_case, write_kind, write_mixed};

use crate::arguments::Arguments;

/// A log that is drawn.
pub(crate) enum Draw {
    Blind { seed: u64, number: u64 },
    OfKind { kind: Kind, seed: u64 },
    Mixed { seed: u64 },
}

/// Robots of one seed are apart from those of the next.
const APART: u64 = 100_000;

/// All logs that the arguments ask for.
pub(crate) fn draws(arguments: &Arguments) -> Vec<Draw> {
    let of_seed = |seed: &u64| {
        let seed = *seed;
        let blind = (0..arguments.cases).map(move |number| Draw::Blind { seed, number });
        // Each kind has robots of its own, so that one robot's errors are not those of all kinds.
        let kinds = KINDS.iter().zip(0..).flat_map(move |(kind, place)| {
            (0..arguments.robots)
                .map(move |robot| Draw::OfKind { kind: *kind, seed: APART * seed + 100 * place + robot })
        });
        let mixed = (0..arguments.mixed).map(move |number| Draw::Mixed { seed: APART * seed + number });
        blind.chain(kinds).chain(mixed)
    };
    arguments.seeds.iter().flat_map(of_seed).collect()
}

impl Draw {
    /// The log's folder below the corpus.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Blind { seed, number } => blind_name(*seed, *number),
            Self::OfKind { kind, seed } => kind_name(*kind, *seed),
            Self::Mixed { seed } => mixed_name(*seed),
        }
    }

    /// Writes the log below a corpus, unless it stands there. Where the tool `knows_wheels`, rows say what
    /// the wheels did and when; a mixed log's fault is often in its rows, which stay as they are.
    pub(crate) fn write(&self, corpus: &Path, knows_wheels: bool) -> Result<(), String> {
        match self {
            Self::Blind { seed, number } => write_blind_case(corpus, *seed, *number, knows_wheels),
            Self::OfKind { kind, seed } => write_kind(corpus, *kind, *seed, seed / APART, knows_wheels),
            Self::Mixed { seed } => write_mixed(corpus, *seed, seed / APART),
        }
    }
}
