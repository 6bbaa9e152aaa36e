//! Errors of poses in a map: a distortion that returns with the place, a scale, errors that wander in time,
//! and jumps.
//!
//! The distortion is a sum of N random waves, √(2/N) a Σ cos(wₖ·p + φₖ) with wₖ ~ N(0, 1/ℓ²), which tends to
//! a Gaussian process with the covariance a² e^{−d²/2ℓ²} (Rahimi & Recht 2007). The other errors are effects
//! of the catalogue.

use std::f64::consts::TAU;
use std::fmt;

use effects::{
    Forward, PhysicalEffect, PoseReading, Stream, StreamName, TruthCorrelatedNoise, TruthJump, TruthMapScale,
};
use kinematics::Pose;
use scenario::Slam;

/// Waves of each coordinate: the covariance over a distance is then off by 1/√(2·64), 9 %.
const WAVES: usize = 64;

const MAP: StreamName = StreamName::new("map distortion");
const WANDER: StreamName = StreamName::new("wandering pose");
const JUMPS: StreamName = StreamName::new("loop closure");

/// The errors of one instrument over a session.
pub(crate) struct SlamErrors {
    position: u64,
    slam: Slam,
    map: [Vec<Wave>; 3],
    effects: Vec<(StreamName, Box<dyn Forward>)>,
}

/// A wave over the map: cos(w·p + φ).
#[derive(Clone, Copy)]
struct Wave {
    per_m: [f64; 2],
    phase_rad: f64,
}

impl fmt::Debug for SlamErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SlamErrors").field("slam", &self.slam).finish_non_exhaustive()
    }
}

impl SlamErrors {
    /// Those of the instrument at a position in the scenario's list, before any run.
    pub(crate) fn new(slam: Slam, position: u64) -> Self {
        let scale = TruthMapScale { scale_error: slam.map_scale_error };
        let wander = TruthCorrelatedNoise {
            sigma_xy_m: slam.wander_sigma_xy_m,
            sigma_theta_rad: slam.wander_sigma_theta_rad,
            tau_s: slam.wander_tau_s,
        };
        let jumps = TruthJump { rate_hz: slam.jump_rate_hz, jump_m: slam.jump_m, jump_rad: slam.jump_rad };
        let named = [(MAP, scale.forward()), (WANDER, wander.forward()), (JUMPS, jumps.forward())];
        let effects = named.into_iter().filter_map(|(name, effect)| Some((name.nth(position), effect?))).collect();
        Self { position, slam, map: Default::default(), effects }
    }

    /// A run begins; the first of a session draws the map.
    pub(crate) fn restart(&mut self, stream: impl Fn(StreamName) -> Stream, is_first: bool) {
        if is_first {
            let mut draws = stream(MAP.nth(self.position));
            let length_m = self.slam.map_length_m;
            let mut wave = || {
                let [x, y] = draws.normals();
                Wave { per_m: [x / length_m, y / length_m], phase_rad: TAU * draws.uniform() }
            };
            self.map = std::array::from_fn(|_| (0..WAVES).map(|_| wave()).collect());
        }
        for (name, effect) in &mut self.effects {
            effect.seed_run(stream(*name));
        }
    }

    /// The pose that the map shows instead of a true one, without white noise.
    pub(crate) fn pose(&mut self, t_s: f64, world_from_body: Pose) -> Pose {
        let Slam { map_sigma_xy_m, map_sigma_theta_rad, .. } = self.slam;
        let Pose { x_m, y_m, theta_rad } = world_from_body;
        let [dx, dy, dtheta] = [0, 1, 2].map(|of: usize| {
            let sum: f64 = self.map[of]
                .iter()
                .map(|wave| (wave.per_m[0] * x_m + wave.per_m[1] * y_m + wave.phase_rad).cos())
                .sum();
            (2.0 / WAVES as f64).sqrt() * sum
        });
        let distorted =
            Pose::new(x_m + map_sigma_xy_m * dx, y_m + map_sigma_xy_m * dy, theta_rad + map_sigma_theta_rad * dtheta);
        let mut reading = PoseReading { t_s, world_from_body: distorted };
        for (_, effect) in &mut self.effects {
            effect.instrument(&mut reading);
        }
        reading.world_from_body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use effects::Address;

    const SLAM: Slam = Slam {
        rate_hz: 10.0,
        sigma_xy_m: 0.0,
        sigma_theta_rad: 0.0,
        map_sigma_xy_m: 0.02,
        map_sigma_theta_rad: 0.01,
        map_length_m: 0.8,
        map_scale_error: 0.0,
        wander_sigma_xy_m: 0.0,
        wander_sigma_theta_rad: 0.0,
        wander_tau_s: 1.0,
        jump_rate_hz: 0.0,
        jump_m: 0.0,
        jump_rad: 0.0,
        stated_over_true: 0.0,
    };

    #[test]
    fn the_distortion_returns_with_the_place_and_has_the_stated_size_and_length() {
        let (n, mut squares, mut products, mut headings) = (2000_u32, 0.0, 0.0, 0.0);
        let (here, there) = (Pose::new(1.0, 2.0, 0.3), Pose::new(1.0, 2.8, 0.3));
        for trial in 0..n {
            let address = |run| Address { seed: 5, point: 0, trial: u64::from(trial), run };
            let mut errors = SlamErrors::new(SLAM, 0);
            errors.restart(|name| address(0).stream(name), true);
            let (first, away) = (errors.pose(0.0, here), errors.pose(1.0, there));
            // Another run of the session, at another instant.
            errors.restart(|name| address(1).stream(name), false);
            assert_eq!(errors.pose(7.0, here), first);
            squares += ((first.x_m - here.x_m) / 0.02).powi(2);
            products += (first.x_m - here.x_m) * (away.x_m - there.x_m) / 4e-4;
            headings += ((first.theta_rad - 0.3) / 0.01).powi(2);
        }
        let n = f64::from(n);
        // Five standard errors √(2/n) of a variance; one ℓ apart the correlation is e^{−1/2}.
        let allowed = 5.0 * (2.0 / n).sqrt();
        for (moment, expected) in [(squares, 1.0), (headings, 1.0), (products, (-0.5_f64).exp())] {
            assert!((moment / n - expected).abs() < allowed, "{} for {expected}", moment / n);
        }
    }
}
