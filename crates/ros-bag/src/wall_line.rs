//! Straight walls in the points of a scan.
//!
//! The line with the most points within a tolerance is sought among lines through pairs of points (Fischler
//! & Bolles 1981), whose indices follow a sequence of low discrepancy: the same scan gives the same lines.
//! Its points without a gap between them are fitted by total least squares (Arras & Siegwart 1997, eqs. 4
//! and 5): the direction is that of the larger principal axis of their scatter, through their mean. With sᵢ
//! along the line from the mean, eᵢ across it and S = Σ sᵢ², the direction is off by Σ sᵢ eᵢ / S and the
//! distance at the foot of the perpendicular, s̄ from the mean, by Σ (1/N + s̄ sᵢ / S) eᵢ. The variances
//! are the sums of the squares of these terms times N / (N − 2) (White 1980; MacKinnon & White 1985, HC1):
//! the noise of ranges need not be known, nor the same at all incidences.

use dataset::median;

use crate::settings::{
    MAX_WALL_GAP_M, MAX_WALLS_PER_SCAN, MIN_PAIR_M, MIN_WALL_BEAMS, MIN_WALL_LENGTH_M, MIN_WALL_SHARE,
    MIN_WALL_SIGMA_M, MIN_WALL_SIGMA_RAD, MIN_WALL_TOLERANCE_M, WALL_PAIRS, WALL_REFITS, WALL_TOLERANCE_M,
    WALL_TOLERANCE_SIGMAS,
};

/// Standard deviation of a normal variable over the median of its absolute value.
const MAD_TO_SIGMA: f64 = 1.4826;

/// A point in the lidar's frame at the stamp of the scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ScanPoint {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    /// When it was measured, since the stamp, seconds.
    pub(crate) after_s: f64,
}

/// A straight wall as it is seen at the stamp of the scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WallLine {
    /// Heading of the lidar along the wall, which is on the left at 0, radians.
    pub(crate) heading_rad: f64,
    /// Perpendicular distance from the lidar, metres.
    pub(crate) distance_m: f64,
    pub(crate) sigma_rad: f64,
    pub(crate) sigma_m: f64,
    /// Mean time of its points, since the stamp, seconds.
    pub(crate) after_s: f64,
}

/// A line n·p = `offset_m` with the unit vector n.
#[derive(Debug, Clone, Copy)]
struct Line {
    normal: [f64; 2],
    offset_m: f64,
}

impl Line {
    fn through(a: ScanPoint, b: ScanPoint) -> Option<Self> {
        let (dx_m, dy_m) = (b.x_m - a.x_m, b.y_m - a.y_m);
        let length_m = dx_m.hypot(dy_m);
        let normal = [-dy_m / length_m, dx_m / length_m];
        (length_m >= MIN_PAIR_M).then(|| Self { normal, offset_m: normal[0] * a.x_m + normal[1] * a.y_m })
    }

    fn across_m(&self, point: &ScanPoint) -> f64 {
        self.normal[0] * point.x_m + self.normal[1] * point.y_m - self.offset_m
    }

    fn along_m(&self, point: &ScanPoint) -> f64 {
        self.normal[1] * point.x_m - self.normal[0] * point.y_m
    }

    /// Total least squares; the normal points away from the lidar.
    fn fitted(points: &[ScanPoint]) -> Option<Self> {
        let count = points.len() as f64;
        let mean = |of: fn(&ScanPoint) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (x_m, y_m) = (mean(|point| point.x_m), mean(|point| point.y_m));
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for point in points {
            let (dx_m, dy_m) = (point.x_m - x_m, point.y_m - y_m);
            (xx, xy, yy) = (xx + dx_m * dx_m, xy + dx_m * dy_m, yy + dy_m * dy_m);
        }
        let (sin, cos) = (0.5 * f64::atan2(2.0 * xy, xx - yy)).sin_cos();
        let side = if cos * y_m < sin * x_m { -1.0 } else { 1.0 };
        let normal = [-side * sin, side * cos];
        let offset_m = normal[0] * x_m + normal[1] * y_m;
        offset_m.is_finite().then_some(Self { normal, offset_m })
    }
}

/// The walls of a scan, those with the most points first.
pub(crate) fn walls(points: &[ScanPoint]) -> Vec<WallLine> {
    let least = MIN_WALL_BEAMS.max((MIN_WALL_SHARE * points.len() as f64).ceil() as usize);
    let mut left = points.to_vec();
    let mut found = Vec::new();
    while found.len() < MAX_WALLS_PER_SCAN && left.len() >= least {
        let Some(line) = most_supported(&left) else { break };
        let Some((line, inliers)) = refined(line, &left) else { break };
        if inliers.len() < least {
            break;
        }
        found.extend(measured(&line, &inliers));
        left.retain(|point| line.across_m(point).abs() > WALL_TOLERANCE_M);
    }
    found
}

/// The line through two points that most points are near to.
fn most_supported(points: &[ScanPoint]) -> Option<Line> {
    // The additive recurrence of the plastic number ρ, 1/ρ and 1/ρ² (Roberts 2018).
    let index = |number: u32, step: f64| {
        let share = (0.5 + f64::from(number) * step).fract();
        points.get((share * points.len() as f64) as usize).copied()
    };
    let line =
        |number: u32| Line::through(index(number, 0.754_877_666_246_693)?, index(number, 0.569_840_290_998_053)?);
    let support = |line: &Line| points.iter().filter(|point| line.across_m(point).abs() <= WALL_TOLERANCE_M).count();
    let lines = (1..=WALL_PAIRS).filter_map(line).map(|line| (support(&line), line));
    // Of lines with the same support the first.
    lines.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, line)| line)
}

/// The line fitted to the points near it, with a tolerance by their own scatter, and these points.
fn refined(mut line: Line, points: &[ScanPoint]) -> Option<(Line, Vec<ScanPoint>)> {
    let mut tolerance_m = WALL_TOLERANCE_M;
    let mut inliers = Vec::new();
    for _ in 0..WALL_REFITS {
        let near = points.iter().filter(|point| line.across_m(point).abs() <= tolerance_m).copied().collect();
        inliers = longest_piece(&line, near);
        line = Line::fitted(&inliers)?;
        let median_m = median(inliers.iter().map(|point| line.across_m(point).abs()))?;
        let by_scatter_m = WALL_TOLERANCE_SIGMAS * MAD_TO_SIGMA * median_m;
        tolerance_m = by_scatter_m.clamp(MIN_WALL_TOLERANCE_M, WALL_TOLERANCE_M);
    }
    Some((line, inliers))
}

/// The most points without a gap between them.
fn longest_piece(line: &Line, mut points: Vec<ScanPoint>) -> Vec<ScanPoint> {
    points.sort_by(|a, b| line.along_m(a).total_cmp(&line.along_m(b)));
    let pieces = points.chunk_by(|a, b| line.along_m(b) - line.along_m(a) <= MAX_WALL_GAP_M);
    pieces.max_by_key(|piece| piece.len()).map(<[ScanPoint]>::to_vec).unwrap_or_default()
}

/// Heading and distance with their standard deviations; none of a line that is too short, or that goes
/// through the lidar.
fn measured(line: &Line, points: &[ScanPoint]) -> Option<WallLine> {
    let count = points.len() as f64;
    let along = || points.iter().map(|point| line.along_m(point));
    let mean_m = along().sum::<f64>() / count;
    let (least_m, most_m) = along().fold((f64::MAX, f64::MIN), |(a, b), s_m| (a.min(s_m), b.max(s_m)));
    let scatter = along().map(|s_m| (s_m - mean_m).powi(2)).sum::<f64>();
    if most_m - least_m < MIN_WALL_LENGTH_M || line.offset_m < MIN_PAIR_M {
        return None;
    }
    let (mut var_rad2, mut var_m2) = (0.0, 0.0);
    for point in points {
        let (s_m, e_m) = (line.along_m(point) - mean_m, line.across_m(point));
        var_rad2 += (s_m * e_m / scatter).powi(2);
        // The foot of the perpendicular has along_m = 0.
        var_m2 += ((count.recip() - mean_m * s_m / scatter) * e_m).powi(2);
    }
    let few = count / (count - 2.0);
    let [nx, ny] = line.normal;
    Some(WallLine {
        // The wall's direction is a quarter turn clockwise of the normal, (ny, −nx).
        heading_rad: f64::atan2(nx, ny),
        distance_m: line.offset_m,
        sigma_rad: (few * var_rad2).sqrt().max(MIN_WALL_SIGMA_RAD),
        sigma_m: (few * var_m2).sqrt().max(MIN_WALL_SIGMA_M),
        after_s: points.iter().map(|point| point.after_s).sum::<f64>() / count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors of unit variance that look random, of a number of their own.
    fn error(number: f64) -> f64 {
        let uniform = (12.9898 * number).sin() * 43_758.545_3;
        12.0_f64.sqrt() * (uniform - uniform.floor() - 0.5)
    }

    /// What a lidar sees of a wall 2 m away at a heading, with noise of `sigma_m` and clutter at every fifth
    /// beam.
    fn scan(heading_rad: f64, sigma_m: f64, seed: f64) -> Vec<ScanPoint> {
        let beam = |number: u32| {
            let angle_rad = f64::from(number).to_radians();
            // The wall's normal stands a quarter turn to the left of its direction.
            let incidence_rad = angle_rad + heading_rad - std::f64::consts::FRAC_PI_2;
            let seed = seed + f64::from(number);
            let range_m = match 2.0 / incidence_rad.cos() {
                _ if number.is_multiple_of(5) => 1.2 + 0.4 * error(seed).abs(),
                range_m if (2.0..5.0).contains(&range_m) => range_m + sigma_m * error(seed),
                _ => 3.0 + 0.7 * error(seed),
            };
            ScanPoint {
                x_m: range_m * angle_rad.cos(),
                y_m: range_m * angle_rad.sin(),
                after_s: 1e-3 * f64::from(number),
            }
        };
        (0..360).map(beam).collect()
    }

    #[test]
    fn a_wall_among_clutter_is_found_at_every_heading_and_its_errors_are_as_stated() {
        let (mut of_heading, mut of_distance, mut count) = (0.0, 0.0, 0.0);
        for number in 0..200 {
            let heading_rad = 0.031 * f64::from(number) - 3.1;
            let found = walls(&scan(heading_rad, 0.02, 1000.0 * f64::from(number)));
            let wall = found.first().expect("a wall");
            let z_rad = kinematics::wrap_to_pi(wall.heading_rad - heading_rad) / wall.sigma_rad;
            let z_m = (wall.distance_m - 2.0) / wall.sigma_m;
            // At 2 cm both standard deviations are above their least values. Clutter that happens to lie on
            // the wall's line is a part of it.
            assert!(z_rad.abs() < 6.0 && z_m.abs() < 6.0, "{heading_rad}: {wall:?}");
            (of_heading, of_distance, count) = (of_heading + z_rad * z_rad, of_distance + z_m * z_m, count + 1.0);
        }
        // The mean of 200 squares is 1 ± 0.1; clutter near the line and trimming move it by more.
        // Rejects a variance that is three times too small or too large.
        for mean_square in [of_heading / count, of_distance / count] {
            assert!((0.6..1.7).contains(&mean_square), "{of_heading} {of_distance} of {count}");
        }
    }

    #[test]
    fn a_scan_without_a_wall_gives_none() {
        let cloud: Vec<ScanPoint> = (0..400)
            .map(|k| {
                let (x_m, y_m) = (1.5 * error(f64::from(k)), 1.5 * error(0.5 + f64::from(k)));
                ScanPoint { x_m, y_m, after_s: 0.0 }
            })
            .collect();
        assert_eq!(walls(&cloud), []);
        assert_eq!(walls(&[]), []);
        // Half a metre of a straight edge is a box.
        let edge: Vec<ScanPoint> =
            (0..100).map(|k| ScanPoint { x_m: 1.0, y_m: 0.005 * f64::from(k), after_s: 0.0 }).collect();
        assert_eq!(walls(&edge), []);
    }
}
