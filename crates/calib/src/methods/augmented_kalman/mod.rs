//! `augmented_kalman`: pose and systematic factors in one extended Kalman filter, the noise in a second one.
//!
//! Model: the state is the pose with the factors δ_L, δ_R of the wheels and δ_B of the separation over their
//! nominal values. Rows of the log predict, with wheel noise of variance k²|s|; poses of the instrument
//! correct. k², σ_xy² and σ_θ² come from the innovations by a filter of their own (`noise.rs`). On line that
//! is one pass ([`AugmentedFilter`]). Sessions on disk are gone over again from the factors found, until
//! factors and noise stay: the linearisation is then at the result.
//! Assumptions: the instrument is at the drive's centre, its errors are normal and independent from
//! measurement to measurement, factors are constant. Measurements are therefore spaced by
//! [`AugmentedKalman::measurement_every_m`]: twenty a second share the error of their clock.
//! Observability: all three, from measurements on paths with straights and turns; a factor that is hardly
//! better known afterwards is refused.
//! Reference: Martinelli 2002 (IEEE T-RA 18, 399–405), Martinelli, Tomatis, Tapus & Siegwart 2003 (IROS: the
//! augmented filter); Mehra 1970 for the innovations.

mod filter;
mod follow;
mod noise;

use dataset::Session;
use kinematics::{DriveGeometry, Pose, Wheels};
use motion_programs::Schedule;
use nalgebra::{Matrix3, Vector3};

pub use filter::{AugmentedFilter, PoseInnovation, Settling};
pub use follow::{Followed, settled_at};
pub use noise::{NoiseFilter, NoiseSource, Variances};

use crate::dead_reckoning_jacobian::unobservable;
use crate::estimate::{CalibError, Calibration, Method, drive, geometry_covariance, nominal};
use crate::pose_measurements::{PoseMeasurement, PoseMeasurements, Spacing};
use crate::settings::{
    FACTOR_PRIOR_SIGMA, HEADING_SIGMA_GUESS_RAD, MAX_PASSES, MAX_POSTERIOR_TO_PRIOR_SIGMA, MEASUREMENT_SPACING_M,
    MEASUREMENT_SPACING_RAD, PASS_NOISE_TOLERANCE, PASS_TOLERANCE, POSITION_SIGMA_GUESS_M, WHEEL_SIGMA_GUESS,
};

/// The method with its priors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AugmentedKalman {
    /// How far diameters and separation may be from nominal, relatively, one standard deviation.
    pub factor_sigma: f64,
    /// First guess of the wheels' noise, m/√m.
    pub wheel_sigma_m_per_sqrt_m: f64,
    /// First guess of the instrument's error in each coordinate where the dataset does not state it, metres.
    pub truth_sigma_m: f64,
    /// First guess of its error in heading where the dataset does not state it, radians.
    pub truth_sigma_rad: f64,
    /// Measurements are taken after so much travel by the nominal robot, metres, …
    pub measurement_every_m: f64,
    /// … or so much turn, radians, and at a run's end.
    pub measurement_every_rad: f64,
}

/// One pass over all runs.
#[derive(Debug, Clone)]
struct Pass {
    noise: NoiseFilter,
    factors: Vector3<f64>,
    covariance: Matrix3<f64>,
    stopped: bool,
}

impl AugmentedKalman {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self {
        factor_sigma: FACTOR_PRIOR_SIGMA,
        wheel_sigma_m_per_sqrt_m: WHEEL_SIGMA_GUESS,
        truth_sigma_m: POSITION_SIGMA_GUESS_M,
        truth_sigma_rad: HEADING_SIGMA_GUESS_RAD,
        measurement_every_m: MEASUREMENT_SPACING_M,
        measurement_every_rad: MEASUREMENT_SPACING_RAD,
    };

    const NAME: &'static str = "augmented_kalman";

    fn pass(
        &self,
        runs: &[PoseMeasurements<'_>],
        nominal: &DriveGeometry,
        factors: Vector3<f64>,
        noise: NoiseFilter,
    ) -> Pass {
        let m_per_rad = nominal.m_per_rad();
        let start = runs.first().map_or(Pose::IDENTITY, |measurements| measurements.start);
        let mut turned = Wheels::both(0.0);
        let mut filter =
            AugmentedFilter::new(nominal, m_per_rad, self.factor_sigma, noise, start, turned).starting_from(factors);
        for measurements in runs {
            filter.restart(measurements.start, turned);
            for PoseMeasurement { wheel_rad, pose } in &measurements.later {
                for rad in wheel_rad {
                    turned = turned.zip_with(*rad, |turned, rad| turned + rad);
                    filter.predict(turned);
                }
                filter.update(*pose);
            }
        }
        Pass {
            noise: *filter.noise(),
            factors: *filter.factors(),
            covariance: filter.factor_covariance(),
            stopped: filter.has_stopped_moving(),
        }
    }

    /// Variances to begin with, and which of them the sessions state alike.
    fn first_guess(&self, sessions: &[Session<'_>]) -> NoiseFilter {
        let stated = |of: fn(&Session<'_>) -> Option<f64>| {
            let first = sessions.first().and_then(of)?;
            // Statements, not measurements: compared exactly.
            (first > 0.0 && sessions.iter().all(|session| of(session) == Some(first))).then_some(first)
        };
        let xy_m = stated(|session| session.truth_noise.sigma_xy_m);
        let theta_rad = stated(|session| session.truth_noise.sigma_theta_rad);
        let sigma = Vector3::new(
            self.wheel_sigma_m_per_sqrt_m,
            xy_m.unwrap_or(self.truth_sigma_m),
            theta_rad.unwrap_or(self.truth_sigma_rad),
        );
        NoiseFilter::new(sigma.component_mul(&sigma), [false, xy_m.is_some(), theta_rad.is_some()])
    }

    /// Passes until factors and variances stay; false when they do not.
    fn iterate(&self, runs: &[PoseMeasurements<'_>], nominal: &DriveGeometry, guess: NoiseFilter) -> (Pass, bool) {
        let mut best = self.pass(runs, nominal, Vector3::repeat(1.0), guess.fixed_at(*guess.variances()));
        let mut share = 1.0;
        for _ in 0..MAX_PASSES {
            // The same variances from where the factors came to, before they are compared with others from
            // there.
            let again = self.pass(runs, nominal, best.factors, guess.fixed_at(*best.noise.variances()));
            let settled = (0..3).all(|i| {
                (again.factors[i] - best.factors[i]).abs() <= PASS_TOLERANCE * again.covariance[(i, i)].sqrt()
            });
            best = again;
            if !settled {
                continue;
            }
            let step = best.noise.step() * share;
            if step.amax() <= PASS_NOISE_TOLERANCE {
                return (best, true);
            }
            let variances = best.noise.variances().zip_map(&step, |variance, step| variance * step.exp());
            let tried = self.pass(runs, nominal, best.factors, guess.fixed_at(variances));
            if tried.noise.log_posterior() >= best.noise.log_posterior() {
                best = tried;
                share = (2.0_f64 * share).min(1.0);
            } else {
                share *= 0.5;
            }
        }
        (best, false)
    }
}

impl Method for AugmentedKalman {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "any path with straights and turns, measured as poses: a Kalman filter of pose and factors, with its noise estimated"
    }

    /// Martinelli's robot wandered; straights and spins show all three factors.
    fn protocol(&self) -> Vec<Schedule> {
        vec![
            Schedule::Straights { length_m: 0.5, runs: 40 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 20 },
        ]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let spacing = Spacing { every_m: self.measurement_every_m, every_rad: self.measurement_every_rad };
        let (runs, runs_rejected) = PoseMeasurements::of_all(Self::NAME, sessions, spacing)?;
        let (pass, settles) = self.iterate(&runs, &geometry, self.first_guess(sessions));
        self.observable(&pass.covariance)?;
        let [left, right, separation] = pass.factors.into();
        let diameter_m =
            geometry.wheel_diameter_m().zip_with(Wheels { left, right }, |nominal_m, factor| nominal_m * factor);
        let found = drive(Self::NAME, diameter_m, geometry.wheel_separation_m() * separation)?;
        let nominal_m = geometry.wheel_diameter_m();
        let geometry_m = [nominal_m.left, nominal_m.right, geometry.wheel_separation_m()];
        Ok(Calibration {
            covariance: Some(geometry_covariance(|row, column| pass.covariance[(row, column)], geometry_m)),
            runs_used: runs.len(),
            runs_rejected,
            converged: settles && pass.stopped,
            ..Calibration::new(Self::NAME, found, robot.ticks_per_rev)
        })
    }
}

impl AugmentedKalman {
    /// Refuses factors that are hardly better known than by their prior.
    fn observable(&self, covariance: &Matrix3<f64>) -> Result<(), CalibError> {
        let eigen = covariance.symmetric_eigen();
        let vague = eigen.eigenvalues.imax();
        let left = eigen.eigenvalues[vague].max(0.0).sqrt() / self.factor_sigma;
        if left <= MAX_POSTERIOR_TO_PRIOR_SIGMA {
            return Ok(());
        }
        let (parameter, missing) = unobservable(&eigen.eigenvectors.column(vague).into_owned());
        let why = format!("{missing} (still {:.0} % of the doubt before any data)", 100.0 * left);
        Err(CalibError::Unobservable { method: Self::NAME, parameter, why })
    }
}
