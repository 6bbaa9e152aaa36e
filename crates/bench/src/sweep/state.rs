//! How far a campaign has come, as a file: what a killed one goes on from, and what a shard hands to the
//! merge.
//!
//! The file is written in one piece beside the results and holds every number to its last bit, so that going
//! on ends where an undisturbed campaign would have. Points that are done stand in it as results; points of
//! which this shard has a part only, as sums.

use std::ops::Range;
use std::path::Path;

use dataset::{Share, checked};
use serde::{Deserialize, Serialize};

use super::plan::SweepPlan;
use super::result::{EstimatorResult, PointResult};
use super::tally::PointSum;
use crate::error::BenchError;

/// The state's file in the folder of results.
pub(super) const STATE_FILE: &str = "sweep.state.json";

/// Longest state, bytes: that of a campaign of some 10⁵ points.
const MAX_STATE_BYTES: u64 = 1 << 30;

/// Raised whenever the meaning of the file or the numbers in it change.
const FORMAT: u32 = 1;

/// Which part of a campaign is this machine's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    number: u32,
    of: u32,
}

impl Shard {
    /// The whole.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Part `number` of `of`, counted from 1.
    #[must_use]
    pub const fn new(number: u32, of: u32) -> Option<Self> {
        if number >= 1 && number <= of { Some(Self { number, of }) } else { None }
    }

    /// The shard's share of `units` that are counted from 0; the shares of all shards follow each other.
    #[must_use]
    pub const fn share(self, units: u64) -> Range<u64> {
        let (number, of, units) = (self.number as u128, self.of as u128, units as u128);
        (units * (number - 1) / of) as u64..(units * number / of) as u64
    }

    /// Its number, from 1, and how many there are.
    #[must_use]
    pub const fn of_all(self) -> (u32, u32) {
        (self.number, self.of)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (number, of) = text.split_once('/')?;
            Self::new(number.parse().ok()?, of.parse().ok()?)
        };
        parse().ok_or_else(|| "expected I/N with 1 <= I <= N, as in 2/8".to_owned())
    }
}

/// A place in a campaign: chunk `chunk` of point `point`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct ChunkIndex {
    pub(super) point: usize,
    pub(super) chunk: u64,
}

/// What makes two campaigns the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Identity {
    format: u32,
    program: String,
    seed: u64,
    trials: u64,
    #[serde(default, deserialize_with = "checked::<Option<Share>, _>")]
    precision: Option<f64>,
    methods: Vec<String>,
    rows: bool,
    /// The scenario as TOML.
    scenario: String,
}

/// How far a campaign, or a shard of it, has come.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    campaign: Identity,
    pub(super) shard: Shard,
    pub(super) first: ChunkIndex,
    pub(super) end: ChunkIndex,
    pub(super) next: ChunkIndex,
    /// Points that are done, by their numbers.
    pub(super) finished: Vec<(usize, PointResult)>,
    /// Points of which this state has a part.
    pub(super) open: Vec<(usize, PointSum)>,
    /// Bytes of the spool of rows that belong to what is done.
    pub(super) spooled: u64,
}

impl Identity {
    fn of(plan: &SweepPlan, rows: bool) -> Result<Self, BenchError> {
        Ok(Self {
            format: FORMAT,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            seed: plan.seed(),
            trials: plan.trials,
            precision: plan.precision,
            methods: plan.methods.iter().map(|method| method.name().to_owned()).collect(),
            rows,
            scenario: plan.scenario.to_toml()?,
        })
    }

    /// The first difference to another campaign: what, there, here.
    fn difference(&self, ours: &Self) -> Option<(&'static str, String, String)> {
        let lines = |a: &Self, b: &Self| {
            let line = a.scenario.lines().zip(b.scenario.lines()).find(|(a, b)| a != b).map(|(a, _)| a);
            format!("\"{}\"", line.unwrap_or("longer"))
        };
        let precision = |of: &Self| of.precision.map_or_else(|| "none".to_owned(), |precision| precision.to_string());
        let rows = |of: &Self| if of.rows { "kept" } else { "not kept" }.to_owned();
        let all = [
            ("format", self.format.to_string(), ours.format.to_string()),
            ("program version", self.program.clone(), ours.program.clone()),
            ("seed", self.seed.to_string(), ours.seed.to_string()),
            ("number of trials", self.trials.to_string(), ours.trials.to_string()),
            ("precision", precision(self), precision(ours)),
            ("list of methods", self.methods.join(", "), ours.methods.join(", ")),
            ("rows' place", rows(self), rows(ours)),
            ("scenario", lines(self, ours), lines(ours, self)),
        ];
        if self == ours {
            return None;
        }
        all.into_iter().find(|(_, theirs, ours)| theirs != ours)
    }
}

impl State {
    /// The beginning of a shard.
    pub(super) fn new(plan: &SweepPlan, shard: Shard, rows: bool) -> Result<Self, BenchError> {
        let points = plan.points.len();
        // A point that stops by itself cannot be cut.
        let chunks = if plan.precision.is_some() { 1 } else { plan.chunks() };
        let units = points as u64 * chunks;
        let place = |unit: u64| ChunkIndex { point: (unit / chunks) as usize, chunk: unit % chunks };
        let share = shard.share(units);
        let (first, end) = (place(share.start), place(share.end));
        Ok(Self {
            campaign: Identity::of(plan, rows)?,
            shard,
            first,
            end,
            next: first,
            finished: Vec::new(),
            open: Vec::new(),
            spooled: 0,
        })
    }

    /// Reads a state.
    pub(super) fn read(path: &Path) -> Result<Self, BenchError> {
        let not_a_state = |why: String| BenchError::NotAState { path: path.display().to_string(), why };
        let bytes = atomic_file::read_at_most(path, MAX_STATE_BYTES).map_err(|error| not_a_state(error.to_string()))?;
        serde_json::from_slice(&bytes).map_err(|error| not_a_state(error.to_string()))
    }

    /// Refuses a state that this plan cannot have come to; it is of its campaign.
    pub(super) fn check(&self, plan: &SweepPlan, path: &Path) -> Result<(), BenchError> {
        self.why_not_of(plan)
            .map_or(Ok(()), |why| Err(BenchError::NotAState { path: path.display().to_string(), why: why.to_owned() }))
    }

    fn why_not_of(&self, plan: &SweepPlan) -> Option<&'static str> {
        let shard = Shard::new(self.shard.number, self.shard.of);
        let Some(begun) = shard.and_then(|shard| Self::new(plan, shard, self.rows()).ok()) else {
            return Some("its shard does not exist");
        };
        let Self { first, next, end, .. } = *self;
        if (first, end) != (begun.first, begun.end) || first > next || next > end || next.chunk > plan.chunks() {
            return Some("its places are not those of its shard");
        }
        // Every point up to the place is done, or stands there in part.
        let is_begun = next.chunk > if next.point == first.point { first.chunk } else { 0 };
        let finished = self.finished.iter().map(|(point, _)| *point);
        let mut points: Vec<usize> = finished.chain(self.open.iter().map(|(point, _)| *point)).collect();
        points.sort_unstable();
        if !points.into_iter().eq(first.point..next.point + usize::from(is_begun)) {
            return Some("its points are not those before its place");
        }
        let is_result = |result: &PointResult| {
            let is_of = |of: &EstimatorResult| of.failures <= result.trials;
            result.trials <= plan.trials
                && result.estimators.len() == plan.estimates()
                && result.estimators.iter().all(is_of)
        };
        let is_part = |(point, sum): &(usize, PointSum)| {
            let from = if *point == first.point { first.chunk } else { 0 };
            let to = if *point == next.point { next.chunk } else { plan.chunks() };
            (sum.chunks.first(), sum.chunks.next()) == (from, to)
                && sum.is_of(plan.estimates(), plan.methods.len(), plan.chunks(), |chunk| plan.trials_before(chunk))
        };
        if !self.finished.iter().all(|(_, result)| is_result(result)) || !self.open.iter().all(is_part) {
            return Some("its sums are of no such trials");
        }
        None
    }

    /// Writes the state in one piece: aside under one name, which the next writing takes again when a kill
    /// left it behind, and then into its place.
    pub(super) fn write(&self, path: &Path) -> Result<(), BenchError> {
        let failed = |why: String| BenchError::Write { path: path.display().to_string(), why };
        let bytes = serde_json::to_vec(self).map_err(|error| failed(error.to_string()))?;
        let aside = path.with_extension("part");
        // A link in its place is not written through.
        let write = || {
            if aside.is_symlink() {
                std::fs::remove_file(&aside)?;
            }
            std::fs::write(&aside, bytes)?;
            std::fs::rename(&aside, path)
        };
        write().map_err(|error| failed(error.to_string()))
    }

    /// Refuses a state of another campaign than `ours`.
    pub(super) fn same_campaign_as(&self, ours: &Self, path: &Path) -> Result<(), BenchError> {
        match self.campaign.difference(&ours.campaign) {
            None => Ok(()),
            Some((what, theirs, ours)) => {
                Err(BenchError::OtherSweep { path: path.display().to_string(), what, theirs, ours })
            }
        }
    }

    /// Is all of the shard done?
    pub(super) fn is_complete(&self) -> bool {
        self.next == self.end
    }

    /// The campaign's scenario, seed included, and what else makes its plan.
    pub(super) fn scenario_toml(&self) -> &str {
        &self.campaign.scenario
    }

    pub(super) const fn options(&self) -> super::plan::SweepOptions {
        super::plan::SweepOptions {
            trials: Some(self.campaign.trials),
            seed: Some(self.campaign.seed),
            precision: self.campaign.precision,
        }
    }

    /// Are rows kept?
    pub(super) const fn rows(&self) -> bool {
        self.campaign.rows
    }

    /// The sum of the point that is under way, a new one where there is none.
    pub(super) fn sum_of(&mut self, place: ChunkIndex, plan: &SweepPlan) -> &mut PointSum {
        let known = self.open.iter().position(|(point, _)| *point == place.point);
        let at = known.unwrap_or_else(|| {
            let sum = PointSum::starting_at(place.chunk, plan.estimates(), plan.first_decision());
            self.open.push((place.point, sum));
            self.open.len() - 1
        });
        &mut self.open[at].1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_read_and_cover_everything_once() {
        for of in 1..12_u32 {
            let shards: Vec<Shard> = (1..=of).map(|number| Shard::new(number, of).expect("within")).collect();
            assert_eq!(shards[0].share(1000).start, 0);
            assert_eq!(shards.last().expect("one").share(1000).end, 1000);
            assert!(shards.windows(2).all(|pair| pair[0].share(1000).end == pair[1].share(1000).start));
        }
        assert_eq!("2/8".parse(), Ok(Shard { number: 2, of: 8 }));
        for wrong in ["0/8", "9/8", "2", "2/", "a/b", "1/0", "-1/3"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
