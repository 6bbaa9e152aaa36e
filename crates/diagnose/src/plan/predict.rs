//! What each cause predicts of the planned runs, written down before they are driven.
//!
//! A cause's own estimates and calibration, with the covariance that the data leave them, are driven along
//! the plan. The prediction is the measured pose relative to dead reckoning with the calibrated geometry
//! alone, at the instant and in the component in which the causes differ most for their uncertainty.

use estimation::{Column, EndError, Model, ModelFit, NormalEquations};
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::constraints::Setting;
use super::manoeuvres::{Measurements, Part, Where, of_runs, phase_rad, planned_run};
use super::rival_odds::Rivals;
use super::text;
use crate::candidates::candidate::{Candidate, terms};
use crate::document::{Predicted, Value};
use crate::fits::augmented_model::AugmentedModel;
use crate::settings::PLAN;
use crate::settings::plan::PREDICTION_INSTANTS;

/// What the robot does at one instant of one kind of run: mean, covariance by what is not known of the
/// name, and variance by the noise.
#[derive(Debug, Clone)]
struct Measured {
    mean: Vector3<f64>,
    known_var: Vector3<f64>,
    noise_var: Vector3<f64>,
}

/// A sentence of what is predicted, and the prediction of each name.
pub(super) fn predictions(
    base: &ModelFit<'_>,
    without: &AugmentedModel<'_>,
    rivals: &Rivals,
    before: &NormalEquations,
    discriminated: &[(usize, usize)],
    parts: &[Part],
    setting: &Setting,
) -> Option<(String, Predicted)> {
    let mut best: Option<(f64, Part, Where, Vec<Measured>)> = None;
    for part in parts {
        let run = PlannedRun::new(base, part, setting)?;
        let of_names: Vec<Vec<Measured>> = rivals
            .rival_columns
            .iter()
            .map(|rival_columns| {
                let (step, covariance) = rivals.frame.estimate(before, &rivals.frame.with(rival_columns))?;
                // The other names, which are not there under this one, need not be driven.
                let all: Vec<Candidate> =
                    without.candidates.iter().chain([&rival_columns.candidate]).cloned().collect();
                let own = (0..rival_columns.columns.len())
                    .map(|k| Column::Term(without.fit.solution.model.term_values.len() + k).index());
                let columns: Vec<usize> = rivals.frame.free.iter().copied().chain(own).collect();
                run.of(&without.fit.solution.model, &all, &columns, &step, &covariance)
            })
            .collect::<Option<_>>()?;
        let components = if setting.sees_heading { 3 } else { 2 };
        for index in 0..of_names[0].len() {
            for component in 0..components {
                let measured: Vec<Measured> = of_names.iter().map(|name| name[index].clone()).collect();
                let difference = |(a, b): &(usize, usize)| {
                    let (a, b) = (&measured[*a], &measured[*b]);
                    let var = a.known_var[component] + b.known_var[component] + a.noise_var[component];
                    (a.mean[component] - b.mean[component]).abs() / var.max(f64::MIN_POSITIVE).sqrt()
                };
                let sigmas = discriminated.iter().map(difference).fold(f64::INFINITY, f64::min);
                if best.as_ref().is_none_or(|(most, ..)| sigmas > *most) {
                    let at = Where {
                        direction: index / PREDICTION_INSTANTS,
                        share: shares()[index % PREDICTION_INSTANTS],
                        component,
                    };
                    best = Some((sigmas, *part, at, measured));
                }
            }
        }
    }
    let (sigmas, part, at, measured) = best?;
    let unit = if at.component == 2 { "rad" } else { "m" };
    let values = rivals.rival_columns.iter().zip(&measured).map(|(rival_columns, measured)| {
        let (value, var) = (measured.mean[at.component], (measured.known_var + measured.noise_var)[at.component]);
        (rival_columns.candidate.id().to_owned(), Value { value, sigma: Some(var.sqrt()), unit: unit.to_owned() })
    });
    let predicted = Predicted {
        direction: text::direction(&part.manoeuvre.schedule, at.direction).to_owned(),
        share_of_duration: at.share,
        component: ["along", "across", "heading"][at.component].to_owned(),
        values: values.collect(),
    };
    let mut sentence = text::where_to_measure(&part, &at);
    if sigmas < PLAN.single_measurement_sigmas {
        sentence.push_str(" No single measurement discriminates them: all measurements of the runs together do.");
    }
    Some((sentence, predicted))
}

/// The instants, as shares of a run's duration.
fn shares() -> [f64; PREDICTION_INSTANTS] {
    std::array::from_fn(|instant| (instant + 1) as f64 / PREDICTION_INSTANTS as f64)
}

/// Where the measurements of a direction and an instant stand among those of all runs, which are driven
/// direction by direction and phase by phase.
fn phases_at(index: usize) -> impl Iterator<Item = usize> {
    let (direction, instant) = (index / PREDICTION_INSTANTS, index % PREDICTION_INSTANTS);
    (0..PLAN.wheel_phases).map(move |phase| (direction * PLAN.wheel_phases + phase) * PREDICTION_INSTANTS + instant)
}

/// Runs of a part, each measured at its start and at every instant, by direction and phase.
struct PlannedRun {
    dataset: dataset::Dataset,
    reference: Model,
    /// What the noise makes of each measurement after the start.
    noise: Vec<Vector3<f64>>,
    runs: f64,
}

impl PlannedRun {
    fn new(base: &ModelFit<'_>, part: &Part, setting: &Setting) -> Option<Self> {
        let programs = part.manoeuvre.schedule.with_pairs(1).programs();
        let model = &base.solution.model;
        let driven = |measurements: &[f64]| -> Option<dataset::Dataset> {
            let mut runs = Vec::new();
            for program in &programs {
                for phase in (0..).take(PLAN.wheel_phases).map(phase_rad) {
                    let speed_m_s = part.manoeuvre.speed_m_s;
                    let mut run =
                        planned_run(program, setting, speed_m_s, model, phase, Measurements::At(measurements))?;
                    run.info.id = format!("{}_{}", program.id, runs.len());
                    runs.push(run);
                }
            }
            Some(of_runs(setting, runs))
        };
        // Each measurement by itself: one before it, which also errs, would say where the robot was.
        let of_instants: Vec<Vec<Vector3<f64>>> = shares()
            .iter()
            .map(|share| Some(base.on_planned_runs(&[driven(&[*share])?.session()]).end_variances()))
            .collect::<Option<_>>()?;
        let dataset = driven(&shares())?;
        let noise = (0..dataset.runs.len()).flat_map(|run| of_instants.iter().map(move |of| of.get(run).copied()));
        Some(Self {
            reference: model.clone(),
            noise: noise.collect::<Option<_>>()?,
            runs: f64::from(part.pairs),
            dataset,
        })
    }

    /// What a name says of every direction and instant.
    fn of(
        &self,
        model: &Model,
        all: &[Candidate],
        columns: &[usize],
        step: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Option<Vec<Measured>> {
        let parameters: usize = all.iter().map(|candidate| candidate.parameters().len()).sum();
        let mut named = model.clone();
        named.term_values.resize(parameters, 0.0);
        columns.iter().zip(step.iter()).for_each(|(column, by)| named.advance(column_at(*column), *by));
        let noise = estimation::Noise { variance: [1.0; 4], timing_s2: 0.0 };
        // Only the records matter here: dead reckoning takes the model that it is given.
        let fit = ModelFit::from_parameters(self.reference.clone(), noise, &[self.dataset.session()]);
        let measurements = |model: &Model| -> Option<Vec<Vector3<f64>>> {
            let ends = fit.dead_reckoned_measurements(model, &mut terms(all));
            let vector = |end: &EndError| Vector3::new(end.off.x_m, end.off.y_m, end.off.theta_rad);
            (ends.len() == self.noise.len()).then(|| ends.iter().map(vector).collect())
        };
        let here = measurements(&named)?;
        let slope = |(k, column): (usize, &usize)| -> Option<Vec<Vector3<f64>>> {
            let by = PLAN.derivative_step_sigmas * covariance[(k, k)].sqrt();
            let mut beside = named.clone();
            beside.advance(column_at(*column), by);
            Some(measurements(&beside)?.iter().zip(&here).map(|(there, here)| (there - here) / by).collect())
        };
        let slopes: Vec<Vec<Vector3<f64>>> = columns.par_iter().enumerate().map(slope).collect::<Option<_>>()?;
        let mean = |index, of: &dyn Fn(usize) -> Vector3<f64>| {
            phases_at(index).map(of).sum::<Vector3<f64>>() / PLAN.wheel_phases as f64
        };
        let measured = (0..here.len() / PLAN.wheel_phases).map(|index| {
            let own = mean(index, &|measurement| here[measurement]);
            let noise = mean(index, &|measurement| self.noise[measurement]);
            let spread =
                mean(index, &|measurement| (here[measurement] - own).component_mul(&(here[measurement] - own)));
            let slope: Vec<Vector3<f64>> =
                slopes.iter().map(|of| mean(index, &|measurement| of[measurement])).collect();
            let known_var = Vector3::from_fn(|component, _| {
                let slope = DVector::from_fn(slope.len(), |k, _| slope[k][component]);
                (slope.transpose() * covariance * &slope)[0].max(0.0)
            });
            Measured { mean: own, known_var, noise_var: (noise + spread) / self.runs }
        });
        Some(measured.collect())
    }
}

fn column_at(index: usize) -> Column {
    Column::BASE.get(index).copied().unwrap_or_else(|| Column::Term(index - Column::BASE.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_of_a_direction_and_an_instant_are_those_of_all_phases() {
        // Twelve instants and four phases: the second direction's third instant is that of runs 4 to 7.
        assert_eq!(phases_at(14).collect::<Vec<_>>(), [50, 62, 74, 86]);
        assert_eq!(phases_at(0).collect::<Vec<_>>(), [0, 12, 24, 36]);
        let shares = shares();
        assert!((shares[0] - 1.0 / 12.0).abs() < 1e-12 && shares[11] == 1.0);
        assert_eq!(column_at(2), Column::BASE[2]);
        assert_eq!(column_at(Column::BASE.len() + 3), Column::Term(3));
    }
}
