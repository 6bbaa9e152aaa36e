//! `bumps`: cables, sills and crumbs that one wheel drives over.
//!
//! Model: each wheel meets bumps as a Poisson process along its path; over a bump of height h a wheel of
//! radius r rolls about its edge and loses 2(r acos(1−h/r) − √(2rh−h²)) of distance.
//! Signature: isolated spikes of e_dθ, kurtosis.
//! Observability: many measurements.
//! Alias: `traction_loss`.
//! Reference: Borenstein & Feng 1995, whose test floor has ten cables of 9 to 10 mm; the loss is geometry of
//! a rigid wheel.

use kinematics::{Side, Wheels};
use model_term::Interval;
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, HostRobot, ParameterValue};
use crate::description::{Description, IsolatedError};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Sign, value_of};
use crate::on_board::{Code, IntervalScatter, OnBoard, Scatter, ScatterModel};
use crate::stream::Stream;

/// Height of a bump of scale 1 in the blind benchmark, metres.
const LARGE_HEIGHT_M: f64 = 3e-3;
/// Scales of the distance that a wheel loses over a bump, metres: from what no instrument shows to a sill.
const LOSS_SCALES_M: [f64; 6] = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2];

/// [`lost_m`] in C.
const LOST_M: &str = "\
/* Distance that a wheel loses over a bump. */
static inline double yair_lost_over_bump(double radius_m, double height_m) {
    const double h = fmin(height_m, radius_m);
    return 2.0 * (radius_m * acos(1.0 - h / radius_m) - sqrt(h * (2.0 * radius_m - h)));
}
";

/// What a robot's own odometry adds to its covariance: the variance of a compound Poisson process. The mean
/// loss is in the calibrated wheels.
const ON_BOARD: OnBoard = OnBoard::CovarianceOnly(Scatter {
    of: "bumps that each wheel meets, in proportion to its travel",
    code: Code {
        remembers: &[],
        functions: &[LOST_M],
        statements: "\
const double left_lost_m = yair_lost_over_bump(left_radius_m, height_m);
const double right_lost_m = yair_lost_over_bump(right_radius_m, height_m);
left_var_m2 += per_m * left_lost_m * left_lost_m * fabs(left_m);
right_var_m2 += per_m * right_lost_m * right_lost_m * fabs(right_m);",
    },
    model: |size| Box::new(Met { per_m: size("per_m"), height_m: size("height_m") }),
});

struct Met {
    per_m: f64,
    height_m: f64,
}

impl ScatterModel for Met {
    fn after(&mut self, interval: &Interval<'_>, scatter: &mut IntervalScatter) {
        for side in Side::BOTH {
            let turned_rad = interval.turned_rad[side];
            if turned_rad != 0.0 {
                let lost_m = lost_m(interval.travel_m[side] / turned_rad, self.height_m);
                scatter.travel_var_m2[side] += self.per_m * lost_m * lost_m * interval.travel_m[side].abs();
            }
        }
    }
}

/// Bumps on the floor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bumps {
    /// How many each wheel meets per metre of its travel, on average.
    pub per_m: f64,
    /// Height of a bump (h), metres.
    pub height_m: f64,
}

impl PhysicalEffect for Bumps {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_negative("bumps", [("per_m", self.per_m), ("height_m", self.height_m)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None, ahead_m: Wheels::both(f64::INFINITY) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Scatter(&[Sign::HeadingJumps])
    }

    fn description() -> Description {
        Description {
            isolated_error: Some(IsolatedError::LostOnTheWay { scales_m: &LOSS_SCALES_M }),
            benchmark: Benchmark {
                ..Benchmark::of_scatter(|_, stream| {
                    (vec![("height_m", LARGE_HEIGHT_M)], vec![("per_m", stream.log_uniform(0.1, 1.0))])
                })
            },
            on_board: ON_BOARD,
            ..Description::of("a wheel drives over cables, sills or crumbs")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { per_m: value_of(values, "per_m")?, height_m: value_of(values, "height_m")? })
    }

    /// What a bump costs grows with the power 3/2 of its height.
    fn at_scale(values: &[ParameterValue], scale: f64, _: &HostRobot) -> Option<Self> {
        Some(Self { per_m: value_of(values, "per_m")?, height_m: LARGE_HEIGHT_M * scale.powf(2.0 / 3.0) })
    }
}

struct State {
    effect: Bumps,
    stream: Option<Stream>,
    /// Way to the next bump of each wheel, metres.
    ahead_m: Wheels<f64>,
}

/// Way that a wheel loses over a bump, metres; one as high as the wheel's axis is a wall, and counts as that
/// high.
fn lost_m(radius_m: f64, height_m: f64) -> f64 {
    let height_m = height_m.min(radius_m);
    2.0 * (radius_m * (1.0 - height_m / radius_m).acos() - (height_m * (2.0 * radius_m - height_m)).sqrt())
}

/// The distance to the next event of a Poisson process.
fn gap_m(stream: &mut Stream, per_m: f64) -> f64 {
    -(1.0 - stream.uniform()).ln() / per_m
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, floor: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, mut stream: Stream) {
        self.ahead_m = Wheels::from_sides(|_| gap_m(&mut stream, self.effect.per_m));
        self.stream = Some(stream);
    }

    fn floor(&mut self, step: &mut Step) {
        let Some(stream) = &mut self.stream else { return };
        for side in Side::BOTH {
            let travel_m = step.travel_m[side];
            self.ahead_m[side] -= travel_m.abs();
            while self.ahead_m[side] < 0.0 {
                self.ahead_m[side] += gap_m(stream, self.effect.per_m);
                step.travel_m[side] -= travel_m.signum() * lost_m(step.radius_m[side], self.effect.height_m);
            }
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("a bump turns the robot where it lies")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use crate::{Address, StreamName};

    #[test]
    fn a_bump_costs_what_rolling_about_its_edge_costs() {
        // To second order (2√2/3) r (h/r)^{3/2}, less a share of order h/r.
        let r = 0.08_f64;
        for height_m in [1e-4_f64, 1e-3] {
            let leading_m = 8.0_f64.sqrt() / 3.0 * r * (height_m / r).powf(1.5);
            assert!((lost_m(r, height_m) / leading_m - 1.0).abs() < height_m / r);
        }
        assert!((lost_m(r, 0.01) - 3.5e-3).abs() < 0.5e-3, "millimetres for UMBmark's cables");
        assert_eq!(lost_m(r, 0.0), 0.0);
    }

    #[test]
    fn wheels_meet_the_stated_number_each() {
        let effect = Bumps { per_m: 2.0, height_m: 0.005 };
        let mut state = effect.forward().expect("acts on the floor");
        state.seed_run(Address { seed: 4, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        let (mut met, distance_m) = (Wheels::both(0.0), 5000.0);
        for _ in 0..50_000 {
            let mut step = specimen_step();
            step.travel_m = Wheels::both(-distance_m / 50_000.0);
            let before_m = step.travel_m;
            state.floor(&mut step);
            let lost = lost_m(0.08, 0.005);
            met = Wheels::from_sides(|side| met[side] + (step.travel_m[side] - before_m[side]) / lost);
        }
        // A Poisson number of 10 000: five standard deviations are 500. A loss in the wrong direction would
        // count negative.
        for side in Side::BOTH {
            assert!((met[side] - 2.0 * distance_m).abs() < 5.0 * (2.0 * distance_m).sqrt(), "{met:?}");
        }
    }
}
