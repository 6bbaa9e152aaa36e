//! `interval_error`: the log's stamps are irregular, and the irregularity is not true.
//!
//! Model: a row that is due at t is stamped t + η with η uniform, and read at t + (1 − σ) η: a share σ of the
//! stamps' irregularity is false. A negative share is a motion that the row's length makes too long, beside a
//! displacement that is measured from row to row: speeds that were logged and multiplied by the length, or
//! counts that are read when the row is stamped beside a displacement of the usual length. At −1 nothing of
//! the irregularity is in what the instrument measured. Beside poses of a clock of their own there is none:
//! speeds lead from instant to instant whatever the rows' stamps.
//! Signature: an interval whose length departs from the usual one by ξ is off by σξ(v, 0, ω).
//! Observability: a moving robot and an irregular log; measurements between the rows blur it. In a log with
//! gaps, rows that are longer by far more than the others differ are held to be so in truth.
//! Alias: wheel noise, but for the slope against ξ.
//! Reference: stamps given on receipt, by a scheduler that is late, of readings that a timer takes;
//! milliseconds.

use dataset::{Dataset, Timestamps, WheelLog, median};
use kinematics::Pose;
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, HostRobot, Needs, ParameterValue};
use crate::description::{Description, Excitation, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::{Code, OnBoard};
use crate::settings::INTERVALS;
use crate::stream::Stream;

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::State {
    of: "the speeds in the interval before, the mean period of the stamps, and how late the last one was",
    lag: "a fit knows the beat from all rows; on board it is the mean period so far, less a mean over the last 20 intervals or so, which leaves a sixth of the irregularity as noise, and takes slow drift of the stamps for the clock's",
    code: Code::of(
        "\
left_change_m += share * (left_end_m_s * late_end_s - left_start_m_s * late_start_s);
right_change_m += share * (right_end_m_s * late_end_s - right_start_m_s * late_start_s);",
    ),
};

/// Irregular stamps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntervalError {
    /// Share of the irregularity that is false (σ), 0 to 1; to −1 where displacements are measured row by
    /// row.
    pub share: f64,
    /// Every stamp is uniform within ± this of its due time, seconds.
    pub jitter_s: f64,
}

impl IntervalError {
    /// The irregularity of a fitted effect, seconds: data show the share that is false, and their own
    /// irregularity.
    pub(crate) const TYPICAL_JITTER_S: f64 = 0.005;
}

impl PhysicalEffect for IntervalError {
    fn check(&self) -> Result<(), EffectError> {
        let id = "interval_error";
        EffectError::unless((-1.0..=1.0).contains(&self.share), id, "share", self.share, "from -1 to 1")?;
        EffectError::unless_negative(id, [("jitter_s", self.jitter_s)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::Meaning,
            excitation: Excitation::Conditions("log at intervals that differ"),
            restamped: Some(restamped),
            shown_by_counts: Some(share_by_counts),
            benchmark: Benchmark {
                needs: Needs { jitter: true, ..Needs::NONE },
                // A share of one is all there is.
                max_scale: 1.0,
                ..Benchmark::of_mean_at(|_, robot, _| vec![("jitter_s", robot.jitter_s)])
            },
            on_board: ON_BOARD,
            ..Description::of("the logged intervals are not the true ones")
        }
    }

    /// A share that was found a little beyond all of it is all of it.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let share = value_of(values, "share").filter(|share| share.abs() <= INTERVALS.max_found_share)?;
        Some(Self {
            share: share.clamp(-1.0, 1.0),
            jitter_s: value_of(values, "jitter_s").unwrap_or(Self::TYPICAL_JITTER_S),
        })
    }

    /// Counts of a robot beside an instrument with a clock of its own are read before their stamps, not
    /// after.
    fn at_scale(values: &[ParameterValue], _: f64, _: &HostRobot) -> Option<Self> {
        Self::from_estimates(values).filter(|effect| effect.share >= 0.0)
    }

    fn needs_row_lengths(&self) -> bool {
        self.share < 0.0
    }

    fn harmless(robot: &HostRobot) -> Option<Self> {
        (robot.jitter_s > 0.0).then_some(Self { share: 0.0, jitter_s: robot.jitter_s })
    }
}

/// The records of counts or angles whose stamps are as late as the readings were. `None` where the share is
/// not positive, or no run has a beat.
fn restamped(dataset: &Dataset, share: f64, sigma: f64) -> Option<Dataset> {
    let mut records = dataset.clone();
    let mut has_beat = false;
    for run in &mut records.runs {
        if matches!(run.odometry.wheels, WheelLog::Twist { .. }) || !run.info.continuous {
            continue;
        }
        if let Some((read_s, says)) = read_times(&run.odometry.t_s, share, sigma) {
            run.odometry.t_s = read_s.into();
            run.odometry.retain_rows(&says);
            has_beat = true;
        }
    }
    has_beat.then_some(records)
}

/// When rows were read that have these stamps, and which rows say when. A row of a tick was read nearer to
/// the beat by the false share; one that came by itself has no beat to say when but its stamp. Where stamps
/// are later than a tick can be told by, none of several rows of one tick says when.
fn read_times(stamps_s: &Timestamps, share: f64, sigma: f64) -> Option<(Vec<f64>, Vec<bool>)> {
    if share <= 0.0 {
        return None;
    }
    let share = if (share - 1.0).abs() <= INTERVALS.whole_share_sigmas * sigma { 1.0 } else { share.min(1.0) };
    let period = stamps_s.sampling_period()?;
    let is_certain = period.is_certain();
    let mut says: Vec<bool> = (0..stamps_s.len()).map(|row| is_certain || period.is_alone(row)).collect();
    // The ends of a run stay: what was measured there is compared with them.
    let last = says.len() - 1;
    (says[0], says[last]) = (true, true);
    // Rows keep their order.
    let least_s = INTERVALS.min_gap * period.period_s;
    let mut before_s = f64::NEG_INFINITY;
    let read = |(stamp_s, late_s): (&f64, &f64)| {
        before_s = f64::max(before_s + least_s, stamp_s - share * late_s);
        before_s
    };
    Some((stamps_s.iter().zip(&period.late_s).map(read).collect(), says))
}

/// The share by what is counted in rows that hold up each other: a row that comes on the heels of another has
/// counted a whole beat if it was read on the beat, and next to nothing if it was read when it was stamped.
fn share_by_counts(datasets: &[Dataset]) -> Option<(f64, f64)> {
    let runs = datasets.iter().flat_map(|dataset| &dataset.runs).filter(|run| run.info.continuous);
    let mut rows: Vec<(f64, f64)> = Vec::new();
    for run in runs {
        let stamps_s = &run.odometry.t_s;
        let Some(period) = stamps_s.sampling_period().filter(|period| period.is_bunched) else { continue };
        let read_s: Vec<f64> = stamps_s.iter().zip(&period.late_s).map(|(stamp_s, late_s)| stamp_s - late_s).collect();
        let columns = match &run.odometry.wheels {
            WheelLog::Ticks(ticks) => ticks.as_ref().map(|column| column.iter().map(|count| *count as f64).collect()),
            WheelLog::Angles(angles) => angles.clone(),
            WheelLog::Speeds(_) | WheelLog::Twist { .. } => continue,
        };
        for column in [&columns.left, &columns.right] {
            rows.extend(counted_rows(stamps_s, &read_s, column, period.period_s));
        }
    }
    let (xx, xy) = rows.iter().fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + x * x, xy + x * y));
    let share = xy / xx;
    let left = rows.iter().map(|(x, y)| (y - share * x).powi(2)).sum::<f64>() / rows.len() as f64;
    let sigma = (left / xx).sqrt();
    (share.is_finite() && sigma.is_finite()).then(|| (share, sigma.max(INTERVALS.min_share_sigma)))
}

/// For each row, by how much its count on the beat would exceed its count at its stamp, and by how much the
/// recorded count does; in counts or radians.
fn counted_rows<'r>(
    stamps_s: &'r [f64],
    read_s: &'r [f64],
    counts: &'r [f64],
    period_s: f64,
) -> impl Iterator<Item = (f64, f64)> + 'r {
    let late_s2 = stamps_s.iter().zip(read_s).map(|(stamp_s, read_s)| (stamp_s - read_s).powi(2)).sum::<f64>();
    let late = (late_s2 / stamps_s.len() as f64).sqrt() / period_s;
    let extent = INTERVALS.rate_rows.max((4.0 * late) as usize);
    let usual = median(counts.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    let most = usual.map_or(0.0, |usual| INTERVALS.max_count_ratio * usual);
    (extent + 1..stamps_s.len().saturating_sub(extent)).filter_map(move |row| {
        let (from, to) = (row - 1 - extent, row + extent);
        let rate = (counts[to] - counts[from]) / (read_s[to] - read_s[from]);
        let counted = counts[row] - counts[row - 1];
        let (on_beat, as_stamped) = (read_s[row] - read_s[row - 1], stamps_s[row] - stamps_s[row - 1]);
        let is_sound = counted.abs() <= most && rate.is_finite();
        is_sound.then_some((rate * (on_beat - as_stamped), counted - rate * as_stamped))
    })
}

struct State {
    effect: IntervalError,
    stream: Option<Stream>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, clock: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        self.stream = Some(stream);
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        let Some(stream) = &mut self.stream else { return };
        let late_s = stream.uniform_about_zero(self.effect.jitter_s);
        sample.stamp_s += late_s;
        sample.read_s = sample.read_s.map(|read_s| read_s + (1.0 - self.effect.share) * late_s);
    }
}

/// What irregular stamps make of a run's rows: counts that were read before their stamp are short by the
/// speed times how late it is.
#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: all of it.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "share", unit: "1", prior_sigma: 1.0 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        if !interval.run.continuous {
            // A row between gaps has no neighbours to say how fast the wheels turned at its ends.
            let longer_s = interval.late_s[1] - interval.late_s[0];
            gradient[0] = interval.change(interval.speed_m_s.map(|speed_m_s| speed_m_s * longer_s));
            return;
        }
        // What a late stamp makes of a travel is gone with the next one: only the ends count.
        let [start_m, end_m] =
            [0, 1].map(|end| interval.speed_at_ends_m_s[end].map(|speed_m_s| speed_m_s * interval.late_s[end]));
        gradient[0] = interval.change(end_m.zip_with(start_m, |end_m, start_m| end_m - start_m));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};

    #[test]
    fn a_false_share_of_the_stamp_is_not_in_the_reading() {
        let effect = IntervalError { share: 0.25, jitter_s: 0.004 };
        let mut state = effect.forward().expect("acts on the clock");
        state.seed_run(Address { seed: 1, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        for row in 0..1000 {
            let due_s = f64::from(row);
            let mut sample = SampleClock { stamp_s: due_s, read_s: kinematics::Wheels::both(due_s) };
            state.clock(&mut sample);
            let (stamp_s, read_s) = (sample.stamp_s - due_s, sample.read_s.left - due_s);
            assert!(stamp_s.abs() <= 0.004 + 1e-12 && (read_s - 0.75 * stamp_s).abs() < 1e-12);
        }
    }

    #[test]
    fn stamps_without_the_false_share_are_when_the_counters_were_read() {
        // Rows read every 10 ms and stamped 1 ms off: a multiplicative congruential generator (Park & Miller
        // 1988), whose sum of twelve is normal.
        let mut state = 7_u64;
        let mut uniform = || {
            state = state * 48_271 % 2_147_483_647;
            state as f64 / 2_147_483_647.0
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let late_s: Vec<f64> = (0..2000).map(|_| 1e-3 * normal()).collect();
        let stamped = |share: f64| -> Vec<f64> {
            late_s.iter().enumerate().map(|(row, late_s)| 0.01 * row as f64 + share * late_s).collect()
        };
        let off_s = |found: &[f64], share: f64| {
            let squares = found.iter().zip(stamped(share)).map(|(found, due)| (found - due).powi(2));
            (squares.sum::<f64>() / late_s.len() as f64).sqrt()
        };
        // The line through 501 rows is off by 1 ms/√501 on average, by twice that at the ends of a run.
        // Rejects the stamps as they are, 1 ms off.
        let (whole, _) = read_times(&stamped(1.0).into(), 0.96, 0.02).expect("a beat");
        assert!(off_s(&whole, 0.0) < 1e-4, "{}", off_s(&whole, 0.0));
        // A share that is surely half leaves the other half, which is true.
        let (half, says) = read_times(&stamped(1.0).into(), 0.5, 0.02).expect("a beat");
        assert!(off_s(&half, 0.5) < 1e-4, "{}", off_s(&half, 0.5));
        assert!(says.iter().all(|says| *says), "each row has its tick");
        assert!(read_times(&stamped(1.0).into(), -0.9, 0.02).is_none(), "speeds that were logged have true stamps");
    }

    #[test]
    fn counts_of_rows_in_bunches_show_when_they_were_read() {
        // Rows read every 10 ms, received after an exponential delay of 20 ms; none overtakes another.
        let mut state = 7_u64;
        let mut uniform = || {
            state = state * 48_271 % 2_147_483_647;
            state as f64 / 2_147_483_647.0
        };
        let read_s: Vec<f64> = (0..2000).map(|row| 0.01 * f64::from(row)).collect();
        let mut before_s = f64::NEG_INFINITY;
        let stamp = |read_s: &f64| {
            before_s = (read_s - 0.02 * uniform().ln()).max(before_s + 1e-4);
            before_s
        };
        let stamps_s: Vec<f64> = read_s.iter().map(stamp).collect();
        // A wheel that goes to and fro in 6 s, 2000 counts a second at the most.
        let counted =
            |at_s: &[f64]| -> Vec<i64> { at_s.iter().map(|t_s| (2000.0 * t_s.sin()).round() as i64).collect() };
        let share = |at_s: &[f64]| {
            let mut run = dataset::Run::default();
            run.info.continuous = true;
            run.odometry.t_s = stamps_s.clone().into();
            run.odometry.wheels = WheelLog::Ticks(kinematics::Wheels::both(counted(at_s)));
            share_by_counts(&[Dataset { runs: vec![run], ..empty() }]).expect("rows in bunches")
        };
        // The beat is known to a tenth or so of the delays. Rejects a share by times alone, which is the same
        // for both.
        assert!((share(&read_s).0 - 1.0).abs() < 0.1, "{:?}", share(&read_s));
        assert!(share(&stamps_s).0.abs() < 0.1, "{:?}", share(&stamps_s));
    }

    fn empty() -> Dataset {
        Dataset {
            provenance: dataset::Provenance::default(),
            robot: dataset::NominalRobot {
                left_wheel_diameter_m: 0.16,
                right_wheel_diameter_m: 0.16,
                wheel_separation_m: 0.363,
                ticks_per_rev: Some(2000.0),
                counter_bits: None,
            },
            truth_noise: dataset::TruthNoise::default(),
            points: Vec::new(),
            runs: Vec::new(),
        }
    }
}
