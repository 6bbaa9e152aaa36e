//! What a path was like, by the counts.

use kinematics::{Increment, Wheels};

use crate::model::Model;
use crate::segment::Segment;

/// How far a robot went and how it turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathShape {
    /// Distance of the centre, metres.
    pub distance_m: f64,
    /// Travel of the wheels against each other: half of their difference, either way, metres.
    pub turn_travel_m: f64,
    /// Turn from start to end over all turns, either way.
    pub net_turn_share: f64,
    /// Standard deviation of the curvature along the path over its mean.
    pub curvature_spread: f64,
}

impl PathShape {
    /// Of segments, by a model, in stretches as long as the wheels are apart.
    #[must_use]
    pub fn of(segments: &[Segment<'_>], model: &Model) -> Self {
        let (mut distance_m, mut turned_rad, mut net_rad) = (0.0, 0.0, 0.0);
        // Length and turn of each stretch.
        let mut stretches: Vec<(f64, f64)> = Vec::new();
        let mut open = (0.0, 0.0);
        for interval in segments.iter().flat_map(|segment| &segment.intervals) {
            let travel_m: Wheels<f64> = model.m_per_rad.zip_with(interval.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
            let Increment { distance_m: along_m, turn_rad } = Increment::from_travel(travel_m, model.separation_m);
            distance_m += along_m.abs();
            turned_rad += turn_rad.abs();
            net_rad += turn_rad;
            open = (open.0 + along_m.abs(), open.1 + turn_rad);
            if open.0 >= model.separation_m {
                stretches.push(std::mem::take(&mut open));
            }
        }
        let length_m: f64 = stretches.iter().map(|(length_m, _)| length_m).sum();
        let mean = stretches.iter().map(|(_, turn_rad)| turn_rad).sum::<f64>() / length_m.max(f64::MIN_POSITIVE);
        let squares: f64 =
            stretches.iter().map(|(length_m, turn_rad)| length_m * (turn_rad / length_m - mean).powi(2)).sum();
        let spread = (squares / length_m.max(f64::MIN_POSITIVE)).sqrt();
        Self {
            distance_m,
            turn_travel_m: 0.5 * model.separation_m * turned_rad,
            net_turn_share: if turned_rad > 0.0 { net_rad.abs() / turned_rad } else { 0.0 },
            curvature_spread: if mean == 0.0 { f64::INFINITY } else { spread / mean.abs() },
        }
    }
}
