//! Shards put together: the result is that of one machine, to the bit.

use std::path::{Path, PathBuf};

use scenario::Scenario;

use super::plan::SweepPlan;
use super::result::{PointResult, SweepResult};
use super::spool::spool_in;
use super::state::{ChunkIndex, STATE_FILE, State};
use super::tally::PointSum;
use crate::error::BenchError;

/// A sweep put together from shards.
pub struct Merged {
    /// Its plan, from the scenario that the shards carry.
    pub plan: SweepPlan,
    /// Its result.
    pub result: SweepResult,
    /// The shards' rows in order; empty when none were kept.
    pub(super) spools: Vec<PathBuf>,
}

/// Puts the shards in these folders together, in whatever order they are given.
///
/// # Errors
/// [`BenchError`] that names the folder: no state in it, not finished, of another sweep, given twice, or
/// missing between two others.
pub fn merge(folders: &[PathBuf]) -> Result<Merged, BenchError> {
    let mut shards = Vec::with_capacity(folders.len());
    for folder in folders {
        let path = folder.join(STATE_FILE);
        if !path.exists() {
            let why = format!("no {STATE_FILE} in it: not the folder of a shard (yair sweep --shard I/N --out DIR)");
            return Err(BenchError::Shards { path: folder.display().to_string(), why });
        }
        shards.push((folder, State::read(&path)?));
    }
    shards.sort_by_key(|(_, state)| (state.first, state.end));
    let complain = |folder: &Path, why: String| BenchError::Shards { path: folder.display().to_string(), why };
    let Some((first_folder, first)) = shards.first() else {
        return Err(complain(Path::new("merge"), "no shard is given".to_owned()));
    };
    let scenario = Scenario::parse(first.scenario_toml(), &first_folder.display().to_string())?;
    let plan = SweepPlan::new(&scenario, first.options())?;
    let whole = State::new(&plan, super::state::Shard::WHOLE, first.rows())?;

    let mut reached = ChunkIndex { point: 0, chunk: 0 };
    for (folder, state) in &shards {
        let path = folder.join(STATE_FILE);
        state.same_campaign_as(&whole, &path)?;
        state.check(&plan, &path)?;
        if !state.is_complete() {
            return Err(complain(folder, format!("shard {} is not finished; go on with --resume", state.shard)));
        }
        if state.first < reached {
            return Err(complain(folder, format!("shard {} holds trials that another one holds too", state.shard)));
        }
        if state.first > reached {
            return Err(complain(folder, format!("a shard before {} is missing", state.shard)));
        }
        reached = state.end;
    }
    if let Some((folder, last)) = shards.last().filter(|_| reached != whole.end) {
        return Err(complain(folder, format!("the shards after {} are missing", last.shard)));
    }

    let spools = if whole.rows() { shards.iter().map(|(folder, _)| spool_in(folder)).collect() } else { Vec::new() };
    let mut points: Vec<PointResult> = Vec::with_capacity(plan.points.len());
    let mut open: Option<(usize, PointSum)> = None;
    for (folder, state) in shards {
        // In a shard the parts of points stand at its ends: what ends a point of the one before comes first.
        let mut parts = state.open;
        parts.sort_by_key(|(point, _)| *point);
        let mut finished = state.finished.into_iter().peekable();
        for (point, part) in parts {
            while let Some((_, result)) = finished.next_if(|(number, _)| *number < point) {
                points.push(result);
            }
            let mut sum = match open.take() {
                Some((number, sum)) if number == point => sum,
                _ => PointSum::starting_at(0, plan.estimates(), plan.chunks()),
            };
            if !sum.join(part) {
                return Err(complain(folder, "its sums do not follow those of the shard before".to_owned()));
            }
            if sum.chunks.next() == plan.chunks() {
                points.push(plan.point_result(point, &sum)?);
            } else {
                open = Some((point, sum));
            }
        }
        points.extend(finished.map(|(_, result)| result));
    }
    let result = plan.result(points);
    Ok(Merged { plan, result, spools })
}
