//! Parts of the blind benchmark as files: what `yair challenge --shard I/N --out DIR` leaves, and what
//! `yair challenge --merge DIR...` puts together.
//!
//! A case is a function of seed, scope and number, so that a part is the outcomes of a range of numbers, with
//! every digit. Measures are taken over all cases at the end, as one machine takes them.

use std::path::{Path, PathBuf};

use bench::Shard;
use blind_benchmark::{CaseOutcome, Scope, are_outcomes_of};
use serde::{Deserialize, Serialize};

use crate::terminal::Failure;

/// The part's file in its folder.
const FILE: &str = "challenge.shard.json";

/// Longest part, bytes: 10⁵ cases of some kilobytes each.
const MAX_SHARD_BYTES: u64 = 1 << 30;

/// What makes two campaigns the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChallengeCampaign {
    /// The program's version.
    program: String,
    /// Seed of every draw.
    pub(crate) seed: u64,
    /// Cases of all parts together.
    pub(crate) cases: u64,
    /// Which of them are driven.
    pub(crate) scope: Scope,
}

/// One part of a campaign.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ChallengeShard {
    campaign: ChallengeCampaign,
    /// I/N.
    shard: String,
    outcomes: Vec<CaseOutcome>,
}

impl ChallengeCampaign {
    pub(crate) fn new(seed: u64, cases: u64, scope: Scope) -> Self {
        Self { program: env!("CARGO_PKG_VERSION").to_owned(), seed, cases, scope }
    }
}

impl ChallengeShard {
    pub(crate) fn new(campaign: ChallengeCampaign, shard: Shard, outcomes: Vec<CaseOutcome>) -> Self {
        Self { campaign, shard: shard.to_string(), outcomes }
    }

    /// Writes the part into its folder, in one piece.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), Failure> {
        let path = folder.join(FILE);
        let bytes = serde_json::to_vec(self)?;
        Ok(atomic_file::write_whole(&path, &bytes).map_err(|error| format!("{}: {error}", path.display()))?)
    }

    fn read(folder: &Path) -> Result<Self, Failure> {
        let path = folder.join(FILE);
        if !path.is_file() {
            let why = "not the folder of a part (yair challenge --shard I/N --out DIR)";
            return Err(format!("{}: no {FILE} in it: {why}", folder.display()).into());
        }
        let bytes = atomic_file::read_at_most(&path, MAX_SHARD_BYTES)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(serde_json::from_slice(&bytes)
            .map_err(|error| format!("{}: not a part of a blind benchmark: {error}", path.display()))?)
    }
}

/// The outcomes of a whole campaign from the folders of its parts, in whatever order they are given.
pub(crate) fn merged(folders: &[PathBuf]) -> Result<(ChallengeCampaign, Vec<CaseOutcome>), Failure> {
    let mut parts = Vec::with_capacity(folders.len());
    for folder in folders {
        let part = ChallengeShard::read(folder)?;
        let shard: Shard = part.shard.parse().map_err(|why| format!("{}: shard: {why}", folder.display()))?;
        if !are_outcomes_of(&part.outcomes, shard.share(part.campaign.cases), part.campaign.scope) {
            return Err(format!("{}: its cases are not those of part {shard}", folder.display()).into());
        }
        parts.push((shard.of_all(), folder, part));
    }
    parts.sort_by_key(|(numbers, ..)| *numbers);
    let Some((_, first_folder, first)) = parts.first() else { return Err("merge: no part is given".into()) };
    let campaign = ChallengeCampaign::new(first.campaign.seed, first.campaign.cases, first.campaign.scope);
    let first_folder = first_folder.display().to_string();
    let mut outcomes = Vec::new();
    for (before, ((number, of), folder, part)) in (0_u32..).zip(&mut parts) {
        let complain = |why: String| Err(format!("{}: {why}", folder.display()).into());
        if part.campaign != campaign {
            let (theirs, ours) = (format!("{:?}", part.campaign), format!("{campaign:?}"));
            return complain(format!(
                "a part of {theirs}, where that in {first_folder}, by this program, is of {ours}"
            ));
        }
        if *number <= before {
            return complain(format!("part {number}/{of} is given twice"));
        }
        if *number > before + 1 {
            return complain(format!("part {}/{of} is missing", before + 1));
        }
        outcomes.append(&mut part.outcomes);
    }
    // Parts are sorted by number and then by how many there are.
    if let Some(((number, of), ..)) = parts.last().filter(|((number, of), ..)| number != of) {
        return Err(format!("{first_folder}: the parts after {number}/{of} are missing").into());
    }
    if let Some(((number, of), folder, _)) = parts.iter().find(|((_, of), ..)| *of as usize != folders.len()) {
        let count = folders.len();
        return Err(format!("{}: it is part {number}/{of}, and {count} are given", folder.display()).into());
    }
    Ok((campaign, outcomes))
}
