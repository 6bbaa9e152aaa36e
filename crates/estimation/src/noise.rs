//! Noise of the wheels and of the instrument: four variances and their priors, and the noise of the instants
//! of measurements.

use dataset::TruthNoise;
use nalgebra::Matrix4xX;

use crate::settings::COMMON;

/// One of the variances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseComponent {
    /// Of a wheel's travel, m² per metre rolled (k²).
    Wheel,
    /// Of the heading, rad² per radian turned: a wheelbase that varies.
    Turn,
    /// Of each of a measurement's two coordinates, m².
    MeasurementPosition,
    /// Of a measurement's heading, rad².
    MeasurementHeading,
}

impl NoiseComponent {
    /// All, in the order of [`Noise::variance`].
    pub const ALL: [Self; 4] = [Self::Wheel, Self::Turn, Self::MeasurementPosition, Self::MeasurementHeading];
}

/// How many variances there are.
pub(crate) const NOISES: usize = NoiseComponent::ALL.len();

/// Values of the variances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// The variances in the order of [`NoiseComponent::ALL`], which says what each is of, and its unit.
    pub variance: [f64; 4],
    /// Of the instants of measurements on the log's clock, s²: stamps that jitter, and motion that rows do
    /// not tell. A robot that stands shows none of it.
    pub timing_s2: f64,
}

/// Prior of the standard deviations: ln σ is normal about ln `centre` with the standard deviation `log_sd`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NoisePrior {
    pub(crate) centre: [f64; 4],
    pub(crate) log_sd: [f64; 4],
    /// Variances of position and heading keep their ratio: one factor is estimated of both.
    pub(crate) common_scale: bool,
    /// As in [`Noise`]; it is fitted outside the optimizer, and has no prior.
    pub(crate) timing_s2: f64,
}

impl NoisePrior {
    pub(crate) fn of(stated: TruthNoise) -> Self {
        let reused = |sigma: Option<f64>| sigma.filter(|sigma| *sigma > 0.0);
        let (xy, theta) = (reused(stated.sigma_xy_m), reused(stated.sigma_theta_rad));
        let log_sd = |stated: Option<f64>| {
            if stated.is_some() { COMMON.stated_noise_log_sigma } else { COMMON.noise_prior_log_sigma }
        };
        Self {
            centre: [
                COMMON.wheel_prior_sigma,
                COMMON.turn_prior_sigma,
                xy.unwrap_or(COMMON.position_prior_sigma_m),
                theta.unwrap_or(COMMON.heading_prior_sigma_rad),
            ],
            log_sd: [COMMON.noise_prior_log_sigma, COMMON.noise_prior_log_sigma, log_sd(xy), log_sd(theta)],
            common_scale: false,
            timing_s2: 0.0,
        }
    }

    /// The directions in which the logarithms of the variances move.
    pub(crate) fn directions(&self) -> Matrix4xX<f64> {
        let all = Matrix4xX::identity(NOISES);
        if !self.common_scale {
            return all;
        }
        let heading = NoiseComponent::MeasurementHeading as usize;
        let mut together = all.remove_column(heading);
        together[(heading, NoiseComponent::MeasurementPosition as usize)] = 1.0;
        together
    }

    /// Prior standard deviations of a measurement's position, metres, and heading, radians.
    pub(crate) const fn measurement_sigma(&self) -> [f64; 2] {
        [
            self.centre[NoiseComponent::MeasurementPosition as usize],
            self.centre[NoiseComponent::MeasurementHeading as usize],
        ]
    }

    /// The same with one standard deviation fixed at its lower bound.
    pub(crate) fn without(mut self, component: NoiseComponent) -> Self {
        (self.centre[component as usize], self.log_sd[component as usize]) =
            (COMMON.min_noise_sigma, COMMON.fixed_noise_log_sigma);
        self
    }

    pub(crate) fn noise(&self) -> Noise {
        Noise { variance: self.centre.map(|sigma| sigma * sigma), timing_s2: self.timing_s2 }
    }

    /// Gradient and curvature of −log prior by the logarithm of each variance.
    pub(crate) fn pull(&self, noise: &Noise) -> [(f64, f64); 4] {
        std::array::from_fn(|k| {
            // ln σ = ½ ln variance.
            let (off, sd) = (0.5 * noise.variance[k].ln() - self.centre[k].ln(), self.log_sd[k]);
            (0.5 * off / (sd * sd), 0.25 / (sd * sd))
        })
    }
}

impl Noise {
    /// A component's standard deviation: m/√m, rad/√rad, m, rad.
    #[must_use]
    pub fn sigma(&self, component: NoiseComponent) -> f64 {
        self.variance[component as usize].sqrt()
    }

    /// All but that of instants times a factor, and none below `least`.
    pub(crate) fn scaled(&self, factor: f64, least: f64) -> Self {
        Self { variance: self.variance.map(|variance| (variance * factor).max(least)), ..*self }
    }
}
