//! Runs and intervals that do not belong: where the robot moved, or the instrument's frame did, as no wheel
//! says, and runs in which the instrument was mounted otherwise.
//!
//! A robot that is pushed, a wheel that is lifted, a loop closure of the instrument's map, a marker that
//! slips: one such event in a run is explained by whatever term it pays best, and that term is then found.
//! Before any fit, windows between measured poses show them ([`crate::records::pose_windows`]): far beyond
//! the noise of windows as long, beyond what wheels that roll can miss, and not undone by the next
//! measurements. Nothing is compared across such a window afterwards, and a run of another mounting is left
//! out.

mod events;
mod other_extrinsics;

use dataset::{Dataset, UnknownMotion};
use kinematics::Pose;
use rayon::prelude::*;

pub(crate) use self::events::AnomalyKind;
use self::events::{Event, Limits};
use self::other_extrinsics::{OtherExtrinsics, other_extrinsics};
use crate::records::names::run_name;
use crate::records::pose_windows::{CalibratedTracks, PoseTrack};
use crate::settings::RECORDS;
use rules::Rule;

/// What does not belong, where, and by how much.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Anomaly {
    pub(crate) kind: AnomalyKind,
    /// Id of the run.
    pub(crate) run: String,
    /// From when to when, seconds from the run's start.
    pub(crate) span_s: [f64; 2],
    /// Displacement: of the robot seen from where it was, or of the instrument on the robot.
    pub(crate) displacement: Pose,
    /// The largest of its components over its standard deviation.
    pub(crate) sigmas: f64,
}

/// What was found, and the records without it.
pub(crate) struct UnknownMotions {
    pub(crate) anomalies: Vec<Anomaly>,
    pub(crate) records: Vec<Dataset>,
}

/// Looks for them; `None` where there are none. The instrument is late by so much in all runs. In some run a
/// row may be stamped a tick of so long off, seconds: what the robot moves meanwhile is no event. Runs alone
/// are looked for without `with_events`.
pub(crate) fn unknown_motions(
    datasets: &[Dataset],
    late_s: f64,
    tick_s: f64,
    with_events: bool,
) -> Option<UnknownMotions> {
    let separation_m = datasets.first()?.robot.wheel_separation_m;
    let tracks = PoseTrack::of_all(datasets, late_s);
    let calibrated = CalibratedTracks::of(&tracks, separation_m)?;
    let limits = Limits::of(&calibrated, separation_m, tick_s);
    let of_tracks: Vec<Vec<Event>> = (0..tracks.len())
        .into_par_iter()
        .map(|track| limits.events(&calibrated, track, calibrated.body_from_sensor))
        .collect();
    let mut otherwise = other_extrinsics(&calibrated, &limits, &of_tracks);
    if Rule::OtherExtrinsics.finds(otherwise.first()).is_none() {
        otherwise.clear();
    }
    let is_left_out = |track: usize| otherwise.iter().any(|(of, _)| *of == track);
    let mut events: Vec<(usize, Event)> = Vec::new();
    for (track, of) in of_tracks.into_iter().enumerate().filter(|(track, _)| !is_left_out(*track)) {
        events.extend(of.into_iter().map(|event| (track, event)));
    }
    // Where so many are, the noise is so large, or the model is wrong.
    let pairs: usize = tracks.iter().map(|track| track.len() - 1).sum();
    let minutes: f64 = tracks.iter().map(|track| (track.t_s[track.len() - 1] - track.t_s[0]) / 60.0).sum();
    let spoiled: usize = events.iter().map(|(_, event)| event.poses.len() - 1).sum();
    if !with_events
        || spoiled as f64 > RECORDS.max_unknown_share * pairs as f64
        || events.len() as f64 > RECORDS.max_unknown_events_per_run * minutes.max(tracks.len() as f64)
    {
        events.clear();
    }
    if Rule::UnknownMotions.finds(events.first()).is_none() {
        events.clear();
    }
    if events.is_empty() && otherwise.is_empty() {
        return None;
    }
    let mut records = datasets.to_vec();
    let mut anomalies: Vec<Anomaly> = Vec::new();
    for (track, Event { poses, kind, displacement, sigmas }) in events {
        let track = &tracks[track];
        let [from_s, to_s] = [poses.start, poses.end - 1].map(|pose| track.t_s[pose]);
        let (session, run) = track.run;
        records[session].runs[run].add_unknown_motion([UnknownMotion { from_s, to_s }]);
        let displacement = Pose::new(displacement.x, displacement.y, displacement.z);
        anomalies.push(Anomaly {
            kind,
            run: run_name(datasets, session, run),
            span_s: [from_s, to_s],
            displacement,
            sigmas,
        });
    }
    let mut left_out: Vec<(usize, usize)> = Vec::new();
    for (track, OtherExtrinsics { kind, displacement, sigmas }) in otherwise {
        let track = &tracks[track];
        left_out.push(track.run);
        let run = run_name(datasets, track.run.0, track.run.1);
        let span_s = [track.t_s[0], track.t_s[track.len() - 1]];
        anomalies.push(Anomaly { kind, run, span_s, displacement, sigmas });
    }
    left_out.sort_unstable();
    for (session, run) in left_out.into_iter().rev() {
        records[session].runs.remove(run);
    }
    Some(UnknownMotions { anomalies, records })
}

#[cfg(test)]
mod tests {
    use dataset::{Odometry, Run, RunInfo, TruthSample, WheelLog};
    use kinematics::{Increment, Wheels};

    use super::*;
    use crate::records::pose_windows::Window;
    use crate::small_robot::{assert_unmoved, dataset_of};

    const SEPARATION_M: f64 = 0.36;

    /// What happens in one of the runs.
    #[derive(Clone, Copy)]
    enum Happens {
        /// The robot is carried by so much, in as many rows of 0.1 s.
        Carried(Pose, usize),
        /// The instrument's frame moves by so much, about the robot.
        FrameMoves(Pose),
        /// One measurement is off by so much: of which row.
        Outlier(Pose, usize),
        /// The instrument is elsewhere on the robot.
        Elsewhere(Pose),
        /// So many rows up to the hundredth wait, and are stamped with it.
        RowsWait(usize),
    }

    /// Eight runs of 20 s with turns both ways and measurements that round to a millimetre; something happens
    /// in the fourth.
    fn driven(happens: Option<Happens>) -> Dataset {
        let extrinsics = Pose::new(0.05, 0.02, 0.1);
        let run = |number: usize| {
            let happens = happens.filter(|_| number == 3);
            let stamp_s = |row: usize| match happens {
                Some(Happens::RowsWait(rows)) if (101 - rows..=100).contains(&row) => 10.0 - 1e-4 * (100 - row) as f64,
                _ => 0.1 * row as f64,
            };
            let (mut pose, mut frame) = (Pose::new(0.3, -0.2, 0.7), Pose::IDENTITY);
            let (mut turns, mut truth) = (Wheels::both(vec![0.0]), Vec::new());
            for row in 0..=200_usize {
                let t_s = 0.1 * row as f64;
                if row > 0 {
                    let turned = Wheels { left: 0.4 + 0.2 * (0.5 * t_s).sin(), right: 0.4 + 0.25 * (0.7 * t_s).cos() };
                    // The wheels are a little larger than stated.
                    pose = pose * Increment::from_travel(turned.map(|rad| 0.081 * rad), SEPARATION_M).arc();
                    turns = turns.zip_with(turned, |mut all, rad| {
                        all.push(all[row - 1] + rad);
                        all
                    });
                }
                let mut sensor = extrinsics;
                match happens {
                    Some(Happens::Carried(by, rows)) if (100..100 + rows).contains(&row) => {
                        let share = 1.0 / rows as f64;
                        pose = pose * Pose::new(share * by.x_m, share * by.y_m, share * by.theta_rad);
                    }
                    Some(Happens::FrameMoves(by)) if row == 100 => frame = pose * by * pose.inverse(),
                    Some(Happens::Elsewhere(at)) => sensor = at,
                    _ => {}
                }
                let mut seen = frame * pose * sensor;
                if let Some(Happens::Outlier(by, of)) = happens
                    && of == row
                {
                    seen = seen * by;
                }
                let [x_m, y_m] = [seen.x_m, seen.y_m].map(|m| 1e-3 * (1e3 * m).round());
                truth.push(TruthSample::new(t_s, x_m, y_m, Some(seen.theta_rad)));
            }
            Run {
                info: RunInfo { id: format!("run-{number}"), continuous: true, ..RunInfo::default() },
                odometry: Odometry {
                    t_s: (0..=200).map(stamp_s).collect(),
                    wheels: WheelLog::Angles(turns),
                    ..Odometry::default()
                },
                truth,
                ..Run::default()
            }
        };
        dataset_of(SEPARATION_M, (0..8).map(run).collect())
    }

    fn found(happens: Happens) -> UnknownMotions {
        unknown_motions(&[driven(Some(happens))], 0.0, 0.0, true).expect("something happens")
    }

    #[test]
    fn what_is_ordinary_and_what_is_undone_at_once_is_no_event() {
        assert!(unknown_motions(&[driven(None)], 0.0, 0.0, true).is_none());
        for row in [0, 1, 100, 199, 200] {
            let outlier = Happens::Outlier(Pose::new(0.5, 0.3, 0.4), row);
            assert!(unknown_motions(&[driven(Some(outlier))], 0.0, 0.0, true).is_none(), "row {row}");
        }
        // Counts fall behind over half a second, 0.1 m at the most, and catch up within a row.
        for rows in [2, 4, 5] {
            assert!(unknown_motions(&[driven(Some(Happens::RowsWait(rows)))], 0.0, 0.0, true).is_none(), "{rows} rows");
        }
        // What the robot drives in a tick, 0.3 m/s, may be a stamp's, where stamps do not say of which tick a
        // row is.
        let step = driven(Some(Happens::Carried(Pose::new(0.05, 0.0, 0.0), 1)));
        assert!(unknown_motions(std::slice::from_ref(&step), 0.0, 0.0, true).is_some());
        assert!(unknown_motions(&[step], 0.0, 0.1, true).is_none());
        // Below what wheels can miss.
        assert!(
            unknown_motions(&[driven(Some(Happens::Carried(Pose::new(0.01, 0.0, 0.02), 1)))], 0.0, 0.0, true).is_none()
        );
    }

    #[test]
    fn runs_of_another_mounting_are_left_out_where_events_are_not_sought() {
        let by = |happens| unknown_motions(&[driven(Some(happens))], 0.0, 0.0, false);
        assert!(by(Happens::Carried(Pose::new(0.2, -0.1, 0.3), 5)).is_none());
        let left = by(Happens::Elsewhere(Pose::new(0.05, 0.02, 0.2))).expect("a run");
        assert_eq!((left.records[0].runs.len(), left.anomalies.len()), (7, 1));
    }

    #[test]
    fn a_robot_that_is_carried_is_found_with_its_displacement_and_nothing_is_compared_meanwhile() {
        let by = Pose::new(0.2, -0.1, 0.3);
        let UnknownMotions { anomalies, records } = found(Happens::Carried(by, 5));
        let [anomaly] = &anomalies[..] else { panic!("one event, not {}", anomalies.len()) };
        assert_eq!((anomaly.kind, anomaly.run.as_str()), (AnomalyKind::RobotOrFrame, "run-3"));
        let [from_s, to_s] = anomaly.span_s;
        assert!(from_s < 10.0 && to_s >= 10.4 && to_s - from_s < 1.2, "{from_s} to {to_s}");
        // The robot drives on meanwhile: the displacement is seen from where it was, to a few per cent.
        let displacement = anomaly.displacement;
        assert!((displacement.x_m.hypot(displacement.y_m) - 0.05_f64.sqrt()).abs() < 0.03, "{displacement:?}");
        assert!((displacement.theta_rad - 0.3).abs() < 0.01, "{displacement:?}");
        assert!(records[0].runs[3].is_motion_unknown(10.0, 10.1));
        assert!(!records[0].runs[3].is_motion_unknown(8.0, 9.0));
    }

    #[test]
    fn a_frame_that_jumps_farther_than_robots_drive_is_the_instruments() {
        let anomalies = found(Happens::FrameMoves(Pose::new(0.3, 0.2, 0.1))).anomalies;
        let [anomaly] = &anomalies[..] else { panic!("one event, not {}", anomalies.len()) };
        assert_eq!(anomaly.kind, AnomalyKind::Frame);
        // As far as a robot drives in 0.1 s it may be either.
        let anomalies = found(Happens::FrameMoves(Pose::new(0.0, 0.04, 0.0))).anomalies;
        assert_eq!(anomalies[0].kind, AnomalyKind::RobotOrFrame);
    }

    #[test]
    fn a_run_with_the_instrument_elsewhere_is_left_out() {
        let UnknownMotions { anomalies, records } = found(Happens::Elsewhere(Pose::new(0.05, 0.02, 0.2)));
        let [anomaly] = &anomalies[..] else { panic!("one run, not {}", anomalies.len()) };
        assert_eq!((anomaly.kind, anomaly.run.as_str()), (AnomalyKind::ExtrinsicHeading, "run-3"));
        assert!((anomaly.displacement.theta_rad - 0.1).abs() < 0.01, "{:?}", anomaly.displacement);
        assert!(records[0].runs.len() == 7 && records[0].runs.iter().all(|run| run.info.id != "run-3"));
        let place = found(Happens::Elsewhere(Pose::new(0.08, 0.02, 0.1))).anomalies;
        assert_eq!(place[0].kind, AnomalyKind::ExtrinsicPosition);
        assert!((place[0].displacement.x_m - 0.03).abs() < 0.005, "{:?}", place[0].displacement);
    }

    #[test]
    fn regress_no_number_of_what_happens_in_a_run_moves() {
        let mut text = String::new();
        for (name, happens) in [
            ("carried ahead", Happens::Carried(Pose::new(0.2, -0.1, 0.3), 5)),
            ("carried aside in a row", Happens::Carried(Pose::new(0.0, 0.05, 0.0), 1)),
            ("turned for long", Happens::Carried(Pose::new(0.0, 0.0, 0.5), 12)),
            ("frame", Happens::FrameMoves(Pose::new(0.3, 0.2, 0.1))),
            ("frame that turns", Happens::FrameMoves(Pose::new(0.0, 0.0, -0.4))),
            ("elsewhere", Happens::Elsewhere(Pose::new(0.09, -0.02, 0.1))),
            ("turned elsewhere", Happens::Elsewhere(Pose::new(0.05, 0.02, 0.2))),
            ("both", Happens::Elsewhere(Pose::new(0.08, 0.02, 0.15))),
        ] {
            let found = unknown_motions(&[driven(Some(happens))], 0.0, 0.0, true);
            let spans = |of: &UnknownMotions| -> Vec<usize> {
                of.records[0].runs.iter().map(|run| run.unknown_motion.len()).collect()
            };
            text += &format!("{name}: {:?}\n", found.map(|of| (spans(&of), of.anomalies)));
        }
        let datasets = [driven(Some(Happens::Elsewhere(Pose::new(0.08, 0.02, 0.15))))];
        let tracks = PoseTrack::of_all(&datasets, 0.03);
        let calibrated = CalibratedTracks::of(&tracks, SEPARATION_M).expect("determined");
        // Wheels are an eightieth larger, and the instrument is where it is: the windows say so to a part in
        // a hundred.
        let at = calibrated.body_from_sensor;
        assert!(
            (at.x_m - 0.05).abs() < 5e-3 && (at.y_m - 0.02).abs() < 5e-3 && (at.theta_rad - 0.1).abs() < 2e-2,
            "{at:?}"
        );
        text += &format!("at: {at:?}, span {}\n", calibrated.span);
        for (from, to) in [(0, 1), (3, 11), (50, 82)] {
            let residuals = [0, 3].map(|track| calibrated.residual(track, Window { from, to }));
            text += &format!("{:?}: {residuals:?}\n", (from, to));
        }
        for track in [0, 3] {
            let all = calibrated.extrinsics(track, |_| true);
            text += &format!("{all:?} {:?}\n", calibrated.extrinsics(track, |window| window.from < 100));
            text += &format!("{:?}\n", &calibrated.poses(track)[190..192]);
        }
        assert!(calibrated.extrinsics(0, |window| window.from < 4).is_none(), "too few windows");
        assert_unmoved("windows.txt", &text);
    }

    #[test]
    fn where_much_is_beyond_wheels_nothing_is() {
        // Something happens in so many runs, once each; eight runs of 20 s may have sixteen events, and a
        // tenth of 1600 pairs may be spoiled.
        let with = |runs: usize, rows: usize| {
            let by = Pose::new(0.2, -0.1, 0.3);
            let (mut all, carried) = (driven(None), driven(Some(Happens::Carried(by, rows))));
            all.runs[..runs].iter_mut().for_each(|run| run.truth.clone_from(&carried.runs[3].truth));
            unknown_motions(&[all], 0.0, 0.0, true).map(|of| of.anomalies.len())
        };
        assert_eq!((with(2, 3), with(5, 3)), (Some(2), Some(5)));
        // 25 rows in each of seven runs are more than a tenth.
        assert_eq!(with(7, 25), None);
    }
}
