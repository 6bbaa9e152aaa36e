//! Extrinsics and latency of groups: of each session, or of each run.
//!
//! With the group's own columns o and all others n, the group's normal equation gives o = −I_oo⁻¹ (g_o + I_on
//! n). A run's normal equation with that put in is I_nn − A I_on − I_no Aᵀ + A I_oo Aᵀ with A = I_no I_oo⁻¹
//! of its group: the users of normal equations need not know of o. A weak prior keeps o at its common value
//! where a group does not determine it.
//! Reference: Neyman & Scott 1948: many nuisances of few data each bias a variance, so that they must gain on
//! held-out data.

use nalgebra::{DMatrix, DVector};

use crate::model::{Column, GroupExtrinsics, Model};
use crate::normal_equations::NormalEquations;
use crate::settings::{COMMON, LATENCY_PRIOR_SIGMA_S};

/// Response of a group's own columns: their own step, and that by each column of the normal equation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GroupResponse {
    pub(crate) group: (usize, usize),
    rest: DVector<f64>,
    by: DMatrix<f64>,
    information: DMatrix<f64>,
}

impl GroupResponse {
    /// How many columns the group has for itself.
    pub(crate) fn columns(&self) -> usize {
        self.rest.len()
    }

    /// The step of the own columns that follows from a step of some others.
    pub(crate) fn step(&self, columns: &[Column], step: &DVector<f64>) -> DVector<f64> {
        columns
            .iter()
            .zip(step.iter())
            .fold(self.rest.clone(), |sum, (column, by)| sum + self.by.column(column.index()) * *by)
    }

    /// Squared length of a step of the own columns, over its variance.
    pub(crate) fn squared(&self, step: &DVector<f64>) -> f64 {
        (step.transpose() * &self.information * step)[0]
    }
}

impl GroupExtrinsics {
    /// Takes the own columns out of the normal equations of runs or parts of runs; the model is the one in
    /// force.
    pub(crate) fn eliminate(&self, equations: &mut [NormalEquations], model: &Model) -> Vec<GroupResponse> {
        let at: Vec<usize> = self.columns.iter().map(|column| column.index()).collect();
        let mut groups: Vec<(usize, usize)> =
            equations.iter().map(|equations| self.grouping.group(equations.run)).collect();
        groups.sort_unstable();
        groups.dedup();
        groups
            .into_iter()
            .filter_map(|group| {
                let in_group = |equations: &NormalEquations| self.grouping.group(equations.run) == group;
                let mut sum = NormalEquations::new(group, equations.first()?.gradient.len());
                equations.iter().filter(|equations| in_group(equations)).for_each(|equations| sum.add(equations, 1.0));
                let pull = self.pull(model, group);
                let own = sum.of(&self.columns).with_precision(pull.iter().map(|pull| pull.1)).matrix;
                let inverse = own.clone().cholesky()?.inverse();
                let mut cross = DMatrix::from_fn(at.len(), sum.gradient.len(), |i, j| sum.information[(at[i], j)]);
                at.iter().for_each(|&column| cross.column_mut(column).fill(0.0));
                let by = -(&inverse * cross);
                let rest = -(&inverse * DVector::from_fn(at.len(), |i, _| sum.gradient[at[i]] + pull[i].0));
                equations
                    .iter_mut()
                    .filter(|equations| in_group(equations))
                    .for_each(|part| substitute(part, &at, &by));
                Some(GroupResponse { group, rest, by, information: own })
            })
            .collect()
    }

    /// Is a column of a group determined better than by its prior?
    pub(crate) fn is_shown(&self, response: &GroupResponse, column: Column) -> bool {
        self.sigma(response, column)
            .is_some_and(|sigma| sigma < COMMON.max_posterior_to_prior_sigma * prior_sigma(column))
    }

    /// Standard deviation of a column of a group, the common values given.
    pub(crate) fn sigma(&self, response: &GroupResponse, column: Column) -> Option<f64> {
        let at = self.columns.iter().position(|own| *own == column)?;
        Some(response.information.clone().cholesky()?.inverse()[(at, at)].sqrt())
    }

    /// Gradient and curvature of −log prior of each own column about the common value.
    fn pull(&self, model: &Model, group: (usize, usize)) -> Vec<(f64, f64)> {
        let common = model.common_instrument();
        let own = self.of.get(&group).copied().unwrap_or(common);
        self.columns
            .iter()
            .map(|column| {
                let sd = prior_sigma(*column);
                let off = match column {
                    Column::SensorX => own.body_from_sensor.x_m - common.body_from_sensor.x_m,
                    Column::SensorY => own.body_from_sensor.y_m - common.body_from_sensor.y_m,
                    Column::SensorTheta => own.body_from_sensor.theta_rad - common.body_from_sensor.theta_rad,
                    _ => own.latency_s - common.latency_s,
                };
                (off / (sd * sd), 1.0 / (sd * sd))
            })
            .collect()
    }
}

fn prior_sigma(column: Column) -> f64 {
    match column {
        Column::SensorX | Column::SensorY => COMMON.extrinsics_prior_sigma_m,
        Column::SensorTheta => COMMON.extrinsics_prior_sigma_rad,
        _ => LATENCY_PRIOR_SIGMA_S,
    }
}

/// Eliminates own columns, whose response to the others is `by`, from a normal equation; their rows and
/// columns are zero afterwards.
fn substitute(equations: &mut NormalEquations, at: &[usize], by: &DMatrix<f64>) {
    let n = equations.gradient.len();
    let own = DMatrix::from_fn(at.len(), at.len(), |i, j| equations.information[(at[i], at[j])]);
    let cross = DMatrix::from_fn(at.len(), n, |i, j| equations.information[(at[i], j)]);
    let gradient = DVector::from_fn(at.len(), |i, _| equations.gradient[at[i]]);
    let mixed = by.transpose() * &cross;
    equations.information += &mixed + mixed.transpose() + by.transpose() * own * by;
    equations.gradient += by.transpose() * gradient;
    for &column in at {
        equations.information.column_mut(column).fill(0.0);
        equations.information.row_mut(column).fill(0.0);
        equations.gradient[column] = 0.0;
    }
}
