//! What the noise of recorded speeds biases, taken off by adding it once more.
//!
//! A speed that is measured errs by noise that no wheel rolled. Turns by such speeds vary by more than those
//! of the robot, so that a fit explains less of a turn by each, and the separation comes out too large
//! (errors in variables; Fuller 1987). With the noise added once more, drawn and with either sign, the
//! estimates move by what they are off already (simulation and extrapolation; Cook & Stefanski 1994). The
//! variance of the noise is a sixth of the mean square of the speeds' second differences; steady motion has
//! none. It is at most the variance of the fit's wheel noise. Slip is no such noise: the instrument sees it,
//! and it biases nothing.

use std::sync::Arc;

use dataset::{Session, WheelLog};
use kinematics::Wheels;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::model_fit::ModelFit;
use crate::noise::NoiseComponent;
use crate::normal_equations::{Information, total};
use crate::settings::COMMON;
use crate::thinning::Selection;

impl ModelFit<'_> {
    /// Takes off the geometry and the instrument what the noise of recorded speeds adds to them.
    pub(crate) fn unbias_noisy_rates(&mut self, sessions: &[Session<'_>]) {
        let Some(of_rates) = noise_of_rates(sessions) else { return };
        let variance = of_rates.min(self.solution.noise.variance[NoiseComponent::Wheel as usize]);
        if variance < COMMON.min_rate_noise.powi(2) {
            return;
        }
        let basis = self.free_basis();
        let system = |fit: &Self| Some(total(&fit.scan(&mut []).runs)?.of(&self.columns).along(&basis));
        let Some(found) = system(self) else { return };
        let mut moved = DVector::zeros(basis.ncols());
        for sign in [1.0, -1.0] {
            let Some(noisier) = system(&self.with_noisier_speeds(sign * variance.sqrt())) else { return };
            let by_noise = Information { gradient: noisier.gradient - &found.gradient, ..found.clone() };
            let Some((step, _)) = by_noise.solve() else { return };
            moved += 0.5 * step;
        }
        for (column, by) in self.columns.iter().zip((&basis * moved).iter()) {
            self.solution.model.advance(*column, -by);
        }
    }

    /// The fit with wheels that rolled otherwise by noise, m/√m, drawn anew; measurements stay.
    fn with_noisier_speeds(&self, sigma_m_per_sqrt_m: f64) -> Self {
        let mut records = self.records.copied();
        let m_per_rad = self.solution.model.m_per_rad;
        records.segments.par_iter_mut().enumerate().for_each(|(number, segment)| {
            let mut draws = Xoshiro256PlusPlus::seed_from_u64(number as u64);
            for interval in &mut segment.intervals {
                interval.wheel_rad = interval.wheel_rad.zip_with(m_per_rad, |rad, m_per_rad| {
                    let drawn: f64 = StandardNormal.sample(&mut draws);
                    rad + sigma_m_per_sqrt_m * (rad / m_per_rad).abs().sqrt() * drawn
                });
            }
        });
        // Their variances go by what the wheels seem to roll.
        let selections = Arc::new(Selection::of(&records, self.thinning, &self.start));
        Self { records: Arc::new(records), selections, ..self.clone() }
    }
}

/// Variance of what wheels seem to roll by the noise of recorded speeds, m² for a metre; `None` where no run
/// records speeds.
fn noise_of_rates(sessions: &[Session<'_>]) -> Option<f64> {
    let (mut variance_m2, mut rolled_m) = (0.0, 0.0);
    for session in sessions {
        for run in &session.runs {
            let odometry = run.odometry();
            let (WheelLog::Speeds(_) | WheelLog::Twist { .. }) = &odometry.wheels else { continue };
            let speeds: Option<Vec<Wheels<f64>>> =
                (0..odometry.t_s.len()).map(|row| run.reported_speed_m_s(session.robot, row)).collect();
            for (rows_s, speeds) in odometry.t_s.windows(3).zip(speeds?.windows(3)) {
                let row_s = 0.5 * (rows_s[2] - rows_s[0]);
                let noise = |before: f64, own: f64, after: f64| ((before - 2.0 * own + after) * row_s).powi(2) / 6.0;
                let [before, own, after] = [speeds[0], speeds[1], speeds[2]];
                variance_m2 += noise(before.left, own.left, after.left) + noise(before.right, own.right, after.right);
                rolled_m += (own.left.abs() + own.right.abs()) * row_s;
            }
        }
    }
    (rolled_m > 0.0).then(|| variance_m2 / rolled_m)
}
