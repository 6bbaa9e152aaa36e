//! The kind of path of each run: what its protocol says, or else what its curvature is like.

use std::collections::BTreeMap;

use dataset::Protocol;
use estimation::{ModelFit, PathShape};

use crate::settings::CARRY_OVER;

/// The kind of every run, by session and run.
pub(crate) fn kinds_of_runs(fit: &ModelFit<'_>) -> BTreeMap<(usize, usize), &'static str> {
    let runs = fit.records.segments.chunk_by(|a, b| a.run == b.run);
    runs.map(|segments| {
        let kind = kind_of(segments[0].info.protocol);
        (segments[0].run, kind.unwrap_or_else(|| by_shape(&PathShape::of(segments, &fit.nominal))))
    })
    .collect()
}

/// The kind of path of a protocol; `None` for what a path is like, which its curvature tells.
const fn kind_of(protocol: Option<Protocol>) -> Option<&'static str> {
    match protocol {
        Some(Protocol::Straight) => Some("straight"),
        Some(Protocol::Spin) => Some("spin"),
        Some(Protocol::SquareCw | Protocol::SquareCcw) => Some("square"),
        Some(Protocol::CircleCw | Protocol::CircleCcw) => Some("circle"),
        Some(Protocol::Path | Protocol::Free) | None => None,
    }
}

/// The kind of a path by how it turns.
fn by_shape(shape: &PathShape) -> &'static str {
    // Travel of the wheels against each other over that along.
    let turns = shape.turn_travel_m / shape.distance_m.max(f64::MIN_POSITIVE);
    if turns > CARRY_OVER.min_spin_turn_ratio {
        "spin"
    } else if turns < CARRY_OVER.max_straight_turn_ratio {
        "straight"
    } else if shape.net_turn_share > CARRY_OVER.one_sense_share
        && shape.curvature_spread < CARRY_OVER.constant_curvature_spread
    {
        "circle"
    } else {
        "mixed"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_of_the_kind_of_its_curvature() {
        let shape = |turn_travel_m, net_turn_share, curvature_spread| PathShape {
            distance_m: 10.0,
            turn_travel_m,
            net_turn_share,
            curvature_spread,
        };
        assert_eq!(by_shape(&shape(100.0, 1.0, 0.0)), "spin");
        assert_eq!(by_shape(&shape(0.1, 1.0, 0.0)), "straight");
        assert_eq!(by_shape(&shape(2.0, 1.0, 0.1)), "circle");
        // A square turns one way as well, but in its corners alone.
        assert_eq!(by_shape(&shape(2.0, 1.0, 2.0)), "mixed");
        assert_eq!(by_shape(&shape(2.0, 0.1, 0.1)), "mixed");
    }
}
