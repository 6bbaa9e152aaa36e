//! One long log cut into the runs that it was joined of.

use dataset::{Dataset, Displacement, Run, WheelLog};
use kinematics::Wheels;

/// How long a robot stands at a cut, seconds: less than between programs that were joined, by what rows may
/// be late.
const MIN_STOP_S: f64 = 0.8;

/// Instants of a dataset's runs, seconds from the start of each: the middle of its stops.
pub(crate) type Stops = Vec<Vec<f64>>;

/// Where the robot stops, but at the ends of its runs.
pub(crate) fn stops(dataset: &Dataset) -> Stops {
    dataset.runs.iter().map(stops_of).collect()
}

/// The dataset with each run cut at the rows nearest to some instants. Rows and measurements stay as they
/// are; a displacement over a cut is left out.
fn cut_at(dataset: &Dataset, stops: &Stops) -> Dataset {
    let runs = dataset.runs.iter().zip(stops).flat_map(|(run, stops)| cut(run, stops));
    Dataset { runs: runs.collect(), ..dataset.clone() }
}

/// The same of several datasets.
pub(crate) fn cut_all(datasets: &[Dataset], stops: &[Stops]) -> Vec<Dataset> {
    datasets.iter().zip(stops).map(|(dataset, stops)| cut_at(dataset, stops)).collect()
}

fn cut(run: &Run, stops: &[f64]) -> Vec<Run> {
    let t_s = &run.odometry.t_s;
    let last = t_s.len().saturating_sub(1);
    let nearest = |at_s: &f64| t_s.partition_point(|t_s| t_s < at_s);
    let mut ends: Vec<usize> = stops.iter().map(nearest).filter(|row| (1..last).contains(row)).collect();
    ends.dedup();
    ends.push(last);
    let mut first = 0;
    let part = |(number, row): (usize, usize)| {
        let part = part(run, number, [first, row]);
        first = row;
        part
    };
    ends.into_iter().enumerate().map(part).collect()
}

fn stops_of(run: &Run) -> Vec<f64> {
    let WheelLog::Ticks(ticks) = &run.odometry.wheels else { return Vec::new() };
    let t_s = &run.odometry.t_s;
    let rows: Vec<usize> = (0..t_s.len()).collect();
    let stands = |a: &usize, b: &usize| ticks.left[*a] == ticks.left[*b] && ticks.right[*a] == ticks.right[*b];
    rows.chunk_by(stands)
        .filter(|stop| stop[0] > 0 && stop[stop.len() - 1] + 1 < t_s.len())
        .filter(|stop| t_s[stop[stop.len() - 1]] - t_s[stop[0]] >= MIN_STOP_S)
        .map(|stop| t_s[stop[stop.len() / 2]])
        .collect()
}

/// The rows from one to another as a run, and what was measured between them.
fn part(run: &Run, number: usize, [first, last]: [usize; 2]) -> Run {
    let [from_s, to_s] = [first, last].map(|row| run.odometry.t_s[row]);
    let is_last = last + 1 == run.odometry.t_s.len();
    let is_within = |t_s: f64| (first == 0 || t_s >= from_s) && (is_last || t_s < to_s);
    let mut part = run.clone();
    part.info.id = format!("{}_{number:03}", run.info.id);
    part.info.start_s = run.info.start_s.map(|start_s| start_s + from_s);
    part.odometry.t_s = run.odometry.t_s[first..=last].iter().map(|t_s| t_s - from_s).collect();
    if let WheelLog::Ticks(ticks) = &run.odometry.wheels {
        let of = |side: &Vec<i64>| side[first..=last].to_vec();
        part.odometry.wheels = WheelLog::Ticks(Wheels { left: of(&ticks.left), right: of(&ticks.right) });
    }
    part.odometry.extra.values_mut().for_each(|column| *column = column[first..=last].to_vec());
    let kept: Vec<usize> = (0..run.truth.len()).filter(|sample| is_within(run.truth[*sample].t_s)).collect();
    let shifted = |sample: &usize| {
        let mut shifted = run.truth[*sample];
        shifted.t_s -= from_s;
        shifted
    };
    part.truth = kept.iter().map(shifted).collect();
    part.truth_sigma = run.truth_sigma.as_ref().map(|sigmas| kept.iter().map(|sample| sigmas[*sample]).collect());
    part.displacements = run
        .displacements
        .iter()
        .filter(|of| is_within(of.t0_s) && is_within(of.t1_s))
        .map(|of| Displacement { t0_s: of.t0_s - from_s, t1_s: of.t1_s - from_s, ..*of })
        .collect();
    part
}

#[cfg(test)]
mod tests {
    use dataset::{NominalRobot, Odometry, Provenance, RunInfo, TruthNoise, TruthSample};

    use super::*;

    /// Rows of 0.1 s: 1 s at rest, 2 s of motion, 1.1 s at rest, 2 s of motion, 0.5 s at rest, motion again,
    /// and 1 s at rest; a pose in the middle of every fifth row, and displacements from each pose to the
    /// next.
    fn log() -> Dataset {
        let moves = |row: i64| (10..30).contains(&row) || (41..61).contains(&row) || (66..80).contains(&row);
        let mut ticks = vec![7_i64];
        (0..90).for_each(|row| ticks.push(ticks[row as usize] + i64::from(moves(row)) * 3));
        let truth: Vec<TruthSample> =
            (0..18).map(|k| TruthSample::new(0.5 * f64::from(k) + 0.05, f64::from(k), 0.0, Some(0.0))).collect();
        let displacement = |pair: &[TruthSample]| Displacement {
            t0_s: pair[0].t_s,
            t1_s: pair[1].t_s,
            dx_m: 1.0,
            dy_m: 0.0,
            dtheta_rad: 0.0,
        };
        let run = Run {
            info: RunInfo { id: "a".to_owned(), start_s: Some(100.0), ..RunInfo::default() },
            odometry: Odometry {
                t_s: (0..=90).map(|row| 0.1 * f64::from(row)).collect(),
                wheels: WheelLog::Ticks(Wheels { left: ticks.clone(), right: ticks }),
                ..Odometry::default()
            },
            displacements: truth.windows(2).map(displacement).collect(),
            truth,
            ..Run::default()
        };
        Dataset {
            provenance: Provenance::default(),
            robot: NominalRobot {
                left_wheel_diameter_m: 0.2,
                right_wheel_diameter_m: 0.2,
                wheel_separation_m: 0.5,
                ticks_per_rev: Some(100.0),
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs: vec![run],
        }
    }

    #[test]
    fn a_log_is_cut_where_the_robot_stops_and_nothing_else_changes() {
        let log = log();
        let cut = cut_at(&log, &stops(&log));
        // Not at the ends, nor in the stop of half a second.
        let [a, b] = &cut.runs[..] else { panic!("{} runs", cut.runs.len()) };
        assert_eq!((a.info.id.as_str(), b.info.id.as_str()), ("a_000", "a_001"));
        // The stop has the rows from 3.0 s to 4.1 s; its middle is the row at 3.6 s.
        let start_s = b.info.start_s.expect("stated");
        assert!((start_s - 103.6).abs() < 1e-9, "{start_s}");
        let rows = |run: &Run| run.odometry.t_s.len();
        assert_eq!((rows(a), rows(b), b.odometry.t_s[0]), (37, 55, 0.0));
        let WheelLog::Ticks(ticks) = &b.odometry.wheels else { panic!("ticks") };
        // As counted: 7 and twenty rows of three.
        assert_eq!((ticks.left[0], ticks.left.len()), (67, 55));
        // Every pose is in one of both, at its instant on the session's clock.
        let whole: Vec<(f64, f64)> = log.runs[0].truth.iter().map(|sample| (100.0 + sample.t_s, sample.x_m)).collect();
        let parts = cut.runs.iter().flat_map(|run| run.truth.iter().map(move |of| (run.info.start_s, of)));
        let parts: Vec<(f64, f64)> =
            parts.map(|(start_s, sample)| (start_s.expect("stated") + sample.t_s, sample.x_m)).collect();
        assert_eq!(parts.len(), whole.len());
        assert!(parts.iter().zip(&whole).all(|(a, b)| (a.0 - b.0).abs() < 1e-9 && a.1 == b.1));
        // The displacement over the cut is in neither.
        assert_eq!(a.displacements.len() + b.displacements.len() + 1, log.runs[0].displacements.len());
    }
}
