//! `truth_map_scale`: the outside instrument's map is larger or smaller than the room.
//!
//! Model: seen position = (1 + s) true position, about the map's origin; headings are right.
//! Signature: e_dx = s v with e_dθ = 0: all lengths of the path in proportion, and no angle.
//! Observability: a length that comes from elsewhere: a run with tape-measured distances (`distance.csv`) or
//! walls (`wall.csv`) beside the runs with poses.
//! Alias: `wheel_scale` and `wheelbase` together, exactly, on every path: poses of the map alone determine
//! the robot in the map's metres.
//! Reference: Umeyama 1991 (similarity of two point sets); Kümmerle et al. 2009 (errors of maps of
//! simultaneous localization and mapping).

use dataset::RunInfo;
use kinematics::{Point, Pose, sin_cos};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, Needs};
use crate::description::{Description, Excitation, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "the instrument's map has the wrong scale";

/// Scale of the outside instrument's map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthMapScale {
    /// Relative error of the map's lengths (s): seen over true, less 1.
    pub scale_error: f64,
}

impl PhysicalEffect for TruthMapScale {
    fn check(&self) -> Result<(), EffectError> {
        let scale_error = self.scale_error;
        EffectError::unless(
            scale_error.is_finite() && scale_error > -1.0,
            "truth_map_scale",
            "scale_error",
            scale_error,
            "larger than -1",
        )
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term::default()))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                Statement::of(MEANING, values.with_direction("scale_error", 100.0, "%", "too large", "too small"))
            }),
            excitation: Excitation::Conditions("measure a straight by tape, in a run without poses (distance.csv)"),
            benchmark: Benchmark { needs: Needs { others: true, ..Needs::NONE }, ..Benchmark::OF_MEAN },
            on_board: OnBoard::OfInstrument,
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { scale_error: value_of(values, "scale_error")? })
    }

    fn needs_distances(&self) -> bool {
        true
    }
}

struct State {
    effect: TruthMapScale,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { instrument: true, ..Hooks::NONE }
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        let scale = 1.0 + self.effect.scale_error;
        reading.world_from_body.x_m *= scale;
        reading.world_from_body.y_m *= scale;
    }
}

/// The position that the counts have added up since the run's start. Where the map's origin is does not
/// matter: a start pose is estimated. The measured positions are not taken for it: what they were corrected
/// by is noise, and would pass for information on the scale.
#[derive(Clone, Default)]
struct Term {
    driven: Point,
}

impl ModelTerm for Term {
    /// Plausible: 1 %, a map from wheels or from a lidar that is not calibrated.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "scale_error", unit: "1", prior_sigma: 0.01 }]
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.driven = Point::default();
    }

    fn motion(&mut self, interval: &Interval<'_>, _gradient: &mut [Pose]) {
        let moved = interval.increment().arc();
        let (sin, cos) = sin_cos(interval.world_from_body.theta_rad);
        self.driven.x_m += cos * moved.x_m - sin * moved.y_m;
        self.driven.y_m += sin * moved.x_m + cos * moved.y_m;
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        let (sin, cos) = sin_cos(measurement.world_from_body.theta_rad);
        let Point { x_m, y_m } = self.driven;
        gradient[0] = Pose::new(cos * x_m + sin * y_m, cos * y_m - sin * x_m, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_scaled_and_headings_are_not() {
        let mut state = State { effect: TruthMapScale { scale_error: 0.25 } };
        let mut reading = PoseReading { t_s: 0.0, world_from_body: Pose::new(2.0, -4.0, 0.5) };
        state.instrument(&mut reading);
        assert_eq!(reading.world_from_body, Pose::new(2.5, -5.0, 0.5));
    }
}
