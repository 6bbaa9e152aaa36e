//! Runs as partial measurements: what a gyroscope, a tape measure, a wall or a place that is come back to
//! says of the robot at one instant or at two.
//!
//! Every such measurement is a scalar function of where the robot stood at its instants, with a variance of
//! its own. All of a run stand in one segment, since the wheels' errors are common to them. The poses of the
//! run, if it has any, stand in the same segment beside them.

use std::collections::BTreeMap;

use dataset::{GyroNoise, LidarExtrinsics, MIN_LIDAR_TURN_RAD, Run, RunView, Session, median};
use kinematics::Wheels;

use crate::model::Model;
use crate::partial_observation::{Observation, Place, Quantity};
use crate::segment::{Segment, Start};
use crate::settings::{COMMON, PARTIAL, TIME_TOLERANCE_S};
use crate::wall_start::WallStart;
use crate::wheel_angles::WheelAngleInterpolator;

/// The partial measurements of a run, without a gap of its log between them.
#[derive(Debug, Clone)]
pub(crate) struct PartialSegment<'a> {
    /// The wheels' intervals; measurements of poses are in the records' other segments.
    pub(crate) segment: Segment<'a>,
    /// In the order of time.
    pub(crate) places: Vec<Place>,
    /// In the order of the places where they end.
    pub(crate) observations: Vec<Observation>,
    /// Where the filter begins with the walls, and with the lidar that sees them.
    pub(crate) walls: WallStart,
    /// Variance of the gyroscope's bias per second, (rad/s)²/s.
    pub(crate) bias_walk: f64,
}

impl PartialSegment<'_> {
    /// Are there poses beside the partial measurements?
    pub(crate) fn has_poses(&self) -> bool {
        self.observations.iter().any(|of| matches!(of.quantity, Quantity::MeasuredPose { .. }))
    }

    /// Number of its measurements without the poses.
    pub(crate) fn partial_measurements(&self) -> usize {
        self.observations.iter().filter(|of| !matches!(of.quantity, Quantity::MeasuredPose { .. })).count()
    }

    /// How many places are needed at once, each until the last observation that is of it.
    pub(crate) fn most_places_at_once(&self, last_use: &[Option<usize>]) -> usize {
        let mut observations = self.observations.iter().enumerate().peekable();
        let (mut needed, mut most) = (Vec::new(), 1);
        for (number, last_use) in last_use.iter().enumerate() {
            needed.extend(*last_use);
            most = most.max(needed.len());
            while let Some((at, _)) = observations.next_if(|(_, of)| of.to == number) {
                needed.retain(|last_use| *last_use > at);
            }
        }
        most
    }

    /// Are distances measured in it?
    pub(crate) fn has_distances(&self) -> bool {
        self.observations.iter().any(|of| matches!(of.quantity, Quantity::Distance | Quantity::WallDistance(_)))
    }

    /// Does a gyroscope measure in it?
    pub(crate) fn has_gyro(&self) -> bool {
        self.observations.iter().any(|of| matches!(of.quantity, Quantity::GyroTurn { .. }))
    }
}

/// A measurement with its instants, before places are found.
struct Timed {
    from_s: f64,
    to_s: f64,
    quantity: Quantity,
    value: f64,
    variance: f64,
}

/// A part of a log without gaps: the places that measurements are of, and at which instants.
struct Stretch<'a> {
    segment: Segment<'a>,
    /// Instants, with the index of their place.
    placed: Vec<(f64, usize)>,
    places: Vec<Place>,
}

/// The segments of a run's poses.
#[derive(Clone, Copy)]
pub(crate) struct PosesOfRun<'p, 'a> {
    pub(crate) segments: &'p [Segment<'a>],
    /// The index of the first of them.
    pub(crate) first: usize,
}

/// The partial measurements of a run, with its `poses`. A run with displacements gives none: these hold the
/// wheels' errors as well, and a likelihood that counts them twice would be too sure.
pub(crate) fn partial_segments<'a>(
    run: &RunView<'a>,
    base: &Segment<'a>,
    PosesOfRun { segments: poses, first }: PosesOfRun<'_, 'a>,
    track: &WheelAngleInterpolator<'_>,
    nominal: &Model,
    gyro: &GyroSettings,
    lidar: Option<LidarExtrinsics>,
) -> Vec<PartialSegment<'a>> {
    let shows_distances = lidar.is_none() || turned_rad(track, nominal) >= MIN_LIDAR_TURN_RAD;
    let (mut timed, walls) = tape_and_walls(run.run(), shows_distances);
    timed.extend(gyro.windows(run, track));
    if timed.is_empty() || poses.iter().any(Segment::is_displacement) {
        return Vec::new();
    }
    timed.extend(poses.iter().enumerate().flat_map(|(number, segment)| {
        segment.measurements.iter().enumerate().map(move |(measurement, of)| Timed {
            from_s: of.t_s,
            to_s: of.t_s,
            quantity: Quantity::MeasuredPose { segment: first + number, measurement },
            value: 0.0,
            variance: 0.0,
        })
    }));
    let mut instants: Vec<f64> = timed.iter().flat_map(|of| [of.from_s, of.to_s]).collect();
    instants.sort_by(f64::total_cmp);
    instants.dedup_by(|later, before| *later - *before <= TIME_TOLERANCE_S);
    let mut cursor = track.cursor();
    let mut parts: Vec<Stretch<'a>> = Vec::new();
    for t_s in instants {
        if let Some(Stretch { segment, placed, places }) = parts.last_mut()
            && let Some((before_s, place)) = placed.last().copied()
        {
            let first = segment.intervals.len();
            if !run.run().is_motion_unknown(before_s, t_s) && cursor.intervals(before_s, t_s, &mut segment.intervals) {
                if segment.intervals[first..].iter().all(|interval| interval.stands) {
                    // The robot stands: it is the same place, with the same rounding of the counts.
                    placed.push((t_s, place));
                } else {
                    let interpolated_rad2 =
                        segment.intervals.last().map_or(Wheels::both(0.0), |last| last.interpolated_rad2[1]);
                    placed.push((t_s, places.len()));
                    places.push(Place { after: segment.intervals.len(), interpolated_rad2 });
                }
                continue;
            }
        }
        if let Some(turned_rad) = cursor.angle_rad(t_s) {
            let wheel_rad = turned_rad.zip_with(base.wheel_rad, |turned, first| first + turned);
            let segment = Segment { wheel_rad, start: Start::Origin, ..base.clone() };
            let place = Place { after: 0, interpolated_rad2: Wheels::both(0.0) };
            parts.push(Stretch { segment, placed: vec![(t_s, 0)], places: vec![place] });
        }
    }
    let of_part = |Stretch { segment, placed, places }: Stretch<'a>| {
        let place_at = |t_s: f64| {
            let at = placed.partition_point(|(placed_s, _)| *placed_s < t_s - TIME_TOLERANCE_S);
            placed.get(at).filter(|(placed_s, _)| (placed_s - t_s).abs() <= TIME_TOLERANCE_S).map(|(_, place)| *place)
        };
        let mut observations: Vec<Observation> = timed
            .iter()
            .filter_map(|of| {
                let (from, to) = (place_at(of.from_s)?, place_at(of.to_s)?);
                let Timed { to_s: t_s, quantity, value, variance, .. } = *of;
                Some(Observation { from, to, t_s, quantity, value, variance })
            })
            .collect();
        // Between equals the order of the files.
        observations.sort_by_key(|of| of.to);
        let walls = WallStart::of(&segment, &places, &observations, walls, nominal, lidar);
        let bias_walk = gyro.stated.bias_walk_radps_per_sqrt_s.unwrap_or(PARTIAL.bias_walk_radps).powi(2);
        PartialSegment { segment, places, observations, walls, bias_walk }
    };
    parts.into_iter().map(of_part).filter(|of| of.partial_measurements() > 0).collect()
}

/// Range of a run's headings by the nominal wheels, radians.
fn turned_rad(track: &WheelAngleInterpolator<'_>, nominal: &Model) -> f64 {
    let turns = track.turns();
    let headings_rad =
        turns.left.iter().zip(&turns.right).map(|(&left, &right)| nominal.increment(Wheels { left, right }).turn_rad);
    let (least, most) =
        headings_rad.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), rad| (least.min(rad), most.max(rad)));
    (most - least).max(0.0)
}

/// What tape measures and walls say, and how many walls there are. Distances from walls count if the run
/// shows them.
fn tape_and_walls(run: &Run, shows_distances: bool) -> (Vec<Timed>, usize) {
    let mut timed = Vec::new();
    for of in &run.revisits {
        let components = [(of.dx_m, of.sigma_xy_m), (of.dy_m, of.sigma_xy_m), (of.dtheta_rad, of.sigma_theta_rad)];
        for (component, (value, sigma)) in components.into_iter().enumerate() {
            timed.extend(value.zip(sigma).map(|(value, sigma)| Timed {
                from_s: of.t0_s,
                to_s: of.t1_s,
                quantity: Quantity::Displacement(component),
                value,
                variance: sigma * sigma,
            }));
        }
    }
    timed.extend(run.distances.iter().map(|of| Timed {
        from_s: of.t0_s,
        to_s: of.t1_s,
        quantity: Quantity::Distance,
        value: of.distance_m,
        variance: of.sigma_m * of.sigma_m,
    }));
    let mut walls: BTreeMap<&str, usize> = BTreeMap::new();
    for of in &run.walls {
        let known = walls.len();
        let wall = *walls.entry(&of.wall).or_insert(known);
        let at = |quantity: Quantity, (value, sigma): (f64, f64)| Timed {
            from_s: of.t_s,
            to_s: of.t_s,
            quantity,
            value,
            variance: sigma * sigma,
        };
        timed.extend(of.heading_rad.zip(of.sigma_rad).map(|measured| at(Quantity::WallHeading(wall), measured)));
        let distance = of.distance_m.zip(of.sigma_m).filter(|_| shows_distances);
        timed.extend(distance.map(|measured| at(Quantity::WallDistance(wall), measured)));
    }
    // A heading in the room is one along a wall of an unknown direction.
    let compass = walls.len();
    timed.extend(run.headings.iter().map(|of| Timed {
        from_s: of.t_s,
        to_s: of.t_s,
        quantity: Quantity::WallHeading(compass),
        value: of.theta_rad,
        variance: of.sigma_rad * of.sigma_rad,
    }));
    (timed, compass + usize::from(!run.headings.is_empty()))
}

/// A session's gyroscope.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GyroSettings {
    stated: GyroNoise,
    /// Angle random walk, rad/√s; `None` where nothing tells it.
    noise_rad_per_sqrt_s: Option<f64>,
}

/// A gyroscope's turn over some rows.
#[derive(Debug, Clone, Copy)]
struct Window {
    from_s: f64,
    to_s: f64,
    turn_rad: f64,
    stands: bool,
}

impl GyroSettings {
    /// Of a session; what is not stated of its noise comes from its standstills, or from how far it strays
    /// from the wheels.
    pub(crate) fn of(session: &Session<'_>, drive: Option<&Model>) -> Self {
        let stated = session.truth_noise.gyro;
        let noise_rad_per_sqrt_s = stated.noise_rad_per_sqrt_s.or_else(|| noise_from_log(session, drive?));
        Self { stated, noise_rad_per_sqrt_s }
    }

    /// The turns of the run by the gyroscope.
    fn windows(&self, run: &RunView<'_>, track: &WheelAngleInterpolator<'_>) -> Vec<Timed> {
        let Some(noise) = self.noise_rad_per_sqrt_s else { return Vec::new() };
        let timed = |window: Window| {
            let dt_s = window.to_s - window.from_s;
            Timed {
                from_s: window.from_s,
                to_s: window.to_s,
                quantity: Quantity::GyroTurn { dt_s },
                value: window.turn_rad,
                variance: noise * noise * dt_s,
            }
        };
        windows(run.run(), track, self.stated.is_instantaneous, PARTIAL.gyro_window_s).into_iter().map(timed).collect()
    }
}

/// The rows of a gyroscope in windows of a length, cut where rows are without a rate: counts that are spoiled
/// and the same put right give the same measurements.
fn windows(run: &Run, track: &WheelAngleInterpolator<'_>, is_instantaneous: bool, longest_s: f64) -> Vec<Window> {
    let Some(rates) = run.gyro_rates() else { return Vec::new() };
    // Rates by their own instants have become means over the rows.
    let is_instantaneous = is_instantaneous && run.gyro.is_empty();
    let (t_s, turns) = (&run.odometry.t_s, track.turns());
    let mut windows: Vec<Window> = Vec::new();
    for row in 1..t_s.len().min(rates.len()) {
        let rate = if is_instantaneous { 0.5 * (rates[row - 1] + rates[row]) } else { rates[row] };
        if !rate.is_finite() {
            continue;
        }
        let [from_s, to_s] = [t_s[row - 1], t_s[row]];
        let stands = turns.left[row] == turns.left[row - 1] && turns.right[row] == turns.right[row - 1];
        let turn_rad = rate * (to_s - from_s);
        match windows.last_mut() {
            Some(last) if last.to_s == from_s && to_s - last.from_s <= longest_s + TIME_TOLERANCE_S => {
                last.to_s = to_s;
                last.turn_rad += turn_rad;
                last.stands &= stands;
            }
            _ => windows.push(Window { from_s, to_s, turn_rad, stands }),
        }
    }
    windows
}

/// Angle random walk of a gyroscope, rad/√s: half of the mean square of how its mean rate changes from row to
/// row while the wheels stand. Where they hardly do, the same of how far it strays from the wheels from
/// window to window, by the median, which holds the wheels' noise too.
fn noise_from_log(session: &Session<'_>, drive: &Model) -> Option<f64> {
    let instantaneous = session.truth_noise.gyro.is_instantaneous;
    let (mut standing, mut moving) = (Vec::new(), Vec::new());
    let measures = |run: &&RunView<'_>| run.run().has_gyro();
    for run in session.runs.iter().filter(measures) {
        let Some(track) = WheelAngleInterpolator::of(run, session.robot) else { continue };
        let rows = windows(run.run(), &track, instantaneous, 0.0);
        let squared = |pair: &[Window], off: [f64; 2]| {
            let [a_s, b_s] = [pair[0].to_s - pair[0].from_s, pair[1].to_s - pair[1].from_s];
            (off[1] / b_s - off[0] / a_s).powi(2) / (1.0 / a_s + 1.0 / b_s)
        };
        let still = rows.windows(2).filter(|pair| pair[0].stands && pair[1].stands);
        standing.extend(still.map(|pair| squared(pair, [pair[0].turn_rad, pair[1].turn_rad])));
        let strays = |window: &Window| {
            let turned = track.steps(window.from_s, window.to_s)?;
            let turned = turned.into_iter().fold(Wheels::both(0.0), |sum, by| sum.zip_with(by, |a, b| a + b));
            Some(window.turn_rad - drive.increment(turned).turn_rad)
        };
        let longer = windows(run.run(), &track, instantaneous, PARTIAL.gyro_window_s);
        moving.extend(longer.windows(2).filter_map(|pair| Some(squared(pair, [strays(&pair[0])?, strays(&pair[1])?]))));
    }
    let variance = if standing.len() >= PARTIAL.min_standing_pairs {
        standing.iter().sum::<f64>() / standing.len() as f64
    } else {
        median(moving)? / COMMON.chi_square_1_median
    };
    Some(variance.sqrt().max(PARTIAL.min_gyro_noise_rad_per_sqrt_s))
}

#[cfg(test)]
mod tests;
