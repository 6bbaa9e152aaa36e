//! Running a sweep: waves of chunks on all cores, the state written down every few seconds, the same result
//! however often it was interrupted.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::plan::{ChunkOutcome, PointSetup, SweepPlan};
use super::result::SweepResult;
use super::spool::Spool;
use super::state::{ChunkIndex, STATE_FILE, Shard, State};
use crate::error::BenchError;

/// Time between two writings of the state: what a kill loses.
const BETWEEN_STATES: Duration = Duration::from_secs(2);

/// Writing the state may take this share of the time at most; of large designs it is written more rarely.
const STATE_SHARE: f64 = 0.05;

/// A wave's length, for which the number of chunks is sought: long against its start and its end, where cores
/// wait, and short for who waits for a kill.
const WAVE: Duration = Duration::from_millis(300);

/// Most chunks of a wave: their results are held together.
const LARGEST_WAVE: usize = 1 << 14;

/// How far a campaign has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Trials done.
    pub done: u64,
    /// Trials that there will be; foretold, where a precision decides.
    pub planned: u64,
}

/// How to run a sweep.
pub struct Campaign<'a> {
    /// Threads; 0 = one a core.
    pub jobs: usize,
    /// Where results and the state go; without a folder nothing is written.
    pub folder: Option<&'a Path>,
    /// Go on from the state in the folder, where there is one.
    pub resume: bool,
    /// This machine's part.
    pub shard: Shard,
    /// Keep every trial's estimates.
    pub rows: bool,
    /// Set by others to stop soon.
    pub stop: &'a AtomicBool,
    /// Is told how far the campaign has come.
    pub progress: &'a dyn Fn(Progress),
}

/// How a campaign ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// With the result of all points.
    Whole(SweepResult),
    /// With a shard, in the folder, for the merge.
    Shard,
    /// Stopped before its end.
    Stopped(Progress),
}

impl SweepPlan {
    /// Runs the whole sweep in memory on `jobs` threads (0 = one a core).
    ///
    /// # Errors
    /// [`BenchError`] when a point cannot be simulated. A method that fails on a trial is counted and is no
    /// error.
    pub fn run(&self, jobs: usize, progress: &dyn Fn(Progress)) -> Result<SweepResult, BenchError> {
        let stop = AtomicBool::new(false);
        let campaign =
            Campaign { jobs, folder: None, resume: false, shard: Shard::WHOLE, rows: false, stop: &stop, progress };
        match self.campaign(&campaign)? {
            Outcome::Whole(result) => Ok(result),
            // Nobody stops it and there is one shard.
            Outcome::Shard | Outcome::Stopped(_) => unreachable!("a whole campaign that nobody stops ends whole"),
        }
    }

    /// Runs a campaign as asked. With a folder the state is there from the first seconds on, until
    /// [`super::write_results`] takes it away once the results stand.
    ///
    /// # Errors
    /// As [`Self::run`]; also when the folder holds another campaign or an unfinished one that is not to be
    /// gone on with, and when it cannot be written.
    pub fn campaign(&self, campaign: &Campaign<'_>) -> Result<Outcome, BenchError> {
        let mut state = State::new(self, campaign.shard, campaign.rows)?;
        let path = campaign.folder.map(|folder| folder.join(STATE_FILE));
        if let Some(path) = path.as_ref().filter(|path| path.exists()) {
            if !campaign.resume {
                return Err(BenchError::Unfinished { path: path.display().to_string() });
            }
            let found = State::read(path)?;
            found.same_campaign_as(&state, path)?;
            if found.shard != state.shard {
                let (what, theirs, ours) = ("shard", found.shard.to_string(), state.shard.to_string());
                return Err(BenchError::OtherSweep { path: path.display().to_string(), what, theirs, ours });
            }
            found.check(self, path)?;
            state = found;
        }
        let mut spool = match campaign.folder.filter(|_| campaign.rows) {
            Some(folder) => Some(Spool::open(folder, state.spooled)?),
            None => None,
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(campaign.jobs)
            .build()
            .map_err(|error| BenchError::Threads { jobs: campaign.jobs, why: error.to_string() })?;
        let (mut wave, mut written, mut between) = (4 * pool.current_num_threads(), Instant::now(), BETWEEN_STATES);
        while !state.is_complete() && !campaign.stop.load(Ordering::Relaxed) {
            let started = Instant::now();
            let chunks = self.next_chunks(&state, wave);
            let done: Vec<ChunkOutcome> = pool.install(|| {
                chunks
                    .par_iter()
                    .map_init(|| None, |setup, place| self.chunk(setup, *place))
                    .collect::<Result<_, BenchError>>()
            })?;
            for (place, outcome) in chunks.iter().zip(done) {
                if let Some(spool) = &mut spool {
                    state.spooled += spool.append(&outcome.outcomes)?;
                }
                self.take(&mut state, *place, outcome);
            }
            self.finish_points(&mut state, &pool)?;
            (campaign.progress)(self.progress(&state));
            let took = started.elapsed();
            wave = next_wave(wave, chunks.len(), took).max(pool.current_num_threads());
            if let Some(path) = path.as_ref().filter(|_| written.elapsed() >= between) {
                let writing = Instant::now();
                spool.as_mut().map_or(Ok(()), Spool::flush)?;
                state.write(path)?;
                written = Instant::now();
                between = BETWEEN_STATES.max((written - writing).div_f64(STATE_SHARE));
            }
        }
        spool.as_mut().map_or(Ok(()), Spool::flush)?;
        if let Some(path) = &path {
            state.write(path)?;
        }
        if !state.is_complete() {
            return Ok(Outcome::Stopped(self.progress(&state)));
        }
        if campaign.shard != Shard::WHOLE {
            return Ok(Outcome::Shard);
        }
        Ok(Outcome::Whole(self.result(state.finished.into_iter().map(|(_, result)| result).collect())))
    }

    pub(super) fn result(&self, points: Vec<super::result::PointResult>) -> SweepResult {
        SweepResult {
            scenario: self.scenario.name.clone(),
            seed: self.seed(),
            trials: self.trials,
            precision: self.precision,
            points,
        }
    }

    /// The next chunks, at most `wave` of them; over several points, unless a precision has to be judged at
    /// each one's end.
    fn next_chunks(&self, state: &State, wave: usize) -> Vec<ChunkIndex> {
        let mut chunks = Vec::with_capacity(wave);
        let mut place = state.next;
        while chunks.len() < wave && place < state.end {
            let open = state.open.iter().find(|(point, _)| *point == place.point);
            let last = open.map_or_else(|| self.first_decision(), |(_, sum)| sum.decision_chunk);
            let last = if place.point == state.end.point { last.min(state.end.chunk) } else { last };
            while chunks.len() < wave && place.chunk < last {
                chunks.push(place);
                place.chunk += 1;
            }
            if self.precision.is_some() {
                break;
            }
            if place.chunk >= self.chunks() {
                place = ChunkIndex { point: place.point + 1, chunk: 0 };
            }
        }
        chunks
    }

    fn chunk(&self, setup: &mut Option<PointSetup>, place: ChunkIndex) -> Result<ChunkOutcome, BenchError> {
        if !setup.as_ref().is_some_and(|setup| setup.is_at(place.point)) {
            *setup = Some(PointSetup::new(self, place.point)?);
        }
        match setup {
            Some(setup) => setup.drive(self, place.chunk),
            None => PointSetup::new(self, place.point)?.drive(self, place.chunk),
        }
    }

    /// Adds the next chunk to the state.
    fn take(&self, state: &mut State, place: ChunkIndex, outcome: ChunkOutcome) {
        let truth = self.truth[place.point];
        let sum = state.sum_of(place, self);
        for of_trial in outcome.outcomes.chunks_exact(self.estimates().max(1)) {
            for (k, (histogram, estimate)) in sum.histograms.iter_mut().zip(of_trial).enumerate() {
                if !estimate.value.is_nan() {
                    let truth = truth[k % truth.len()];
                    histogram.push((estimate.value - truth) / truth);
                }
            }
        }
        sum.chunks.push(outcome.sum);
        state.next.chunk = place.chunk + 1;
        state.next.point = place.point;
        if self.precision.is_none() && state.next.chunk == self.chunks() {
            state.next = ChunkIndex { point: place.point + 1, chunk: 0 };
        }
    }

    /// Turns the sums of points that are done into results.
    fn finish_points(&self, state: &mut State, pool: &rayon::ThreadPool) -> Result<(), BenchError> {
        let ChunkIndex { point, chunk } = state.next;
        if self.precision.is_some()
            && let Some((_, sum)) =
                state.open.iter_mut().find(|(open, sum)| *open == point && sum.decision_chunk == chunk)
        {
            match self.next_decision(point, sum) {
                Some(decision_chunk) => sum.decision_chunk = decision_chunk,
                None => state.next = ChunkIndex { point: point + 1, chunk: 0 },
            }
        }
        let next = state.next.point;
        let (done, open): (Vec<_>, Vec<_>) =
            state.open.drain(..).partition(|(point, sum)| *point < next && sum.chunks.first() == 0);
        state.open = open;
        let results = pool.install(|| {
            done.par_iter()
                .map(|(point, sum)| Ok((*point, self.point_result(*point, sum)?)))
                .collect::<Result<Vec<_>, BenchError>>()
        })?;
        state.finished.extend(results);
        Ok(())
    }

    fn progress(&self, state: &State) -> Progress {
        let open: u64 = state.open.iter().map(|(_, sum)| sum.chunks.next() - sum.chunks.first()).sum();
        let trials = |chunks: u64| chunks * super::plan::TRIALS_PER_CHUNK;
        let finished: u64 = state.finished.iter().map(|(_, result)| result.trials).sum();
        let done = finished + trials(open);
        if self.precision.is_none() {
            let unit = |place: ChunkIndex| place.point as u64 * self.chunks() + place.chunk;
            let planned = trials(unit(state.end) - unit(state.first));
            return Progress { done: done.min(planned), planned };
        }
        // A point to come needs as many as those before it did.
        let under_way = state.open.first().map_or(0, |(_, sum)| sum.decision_chunk);
        let known = state.finished.len() as u64 + u64::from(under_way > 0);
        let so_far = finished + trials(under_way);
        let points = (state.end.point - state.first.point) as u64;
        Progress { done, planned: so_far.checked_div(known).map_or(points, |each| (each * points).max(done)) }
    }
}

/// As many chunks as would have taken a wave's time, at most doubled or halved.
fn next_wave(wave: usize, chunks: usize, took: Duration) -> usize {
    let wanted = chunks as f64 * WAVE.as_secs_f64() / took.as_secs_f64().max(1e-6);
    (wanted as usize).clamp(wave / 2, wave * 2).clamp(1, LARGEST_WAVE)
}
