//! Walls from the scans of a lidar: a pass over the bag once the runs and their nominal odometry are known.
//!
//! The beams of a scan are measured one after the other. Each is moved to where the lidar stands at the
//! scan's stamp by the nominal odometry: its turn always, its drive where the place of the lidar on the robot
//! is known. A wall is measured at the mean time of its beams.

use dataset::{Dataset, LidarExtrinsics, WallReading};
use kinematics::Pose;

use crate::bag::Bag;
use crate::clock::{Clock, Times, seconds};
use crate::error::RosBagError;
use crate::laser_scan::{self, Scan};
use crate::nominal_path::NominalPath;
use crate::rows::{RECEIPT_MARGIN_S, Rows};
use crate::static_frames::{Mounted, StaticFrames};
use crate::topics::Topic;
use crate::wall_line::{self, ScanPoint, WallLine};
use crate::wall_tracks::{self, FollowedWalls};

/// When a run was, by the clock of the wheels and by that of the recorder, nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunSpan {
    pub(crate) clock_ns: (i64, i64),
    pub(crate) received_ns: (i64, i64),
}

impl RunSpan {
    /// Whether a message is of the run. Of recordings with the same times each message belongs to that in
    /// which it was received.
    pub(crate) fn contains(&self, time_ns: i64, received_ns: i64) -> bool {
        (self.clock_ns.0..=self.clock_ns.1).contains(&time_ns)
            && seconds(self.received_ns.0, received_ns) >= -RECEIPT_MARGIN_S
            && seconds(self.received_ns.1, received_ns) <= RECEIPT_MARGIN_S
    }
}

/// What was taken of the scans.
pub(crate) struct TakenScans {
    pub(crate) type_name: String,
    pub(crate) what: String,
    pub(crate) readings: usize,
}

/// What one scan says: its stamp within a run, and the walls at their instants.
struct SeenScan {
    t_s: f64,
    walls: Vec<(f64, WallLine)>,
}

/// What was left out.
#[derive(Default)]
struct LeftOut {
    outside: usize,
    without_wall: usize,
    instantaneous: usize,
}

/// Where the scans are, and the clock of the wheels, by which they are timed.
#[derive(Clone, Copy)]
pub(crate) struct ScanSource<'a> {
    pub(crate) bag: &'a Bag,
    pub(crate) topic: &'a Topic,
    pub(crate) clock: Clock,
}

/// The scans of each run, and the lidar that took them.
struct ScansByRun {
    runs: Vec<Vec<SeenScan>>,
    frame: String,
    mounted: Option<Mounted>,
    count: usize,
    left_out: LeftOut,
}

/// Adds the walls that a lidar sees to the runs of a dataset, whose spans are given.
///
/// # Errors
/// [`RosBagError`] where the topic holds no scans that can be used, or no wall is in them.
pub(crate) fn add_walls(
    dataset: &mut Dataset,
    spans: &[RunSpan],
    source: ScanSource<'_>,
    frames: &StaticFrames,
    warnings: &mut Vec<String>,
) -> Result<TakenScans, RosBagError> {
    let topic = source.topic;
    let session = dataset.session();
    let paths: Vec<NominalPath> = session.runs.iter().map(|run| NominalPath::of(run, session.robot)).collect();
    let ScansByRun { mut runs, frame, mounted, count, left_out } =
        scans_by_run(source, spans, &paths, frames, warnings)?;
    let (mut readings, mut walls, mut ambiguous, mut seldom) = (0, 0, 0, 0);
    for ((run, scans), path) in dataset.runs.iter_mut().zip(&mut runs).zip(&paths) {
        scans.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        let scans: Vec<_> = scans.drain(..).map(|scan| scan.walls).collect();
        let found: FollowedWalls = wall_tracks::follow(&scans, path, mounted.map(|of| of.body_from_lidar));
        readings += found.readings.len();
        walls += found.walls;
        ambiguous += found.ambiguous;
        seldom += found.seldom;
        run.walls = found.readings;
        run.walls.dedup_by(|next, before| is_again(next, before));
    }
    let mut note = |count: usize, what: &str| {
        if count > 0 {
            warnings.push(format!("topic {}: {count} {what}", topic.name));
        }
    };
    note(left_out.outside, &format!("of {count} scans are before the first or after the last message of the wheels"));
    note(left_out.without_wall, &format!("of {count} scans show no straight wall and were left out"));
    note(ambiguous, "lines may be of two walls and were left out");
    note(seldom, "lines are of walls that were seen too seldom and were left out");
    note(
        left_out.instantaneous,
        "scans have no time_increment: their beams count as measured at the stamp, which is wrong by the turn during a scan unless the driver corrects it",
    );
    if readings == 0 {
        let why =
            format!("no straight wall of a metre is followed over its {count} scans; spin 1 to 4 m in front of one");
        return Err(topic.unusable(why));
    }
    dataset.truth_noise.lidar =
        Some(LidarExtrinsics { yaw_rad: mounted.map(|mounted| mounted.body_from_lidar.theta_rad) });
    let place = match mounted {
        Some(Mounted { body_from_lidar: Pose { x_m, y_m, theta_rad }, .. }) => format!(
            "{frame} at ({x_m:.3}, {y_m:.3}) m and {:.1}° on the robot by /tf_static, from where its place is estimated",
            theta_rad.to_degrees()
        ),
        None => format!("{frame}, whose place on the robot is estimated"),
    };
    let what = format!("{walls} straight walls in {} runs seen from {place}", dataset.runs.len());
    Ok(TakenScans { type_name: topic.type_name.clone(), what, readings })
}

/// The scans within the runs, whose spans and nominal paths are given.
fn scans_by_run(
    ScanSource { bag, topic, clock }: ScanSource<'_>,
    spans: &[RunSpan],
    paths: &[NominalPath],
    frames: &StaticFrames,
    warnings: &mut Vec<String>,
) -> Result<ScansByRun, RosBagError> {
    let mut runs: Vec<Vec<SeenScan>> = spans.iter().map(|_| Vec::new()).collect();
    let mut left_out = LeftOut::default();
    let mut frame: Option<(String, Option<Mounted>)> = None;
    let mut scans: Rows<()> = Rows::new(&topic.name, &topic.type_name);
    let mut why_not = None;
    bag.visit(|channel, received_ns, message| {
        if channel.topic != topic.name {
            return Ok(());
        }
        let Some(value) = scans.decode(channel, message)? else { return Ok(()) };
        let scan = match laser_scan::read(&value) {
            Ok(scan) => scan,
            Err(why) => {
                scans.note_fault(why);
                return Ok(());
            }
        };
        let (_, mounted) = match &mut frame {
            Some(of) if of.0 == scan.frame => of,
            _ => match frames.mounted(&scan.frame) {
                Ok(mounted) => frame.insert((scan.frame.clone(), mounted)),
                Err(why) => {
                    why_not = Some(format!("frame {}: {why}", scan.frame));
                    return Ok(());
                }
            },
        };
        let times = Times::of(&value, received_ns);
        scans.push(times, (), true);
        let of_run = times.by(clock).and_then(|time_ns| {
            Some((spans.iter().position(|span| span.contains(time_ns, times.received_ns))?, time_ns))
        });
        let Some((run, time_ns)) = of_run else {
            left_out.outside += 1;
            return Ok(());
        };
        let t_s = seconds(spans[run].clock_ns.0, time_ns);
        let Some(points) = deskewed(&scan, t_s, &paths[run], mounted.as_ref()) else {
            left_out.outside += 1;
            return Ok(());
        };
        left_out.instantaneous += usize::from(scan.duration_s == 0.0);
        let walls = wall_line::walls(&points);
        left_out.without_wall += usize::from(walls.is_empty());
        let at_their_instants = walls.iter().filter_map(|wall| at_mean_time(wall, t_s, &paths[run], mounted.as_ref()));
        runs[run].push(SeenScan { t_s, walls: at_their_instants.collect() });
        Ok(())
    })?;
    if let Some(why) = why_not {
        return Err(topic.unusable(why));
    }
    scans.refuse_none("a scan")?;
    let Some((frame, mounted)) = frame else { return Err(topic.unusable("no scan was read".to_owned())) };
    warnings.extend(scans.warnings());
    Ok(ScansByRun { runs, frame, mounted, count: scans.len(), left_out })
}

/// Is it of the same wall and instant?
fn is_again(next: &WallReading, before: &WallReading) -> bool {
    next.t_s == before.t_s && next.wall == before.wall
}

/// Where the lidar stands some time after a scan's stamp, seen from where it stood then.
fn moved(t_s: f64, after_s: f64, path: &NominalPath, mounted: Option<&Mounted>) -> Option<Pose> {
    let motion = path.at(t_s)?.to(path.at(t_s + after_s)?);
    Some(match mounted {
        Some(Mounted { body_from_lidar, .. }) => body_from_lidar.inverse() * motion * *body_from_lidar,
        None => Pose::new(0.0, 0.0, motion.theta_rad),
    })
}

/// The points of a scan, seen from where the lidar stood at its stamp; none where the log ends before it.
fn deskewed(scan: &Scan, t_s: f64, path: &NominalPath, mounted: Option<&Mounted>) -> Option<Vec<ScanPoint>> {
    let side = if mounted.is_some_and(|mounted| mounted.is_upside_down) { -1.0 } else { 1.0 };
    let point = |beam: &laser_scan::Beam| {
        let lidar = moved(t_s, beam.after_s, path, mounted)?;
        let (sin, cos) = (side * beam.angle_rad + lidar.theta_rad).sin_cos();
        let (x_m, y_m) = (lidar.x_m + beam.range_m * cos, lidar.y_m + beam.range_m * sin);
        Some(ScanPoint { x_m, y_m, after_s: beam.after_s })
    };
    scan.beams.iter().map(point).collect()
}

/// A wall at the mean time of its beams, seconds from the run's start, as the lidar sees it then.
fn at_mean_time(wall: &WallLine, t_s: f64, path: &NominalPath, mounted: Option<&Mounted>) -> Option<(f64, WallLine)> {
    let lidar = moved(t_s, wall.after_s, path, mounted)?;
    // The wall's normal in the lidar's frame is (sin u, cos u).
    let (sin, cos) = wall.heading_rad.sin_cos();
    let distance_m = wall.distance_m - sin * lidar.x_m - cos * lidar.y_m;
    let heading_rad = kinematics::wrap_to_pi(wall.heading_rad + lidar.theta_rad);
    Some((t_s + wall.after_s, WallLine { heading_rad, distance_m, ..*wall }))
}
