//! `truth_outliers`: now and then the outside instrument takes the robot to be where it is not.
//!
//! Model: every measurement is displaced with probability p, by N(0, jump_m²) along each of x and y, so that
//! the direction is uniform and the distance √(π/2) jump_m on average, and by N(0, jump_rad²) in heading;
//! measurements are independent. All marks that are read of a standing robot are one measurement.
//! Signature: an isolated jump in one sample, undone in the next; a run between two readings is off by one
//! jump, or two.
//! Observability: redundant readings, of which most agree.
//! Alias: `traction_loss` and bumps, which are not undone.
//! Reference: Tukey 1960 and Huber 1964, a normal distribution contaminated by one of larger variance; scan
//! matching that locks on to the wrong place, swapped markers, a mark read off the wrong line.

use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, IsolatedError, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, Sign, value_of};
use crate::on_board::OnBoard;
use crate::stream::Stream;

/// Gross errors of the outside instrument.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthOutliers {
    /// Probability that a measurement is displaced.
    pub probability: f64,
    /// Standard deviation of the displacement along each axis, metres.
    pub jump_m: f64,
    /// Standard deviation of the displacement in heading, radians.
    pub jump_rad: f64,
}

impl PhysicalEffect for TruthOutliers {
    fn check(&self) -> Result<(), EffectError> {
        let id = "truth_outliers";
        let probability = self.probability;
        EffectError::unless((0.0..=1.0).contains(&probability), id, "probability", probability, "from 0 to 1")?;
        let jump = |parameter, value: f64| {
            EffectError::unless(value.is_finite() && value >= 0.0, id, parameter, value, "0 or more")
        };
        jump("jump_m", self.jump_m)?;
        jump("jump_rad", self.jump_rad)
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Scatter(&[Sign::IsolatedErrors])
    }

    fn description() -> Description {
        Description {
            summary: Summary::Meaning,
            isolated_error: Some(IsolatedError::OfInstrument),
            benchmark: Benchmark::of_scatter(|_, stream| {
                (vec![("jump_m", 0.02), ("jump_rad", 0.02)], vec![("probability", stream.log_uniform(0.003, 0.03))])
            }),
            on_board: OnBoard::OfInstrument,
            ..Description::of("single measurements of the instrument are outliers")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (jump_m, jump_rad) = (value_of(values, "jump_m")?, value_of(values, "jump_rad")?);
        Some(Self { probability: value_of(values, "probability")?, jump_m, jump_rad })
    }
}

struct State {
    effect: TruthOutliers,
    stream: Option<Stream>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, instrument: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        self.stream = Some(stream);
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        let Some(stream) = &mut self.stream else { return };
        // Drawn for every measurement: at a larger probability the same measurements jump as at a smaller
        // one, by the same, and others too.
        let (uniform, jump) = (stream.uniform(), [stream.normal(), stream.normal(), stream.normal()]);
        if uniform < self.effect.probability {
            reading.world_from_body.x_m += self.effect.jump_m * jump[0];
            reading.world_from_body.y_m += self.effect.jump_m * jump[1];
            reading.world_from_body.theta_rad += self.effect.jump_rad * jump[2];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};
    use kinematics::Pose;

    const HERE: Pose = Pose::new(1.0, -2.0, 0.5);

    /// How far each of `n` measurements of one run is displaced.
    fn mahalanobis_distance(effect: TruthOutliers, n: u32) -> Vec<Pose> {
        let mut state = effect.forward().expect("acts on sightings");
        state.seed_run(Address { seed: 8, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        (0..n)
            .map(|k| {
                let mut reading = PoseReading { t_s: f64::from(k), world_from_body: HERE };
                state.instrument(&mut reading);
                let seen = reading.world_from_body;
                Pose::new(seen.x_m - HERE.x_m, seen.y_m - HERE.y_m, seen.theta_rad - HERE.theta_rad)
            })
            .collect()
    }

    #[test]
    fn the_stated_share_of_measurements_jumps_by_the_stated_sizes() {
        let effect = TruthOutliers { probability: 0.2, jump_m: 0.03, jump_rad: 0.1 };
        let n = 40_000;
        let all = mahalanobis_distance(effect, n);
        let jumped: Vec<&Pose> = all.iter().filter(|pose| **pose != Pose::IDENTITY).collect();
        let (share, m) = (jumped.len() as f64 / f64::from(n), jumped.len() as f64);
        // Standard errors √(p(1−p)/n), and of a variance √(2/m), of a covariance 1/√m; at 5 of each, seven
        // numbers raise a false positive once in 2e5 seeds. Rejected: an isotropic jump of that *length*
        // (half the variance) and a heading that jumps together with x.
        assert!((share - 0.2).abs() < 5.0 * (0.2_f64 * 0.8 / f64::from(n)).sqrt());
        let moment = |of: &dyn Fn(&Pose) -> f64| jumped.iter().map(|pose| of(pose)).sum::<f64>() / m;
        let of: [fn(&Pose) -> f64; 3] = [|pose| pose.x_m / 0.03, |pose| pose.y_m / 0.03, |pose| pose.theta_rad / 0.1];
        for (k, a) in of.iter().enumerate() {
            assert!((moment(&|pose| a(pose) * a(pose)) - 1.0).abs() < 5.0 * (2.0 / m).sqrt(), "{k}");
            for b in &of[..k] {
                assert!(moment(&|pose| a(pose) * b(pose)).abs() < 5.0 / m.sqrt(), "{k}");
            }
        }
    }

    #[test]
    fn a_jump_is_undone_in_the_next_measurement() {
        let all = mahalanobis_distance(TruthOutliers { probability: 0.1, jump_m: 0.03, jump_rad: 0.0 }, 200);
        let jumped = |pose: &Pose| *pose != Pose::IDENTITY;
        assert!(all.windows(2).any(|pair| jumped(&pair[0]) && !jumped(&pair[1])));
    }

    #[test]
    fn more_outliers_are_the_same_ones_and_others() {
        let [few, many] = [0.05, 0.3]
            .map(|probability| mahalanobis_distance(TruthOutliers { probability, jump_m: 0.03, jump_rad: 0.1 }, 500));
        let jumped = |poses: &[Pose]| poses.iter().filter(|pose| **pose != Pose::IDENTITY).count();
        assert!(jumped(&few) > 0 && jumped(&many) > jumped(&few));
        for (few, many) in few.iter().zip(&many).filter(|(few, _)| **few != Pose::IDENTITY) {
            assert_eq!(few, many);
        }
    }

    #[test]
    fn every_size_has_its_range() {
        let fine = TruthOutliers { probability: 1.0, jump_m: 0.0, jump_rad: 0.0 };
        assert_eq!(fine.check(), Ok(()));
        for (wrong, parameter) in [
            (TruthOutliers { probability: 1.1, ..fine }, "probability"),
            (TruthOutliers { probability: f64::NAN, ..fine }, "probability"),
            (TruthOutliers { jump_m: -0.1, ..fine }, "jump_m"),
            (TruthOutliers { jump_rad: f64::INFINITY, ..fine }, "jump_rad"),
        ] {
            let error = wrong.check().expect_err("unphysical").to_string();
            assert!(error.contains(parameter), "{error}");
        }
    }
}
