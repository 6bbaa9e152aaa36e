//! `truth_correlated_noise`: the outside instrument's errors resemble those of a moment before.
//!
//! Model: a Gauss–Markov process in time beside each coordinate, corr = e^{−Δt/τ}, stationary from the first
//! measurement on.
//! Signature: residuals that are correlated with no cause in the wheels.
//! Observability: measurements closer than τ.
//! Alias: any slow effect, over one run.
//! Reference: Ornstein & Uhlenbeck 1930; filters inside trackers, thermal drift of cameras, scan matching
//! against the same wall.

use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, Sign, value_of};
use crate::on_board::OnBoard;
use crate::stream::Stream;

/// Errors of the outside instrument that last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthCorrelatedNoise {
    /// Standard deviation along each axis, metres.
    pub sigma_xy_m: f64,
    /// Standard deviation of the heading, radians.
    pub sigma_theta_rad: f64,
    /// Time over which an error is forgotten by 1/e (τ), seconds.
    pub tau_s: f64,
}

impl PhysicalEffect for TruthCorrelatedNoise {
    fn check(&self) -> Result<(), EffectError> {
        let id = "truth_correlated_noise";
        EffectError::unless_negative(id, [("sigma_xy_m", self.sigma_xy_m), ("sigma_theta_rad", self.sigma_theta_rad)])?;
        EffectError::unless_positive(id, [("tau_s", self.tau_s)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None, error: [0.0; 3], at_s: 0.0 }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Scatter(&[Sign::AutocorrelatedErrors])
    }

    fn description() -> Description {
        Description {
            summary: Summary::Meaning,
            benchmark: Benchmark::of_scatter(|_, stream| {
                (vec![("sigma_xy_m", 1e-3), ("sigma_theta_rad", 1e-3)], vec![("tau_s", stream.log_uniform(0.3, 3.0))])
            }),
            on_board: OnBoard::OfInstrument,
            ..Description::of(
                "the instrument's errors are autocorrelated: it is less precise than its single measurements seem",
            )
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (sigma_xy_m, sigma_theta_rad) = (value_of(values, "sigma_xy_m")?, value_of(values, "sigma_theta_rad")?);
        Some(Self { sigma_xy_m, sigma_theta_rad, tau_s: value_of(values, "tau_s")? })
    }
}

struct State {
    effect: TruthCorrelatedNoise,
    stream: Option<Stream>,
    /// The errors of x, y and θ over their standard deviations, and when they were so.
    error: [f64; 3],
    at_s: f64,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, instrument: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, mut stream: Stream) {
        self.error = std::array::from_fn(|_| stream.normal());
        self.at_s = 0.0;
        self.stream = Some(stream);
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        let Some(stream) = &mut self.stream else { return };
        let kept = (-(reading.t_s - self.at_s).abs() / self.effect.tau_s).exp();
        let fresh = (1.0 - kept * kept).sqrt();
        self.error = self.error.map(|error| kept * error + fresh * stream.normal());
        self.at_s = reading.t_s;
        let [x, y, theta] = self.error;
        reading.world_from_body.x_m += self.effect.sigma_xy_m * x;
        reading.world_from_body.y_m += self.effect.sigma_xy_m * y;
        reading.world_from_body.theta_rad += self.effect.sigma_theta_rad * theta;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};
    use kinematics::Pose;

    #[test]
    fn errors_have_the_stated_size_and_memory_however_often_it_measures() {
        let effect = TruthCorrelatedNoise { sigma_xy_m: 0.01, sigma_theta_rad: 0.02, tau_s: 2.0 };
        for measurements in [1_u32, 8] {
            let (n, mut squares, mut products, mut thetas) = (4000_u32, 0.0, 0.0, 0.0);
            for run in 0..n {
                let mut state = effect.forward().expect("acts on sightings");
                let address = Address { seed: 3, point: 0, trial: u64::from(run), run: 0 };
                state.seed_run(address.stream(StreamName::new("test")));
                let mut see = |t_s: f64| {
                    let mut reading = PoseReading { t_s, world_from_body: Pose::IDENTITY };
                    state.instrument(&mut reading);
                    reading.world_from_body
                };
                let before = see(0.0);
                let mut after = before;
                for measurement in 1..=measurements {
                    after = see(2.0 * f64::from(measurement) / f64::from(measurements));
                }
                squares += (after.x_m / 0.01).powi(2);
                thetas += (after.theta_rad / 0.02).powi(2);
                products += before.x_m * after.x_m / 1e-4;
            }
            let n = f64::from(n);
            // Five standard errors of a variance, √(2/n), and at most that of a covariance; one τ apart the
            // correlation is 1/e.
            let allowed = 5.0 * (2.0 / n).sqrt();
            for (moment, expected) in [(squares, 1.0), (thetas, 1.0), (products, (-1.0_f64).exp())] {
                assert!((moment / n - expected).abs() < allowed, "{measurements}: {}", moment / n);
            }
        }
    }
}
