//! The order of a fit: a clock and a drive to start from; the geometry; fixing what is not observable;
//! extrinsics and latency where they predict held-out runs; thinning while innovations are not white.

use dataset::Session;
use preflight::{Clock, SessionClock, StartValues};
use rayon::prelude::*;

use crate::error::{EstimationError, refuse_wrapped_counters};
use crate::model::Instrument;
use crate::model_fit::ModelFit;
use crate::nuisances::{Explained, add_nuisances, explained_by_nuisances};
use crate::optimizer::ConvergenceCriterion;
use crate::pass_options::OutlierGate;
use crate::settings::COMMON;

/// What a fit estimates beside the geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// Estimate extrinsics and latency of the instrument where they predict held-out runs.
    pub nuisances: bool,
    /// Thin measurements while their errors are autocorrelated; otherwise every measurement counts as
    /// independent.
    pub thin: bool,
    /// Thin displacements too. A thinned pose leaves the motion whole; a thinned displacement is lost, and
    /// with it precision. Tests of a model need it, calibration is better without it.
    pub thin_displacements: bool,
}

impl FitSettings {
    /// What calibration uses.
    pub const CALIBRATION: Self = Self { nuisances: true, thin: true, thin_displacements: false };
    /// Geometry and noise from every measurement; extrinsics stay nominal, unless the instrument is turned or
    /// sees positions from elsewhere than the centre, which the first fit cannot do without.
    pub const GEOMETRY_ONLY: Self = Self { nuisances: false, thin: false, thin_displacements: false };

    /// Fits one robot's sessions.
    ///
    /// # Errors
    /// [`EstimationError`] when the sessions hold no measurements, or the fit diverges.
    pub fn fit<'a>(&self, sessions: &[Session<'a>]) -> Result<ModelFit<'a>, EstimationError> {
        self.fit_until(ConvergenceCriterion::NoiseShare(COMMON.noise_step_tolerance), sessions)
    }

    /// The same, ended where the likelihood hardly changes any more: to compare models by.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub fn fit_to_compare<'a>(&self, sessions: &[Session<'a>]) -> Result<ModelFit<'a>, EstimationError> {
        self.fit_until(ConvergenceCriterion::Likelihood, sessions)
    }

    /// The instrument's place on the robot by a session, and its latency where windows of motion show a clock
    /// that is off, with all lengths free; `None` where no frequent poses with headings show them, or the fit
    /// finds none.
    #[must_use]
    pub fn instrument(session: &Session<'_>) -> Option<Instrument> {
        let start = StartValues::of(session);
        start.drive?;
        let clock = Clock { offset_s: start.clock_offset_s.unwrap_or(0.0), ..Clock::default() };
        let ends = ConvergenceCriterion::NoiseShare(COMMON.noise_step_tolerance);
        let clocks = [SessionClock { of_all: clock, odd_runs: start.odd_runs.clone() }];
        let mut fit = ModelFit::started(std::slice::from_ref(session), &[start], &clocks, ends, false).ok()?;
        fit.start.body_from_sensor.theta_rad = fit.records.sensor_heading_rad(&fit.start);
        fit.columns.extend(fit.records.extrinsics());
        fit.refit(None, &mut []).ok()?;
        let Instrument { body_from_sensor, latency_s } = fit.solution.model.common_instrument();
        fit.solution.converged.then_some(Instrument { body_from_sensor, latency_s: clock.offset_s + latency_s })
    }

    /// The fit, with its criterion of convergence.
    pub(crate) fn fit_until<'a>(
        &self,
        ends: ConvergenceCriterion,
        sessions: &[Session<'a>],
    ) -> Result<ModelFit<'a>, EstimationError> {
        refuse_wrapped_counters(sessions)?;
        let starts: Vec<StartValues> = sessions.par_iter().map(StartValues::of).collect();
        let is_taken = |clock: &Clock| clock.rate != 0.0 || clock.offset_s.abs() >= COMMON.min_start_clock_s;
        let seen = |start: &StartValues| SessionClock {
            of_all: start.clock.filter(is_taken).unwrap_or_default(),
            odd_runs: start.odd_runs.clone(),
        };
        let clocks: Vec<SessionClock> = if self.nuisances { starts.iter().map(seen).collect() } else { Vec::new() };
        let mut found = ModelFit::started(sessions, &starts, &clocks, ends, self.thin_displacements)?;
        found.free_extrinsics_if_rotated(if self.nuisances { &starts } else { &[] });
        found.first_fit()?;
        found.fix_unobservable()?;
        let explained = if self.nuisances { explained_by_nuisances(&found, self.thin)? } else { Explained::NotTried };
        let is_explained = matches!(explained, Explained::Yes(_));
        match explained {
            Explained::Yes(other) | Explained::No { thinned: other } => found = other,
            Explained::NotTried if self.thin => found.thin()?,
            Explained::NotTried => {}
        }
        if self.nuisances && !is_explained {
            add_nuisances(&mut found, OutlierGate::On)?;
        }
        if self.nuisances {
            found.fit_timing_noise(&mut [])?;
        }
        found.fix_unobservable()?;
        if self.nuisances {
            found.unbias_noisy_rates(sessions);
        }
        Ok(found)
    }
}
