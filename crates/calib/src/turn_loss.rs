//! What a robot that skids loses of its distance in turns: no diameters of its wheels are right for straights
//! and turns alike.
//!
//! Reference: Mandow, Martínez et al. 2007, Experimental kinematics for wheeled skid-steer mobile robots.

use estimation::{Column, ModelFit};
use kinematics::{Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};

use crate::settings::MIN_TURN_LOSS_SIGMAS;

/// Distance that is lost, per turn.
#[derive(Clone)]
struct TurnLoss;

impl ModelTerm for TurnLoss {
    /// Plausible: a Warthog, whose wheels are 1.2 m apart, loses 0.05 to 0.1 m/rad.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "lost_m_rad", unit: "m/rad", prior_sigma: 0.1 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let Wheels { left, right } = interval.smooth_travel_m();
        let tread_m = left.abs() + right.abs();
        if tread_m > 0.0 {
            let turn_rad = interval.smooth_increment().turn_rad;
            gradient[0] = interval.change(Wheels::both(-turn_rad.abs() * (left + right) / tread_m));
        }
    }
}

/// What the runs of a fit say of the distance that is lost in turns, as a sentence; `None` where the fit with
/// it does not converge.
pub(crate) fn sentence(fit: &ModelFit<'_>) -> Option<String> {
    let mut terms: [Box<dyn ModelTerm>; 1] = [Box::new(TurnLoss)];
    let with = fit.extended(&mut terms).ok().filter(|with| with.solution.converged)?;
    let covariance = with.covariance(&mut terms)?;
    let sigma = |column: Column| Some(covariance[(with.position(column)?, with.position(column)?)].sqrt());
    let model = &with.solution.model;
    let (lost_m, lost_sigma_m) = (model.term_values.first()?, sigma(Column::Term(0))?);
    let two_digits = |value: f64, sigma: f64| {
        let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.decimals$} ± {sigma:.decimals$}")
    };
    let lost = format!("{} mm per radian", two_digits(1e3 * lost_m, 1e3 * lost_sigma_m));
    let [left, right, _] = Column::GEOMETRY.map(|column| with.position(column));
    let (left, right) = (left?, right?);
    let Wheels { left: left_mm, right: right_mm } = model.m_per_rad.map(|m_per_rad| 2e3 * m_per_rad);
    let relative = [covariance[(left, left)], covariance[(right, right)], 2.0 * covariance[(left, right)]];
    let mean_mm = 0.5 * (left_mm + right_mm);
    let mean_sigma_mm = 0.5 * mean_mm * relative.iter().sum::<f64>().sqrt();
    let wheels = format!("{left_mm:.1} and {right_mm:.1} mm (mean {})", two_digits(mean_mm, mean_sigma_mm));
    Some(if *lost_m > MIN_TURN_LOSS_SIGMAS * lost_sigma_m {
        format!(
            "skidding in turns shortens the distance driven by {lost}; on straights the wheels measure {wheels}: no diameters fit both"
        )
    } else {
        format!(
            "skidding shortens the distance driven in turns, but these runs do not show by how much ({lost}): add straights of several metres and bends"
        )
    })
}
