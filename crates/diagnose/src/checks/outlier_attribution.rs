//! Attribution of large errors: the likelihood of each cause, by the innovations at and after them.
//!
//! Model: a large error at measurement k is a jump of the robot on its way there, or an error of the
//! measurement, of unknown size. Innovations respond to it linearly, and their normal equation by its size
//! is (I, u). The size is integrated out, normal about zero with covariance T or one-sided; the likelihood
//! ratio is |1 + TI|^(−½) exp(½ uᵀ(I + T⁻¹)⁻¹u).
//!
//! Causes differ in direction and in place. `bumps` cost one wheel some of its travel, anywhere.
//! `traction_loss` costs travel where a wheel becomes faster, and gives some where it becomes slower.
//! `stick_slip` leaves a wheel behind at starts and stops, and gives it back. `truth_outliers` err in x, y
//! and heading at one measurement: both displacements that share it are off. Scales are common to the
//! errors of a cause and averaged over a grid. Each error may be another cause's with probability 0.05, so
//! that none speaks against a cause by more than ln 20. Jumps and errors in any direction say what an
//! uncatalogued cause would explain.
//! Reference: Willsky & Jones 1976 (jumps in the innovations of a filter); Tukey 1960 (contamination).

use effects::IsolatedError;
use estimation::{Column, ModelFit, NormalEquations, total};
use kinematics::{Increment, Pose, Side, Wheels};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::candidates::candidate::terms;
use crate::checks::large_errors::{LargeError, large_errors, mean_speed_m_s};
use crate::fits::augmented_model::AugmentedModel;
use crate::settings::RESIDUALS;
use crate::settings::residuals::JUMP_TIME_FRACTIONS;

/// Columns of a large error: travel that each wheel loses at each instant; travel lost for a change of its
/// speed; errors of the measurement, and of the one before; a jump before the measurement.
const SLIDES: usize = 2 * JUMP_TIME_FRACTIONS.len();
const AT: usize = SLIDES + 2;
const FROM: usize = AT + 3;
const ANY: usize = FROM + 3;
const COLUMNS: usize = ANY + 3;

const PARAMETERS: [TermParameter; COLUMNS] = {
    const LOST: TermParameter = TermParameter { name: "lost_m", unit: "m", prior_sigma: 1e-3 };
    const SLIDE: TermParameter = TermParameter { name: "slides_s", unit: "s", prior_sigma: 1e-2 };
    const ERROR: TermParameter = TermParameter { name: "off_m", unit: "m", prior_sigma: 1e-2 };
    const TURN: TermParameter = TermParameter { name: "off_rad", unit: "rad", prior_sigma: 1e-2 };
    [LOST, LOST, LOST, LOST, LOST, LOST, SLIDE, SLIDE, ERROR, ERROR, TURN, ERROR, ERROR, TURN, ERROR, ERROR, TURN]
};

/// Ahead, aside, and turned.
const POSE_AXES: [Pose; 3] = [Pose::new(1.0, 0.0, 0.0), Pose::new(0.0, 1.0, 0.0), Pose::new(0.0, 0.0, 1.0)];

/// The term of a large error: a jump before its measurement, or an error of that measurement or of the one
/// before.
#[derive(Debug, Clone)]
struct Jump {
    run_id: String,
    from_s: f64,
    at_s: f64,
}

impl ModelTerm for Jump {
    fn parameters(&self) -> &[TermParameter] {
        &PARAMETERS
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let (start_s, end_s) = (interval.t_s, interval.t_s + interval.dt_s);
        let middle_s = 0.5 * (start_s + end_s);
        if middle_s < self.from_s || middle_s > self.at_s || interval.run.id != self.run_id {
            return;
        }
        let lost =
            |side: Side, lost_m: f64| interval.change(Wheels::from_sides(|of| if of == side { -lost_m } else { 0.0 }));
        for (index, share) in JUMP_TIME_FRACTIONS.iter().enumerate() {
            let instant_s = self.from_s + share * (self.at_s - self.from_s);
            if start_s <= instant_s && instant_s < end_s {
                for (k, side) in Side::BOTH.into_iter().enumerate() {
                    gradient[2 * index + k] = lost(side, sense(interval.travel_m[side]));
                }
            }
        }
        let gained_m_s = interval.speed_change_m_s();
        for (k, side) in Side::BOTH.into_iter().enumerate() {
            gradient[SLIDES + k] = lost(side, gained_m_s[side]);
        }
        if end_s > self.at_s - RESIDUALS.instant_tolerance_s {
            gradient[ANY..].copy_from_slice(&POSE_AXES);
        }
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        if measurement.run.id != self.run_id {
            return;
        }
        for (at_s, column) in [(self.at_s, AT), (self.from_s, FROM)] {
            if (measurement.t_s - at_s).abs() < RESIDUALS.instant_tolerance_s {
                gradient[column..column + 3].copy_from_slice(&POSE_AXES);
            }
        }
    }
}

/// The sign of a wheel's travel; 0 of none.
fn sense(travel_m: f64) -> f64 {
    if travel_m == 0.0 { 0.0 } else { travel_m.signum() }
}

/// What errs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ErrorSource {
    /// The robot jumps.
    Robot,
    /// The instrument errs.
    Instrument,
}

/// Log likelihoods of the large errors of a model under each cause, and the largest under any cause of some
/// sources, up to a common constant. `None` where there are no large errors, or a cause has no such model.
pub(crate) fn log_likelihoods(
    model: &AugmentedModel<'_>,
    ids: &[&'static str],
    any: &[ErrorSource],
) -> Option<(Vec<f64>, f64)> {
    let fit = model.fit.evaluated_ungated();
    let mut large = large_errors(&fit, &fit.scan(&mut terms(&model.candidates)).innovations);
    large.sort_by(|a, b| b.z.total_cmp(&a.z));
    large.truncate(RESIDUALS.max_large_errors);
    let of_passes: Vec<Vec<ErrorResponse>> =
        large.par_chunks(RESIDUALS.errors_per_pass).map(|large| responses(model, &fit, large)).collect();
    let responses = of_passes.concat();
    if responses.is_empty() {
        return None;
    }
    let speed_m_s = mean_speed_m_s(&large);
    let mut causes: Vec<Vec<Vec<f64>>> =
        ids.iter().map(|id| of_cause(id, &responses, speed_m_s)).collect::<Option<_>>()?;
    causes.extend(any.iter().map(|source| of_any(*source, &responses)));
    let mut likelihoods = of_causes(&causes);
    let any = likelihoods.split_off(ids.len()).into_iter().fold(f64::NEG_INFINITY, f64::max);
    Some((likelihoods, any))
}

/// Log likelihoods of causes, from those of each large error at each of their scales.
fn of_causes(causes: &[Vec<Vec<f64>>]) -> Vec<f64> {
    let errors = causes.iter().flatten().map(Vec::len).min().unwrap_or(0);
    let best: Vec<f64> = (0..errors)
        .map(|error| causes.iter().flatten().map(|scale| scale[error]).fold(f64::NEG_INFINITY, f64::max))
        .collect();
    let at_scale = |own: &Vec<f64>| -> f64 {
        // Over the best explanation of each: what is common to all causes.
        own.iter()
            .zip(&best)
            .map(|(own, best)| {
                ((1.0 - RESIDUALS.other_cause_probability) * (own - best).exp() + RESIDUALS.other_cause_probability)
                    .ln()
            })
            .sum()
    };
    causes.iter().map(|scales| log_mean(&scales.iter().map(at_scale).collect::<Vec<_>>())).collect()
}

fn log_mean(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return most;
    }
    let count = logs.len() as f64;
    most + (logs.iter().map(|log| (log - most).exp()).sum::<f64>() / count).ln()
}

/// Information and score of a large error's columns by its run, the free columns of the fit projected out.
#[derive(Debug, Clone)]
struct ErrorResponse {
    large: LargeError,
    separation_m: f64,
    information: DMatrix<f64>,
    score: DVector<f64>,
}

/// The same of some large errors, from one pass.
fn responses(model: &AugmentedModel<'_>, fit: &ModelFit<'_>, large: &[LargeError]) -> Vec<ErrorResponse> {
    let mut all = terms(&model.candidates);
    let first = Column::BASE.len() + all.iter().map(|term| term.parameters().len()).sum::<usize>();
    for LargeError { run_id, from_s, at_s, .. } in large {
        all.push(Box::new(Jump { run_id: run_id.clone(), from_s: *from_s, at_s: *at_s }));
    }
    let runs: Vec<NormalEquations> = fit.scan_parts(&mut all, &vec![COLUMNS; large.len()]);
    let Some(projection) = total(&runs).and_then(|all| fit.eliminated(&all, &[])) else { return Vec::new() };
    let of = |(number, large): (usize, &LargeError)| {
        let run = runs.iter().find(|run| run.run == large.run)?;
        let own: Vec<usize> = (0..COLUMNS).map(|column| first + number * COLUMNS + column).collect();
        let of_run = projection.of_columns(run, &own);
        let separation_m = fit.solution.model.separation_m;
        // The gradient is the cost's.
        Some(ErrorResponse {
            large: large.clone(),
            separation_m,
            information: of_run.information,
            score: -of_run.gradient,
        })
    };
    large.iter().enumerate().filter_map(of).collect()
}

impl ErrorResponse {
    /// Log Bayes factor of a size along a direction, half-normal with a scale, over none.
    fn one_sided(&self, direction: &DVector<f64>, scale: f64) -> f64 {
        let information = (direction.transpose() * &self.information * direction)[0].max(0.0);
        let score = direction.dot(&self.score);
        let precision = information + scale.powi(-2);
        let mean = score / precision.sqrt();
        let positive = Normal::new(0.0, 1.0).map_or(0.5, |normal| normal.cdf(mean));
        // 1 where nothing is measured along it.
        std::f64::consts::LN_2 - 0.5 * (precision * scale * scale).ln() + 0.5 * mean * mean + positive.ln()
    }

    /// The same of a measurement's error, whose column is the first of three.
    fn error(&self, column: usize, jump_m: f64, jump_rad: f64) -> f64 {
        let scale = Matrix3::from_diagonal(&Vector3::new(jump_m, jump_m, jump_rad));
        let information = scale * self.information.fixed_view::<3, 3>(column, column) * scale;
        let score = scale * self.score.fixed_rows::<3>(column);
        let Some(of) = (Matrix3::identity() + information).cholesky() else { return 0.0 };
        0.5 * score.dot(&of.solve(&score)) - 0.5 * of.determinant().ln()
    }

    fn column(&self, column: usize) -> DVector<f64> {
        DVector::from_fn(self.score.len(), |row, _| f64::from(u8::from(row == column)))
    }

    /// One wheel loses some of its travel, where the robot drives.
    fn of_bump(&self, lost_m: f64) -> f64 {
        let indices: Vec<f64> = (0..SLIDES).map(|column| self.one_sided(&self.column(column), lost_m)).collect();
        log_mean(&indices) + self.large.relative_distance.ln()
    }

    /// One wheel or both lose travel as they become faster, and gain some as they become slower.
    fn of_slide(&self, slides_s: f64) -> f64 {
        let [left, right] = [0, 1].map(|side| self.column(SLIDES + side));
        let by_wheel = [&left, &right, &(&left + &right)].map(|direction| self.one_sided(direction, slides_s));
        log_mean(&by_wheel) + self.large.ramp_odds.ln()
    }

    /// One wheel or both are behind at the measurement, or fall behind as they become slower and are back
    /// as they become faster.
    fn of_wind_up(&self, wound_m: f64, speed_m_s: f64) -> f64 {
        let behind = |side: Side| {
            let lost_m = Wheels::from_sides(|of| if of == side { -sense(self.large.travel_m[side]) } else { 0.0 });
            let Increment { distance_m, turn_rad } = Increment::from_travel(lost_m, self.separation_m);
            let at = [(AT, distance_m), (AT + 2, turn_rad)];
            at.into_iter().fold(DVector::zeros(self.score.len()), |sum, (column, by)| sum + self.column(column) * by)
        };
        let [left, right] = Side::BOTH.map(behind);
        let at_measurement = [&left, &right, &(&left + &right)].map(|direction| self.one_sided(direction, wound_m));
        let [left, right] = [0, 1].map(|side| -self.column(SLIDES + side));
        let scale_s = wound_m / speed_m_s;
        let before_measurement = [&left, &right, &(&left + &right)].map(|direction| self.one_sided(direction, scale_s));
        log_mean(&[log_mean(&at_measurement), log_mean(&before_measurement)]) + self.large.ramp_odds.ln()
    }

    /// The measurement errs, or the one before.
    fn of_measurement(&self, jump_m: f64, jump_rad: f64) -> f64 {
        log_mean(&[AT, FROM].map(|column| self.error(column, jump_m, jump_rad)))
    }
}

/// For each scale of a cause, what it makes of each large error; `None` where its errors are not single ones.
fn of_cause(id: &str, responses: &[ErrorResponse], speed_m_s: f64) -> Option<Vec<Vec<f64>>> {
    let each = |of: &dyn Fn(&ErrorResponse) -> f64| responses.iter().map(of).collect::<Vec<f64>>();
    Some(match effects::description(id)?.isolated_error? {
        IsolatedError::LostOnTheWay { scales_m } => {
            scales_m.iter().map(|lost_m| each(&|response| response.of_bump(*lost_m))).collect()
        }
        IsolatedError::LostWithSpeedChange { scales_s } => {
            scales_s.iter().map(|slides_s| each(&|response| response.of_slide(*slides_s))).collect()
        }
        IsolatedError::WoundUp { scales_m } => {
            scales_m.iter().map(|wound_m| each(&|response| response.of_wind_up(*wound_m, speed_m_s))).collect()
        }
        IsolatedError::OfInstrument => of_any(ErrorSource::Instrument, responses),
    })
}

/// The same of jumps or errors that may be any. An instrument that says how the robot moved may err in each
/// displacement, as if the robot had jumped, or in each measurement of which it takes the difference: it
/// does one or the other.
fn of_any(source: ErrorSource, responses: &[ErrorResponse]) -> Vec<Vec<f64>> {
    type Of = fn(&ErrorResponse, f64, f64) -> f64;
    let of_jump: Of = |response, jump_m, jump_rad| response.error(ANY, jump_m, jump_rad);
    let kinds: &[Of] = match source {
        ErrorSource::Robot => &[of_jump],
        ErrorSource::Instrument if responses.iter().all(|response| response.large.is_displacement) => {
            &[ErrorResponse::of_measurement, of_jump]
        }
        ErrorSource::Instrument => &[ErrorResponse::of_measurement],
    };
    let both = kinds.iter().flat_map(|of| {
        RESIDUALS
            .measurement_error_scales
            .iter()
            .flat_map(move |m| RESIDUALS.measurement_error_scales.iter().map(move |rad| (of, *m, *rad)))
    });
    both.map(|(of, jump_m, jump_rad)| responses.iter().map(|response| of(response, jump_m, jump_rad)).collect())
        .collect()
}

#[cfg(test)]
pub(crate) mod tests;
