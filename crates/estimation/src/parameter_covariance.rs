//! Covariance of a fit's parameters: what the likelihood says, and what the runs' scatter does.

use model_term::ModelTerm;
use nalgebra::DMatrix;
use rules::Rule;

use crate::model::Column;
use crate::model_fit::ModelFit;
use crate::normal_equations::{ClusterRobust, Information};
use crate::optimizer::Solution;
use crate::pass::pass;
use crate::pass_options::{OutlierGate, PassOptions};
use crate::settings::COMMON;
use crate::systematic_errors::{OwnScatter, Shifts, SystematicErrors};

impl ModelFit<'_> {
    /// Covariance of the free columns: the inverse information, and more of the scatter over runs the more
    /// there are beyond the parameters (cluster-robust, with the leverage of each run; Liang & Zeger 1986;
    /// Bell & McCaffrey 2002). Both add like variances that are known from so many runs each. A run that
    /// alone shows a parameter says nothing of its scatter; blocks of a run do not count, as what one leaves
    /// goes on in the next. A stated distortion of the map adds to it, and so does the rounding of recorded
    /// rates. `terms` are those of the fit. `None` where rounding is all that there is of it.
    #[must_use]
    pub fn covariance(&self, terms: &mut [Box<dyn ModelTerm>]) -> Option<DMatrix<f64>> {
        let free = self.free_basis();
        let (_, inverse) = self.solution.information(&self.columns)?.along(&free).solve()?;
        let runs = &self.solution.pass.runs;
        // Where nothing is determined, they have nothing to add to.
        let systematic = if inverse.is_empty() { None } else { self.systematic_errors(&free, terms) };
        let with_systematic = |covariance: DMatrix<f64>, own| match &systematic {
            Some(errors) => covariance + errors.added_covariance(own, &inverse),
            None => covariance,
        };
        let mut along = with_systematic(inverse.clone(), OwnScatter::NotCounted);
        let clusters: Vec<Information> = runs.iter().map(|run| run.of(&self.columns).along(&free)).collect();
        let spare = effective_number(&inverse, &clusters) - free.ncols() as f64;
        if spare > 0.0 {
            let mut robust = ClusterRobust::of(&inverse, clusters).covariance;
            if let Some(scale) = self.position(Column::GyroScale) {
                let sigma = self.records.gyro_scale_prior_sigma();
                // What is known of the scale did not come from the runs, and does not scatter over them.
                let by_scale = &inverse * free.row(scale).transpose() / sigma;
                robust += &by_scale * by_scale.transpose();
            }
            robust = with_systematic(robust, OwnScatter::Counted);
            along =
                (robust * spare + along * COMMON.information_weight_runs) / (spare + COMMON.information_weight_runs);
        }
        let mut whole = &free * along * free.transpose();
        if let Some(added) = &self.by_systematic_errors {
            whole += added;
        }
        with_variances(whole)
    }

    /// What systematic errors add to the covariance of the free columns; `None` where there are none.
    pub(crate) fn covariance_by_systematic_errors(&self) -> Option<DMatrix<f64>> {
        let free = self.free_basis();
        let (_, inverse) = self.solution.information(&self.columns)?.along(&free).solve()?;
        let errors = self.systematic_errors(&free, &mut []).filter(|_| !inverse.is_empty());
        let errors = Rule::SystematicCovariance.finds(errors)?;
        Some(&free * errors.added_covariance(OwnScatter::NotCounted, &inverse) * free.transpose())
    }

    /// How systematic errors shift the runs' gradients along a basis; `None` where there are none.
    fn systematic_errors(&self, free: &DMatrix<f64>, terms: &mut [Box<dyn ModelTerm>]) -> Option<SystematicErrors> {
        let Solution { model, noise, free_headings, .. } = &self.solution;
        // The wheels' turns are integrated once: they are the same wherever the poses are.
        let mut kept = None;
        SystematicErrors::of(&self.records, |records, shifts| {
            let by = kept.as_ref().filter(|_| shifts == Shifts::Poses);
            let (gate, keep) = (OutlierGate::Off, kept.is_none());
            let options = PassOptions { gate, keep, by, ..PassOptions::default() };
            let found = pass(records, &self.selections, model, noise, free_headings, terms, options);
            kept = kept.take().or(found.cached);
            found.runs.iter().map(|run| run.of(&self.columns).along(free)).collect()
        })
    }

    /// Are there errors that do not average out?
    #[must_use]
    pub fn has_systematic_errors(&self) -> bool {
        self.records.map.is_some() || self.records.segments.iter().any(|segment| segment.rate_rounding.is_any())
    }
}

/// How many runs that say equally much the runs are worth, Σ tr Aᵢ / Σ tr Aᵢ², with Aᵢ a run's share of the
/// information (Kish 1965). Where one alone shows a parameter, at most as many as there are parameters.
fn effective_number(inverse: &DMatrix<f64>, clusters: &[Information]) -> f64 {
    let shares = clusters.iter().map(|cluster| inverse * &cluster.matrix);
    let (sum, squares) =
        shares.fold((0.0, 0.0), |(sum, squares), share| (sum + share.trace(), squares + (&share * &share).trace()));
    if squares > 0.0 { sum / squares } else { 0.0 }
}

/// A covariance whose variances are numbers and not below 0, as rounding leaves them of information that only
/// rounding inverts.
fn with_variances(covariance: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let is_variance = |variance: &f64| variance.is_finite() && *variance >= 0.0;
    covariance.diagonal().iter().all(is_variance).then_some(covariance)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    #[test]
    fn runs_count_by_what_each_shows() {
        let run = |of: [f64; 2]| Information {
            gradient: DVector::zeros(2),
            matrix: DMatrix::from_diagonal(&DVector::from_row_slice(&of)),
        };
        let number = |runs: &[Information]| {
            let sum = runs.iter().fold(DMatrix::zeros(2, 2), |sum, run| sum + &run.matrix);
            effective_number(&sum.try_inverse().expect("both are shown"), runs)
        };
        // Ten alike.
        assert!((number(&vec![run([2.0, 3.0]); 10]) - 10.0).abs() < 1e-12);
        // Five show one parameter, five the other: for each there are five.
        let halves = [vec![run([1.0, 0.0]); 5], vec![run([0.0, 1.0]); 5]].concat();
        assert!((number(&halves) - 5.0).abs() < 1e-12);
        // One alone shows the second.
        let alone = [vec![run([1.0, 0.0]); 50], vec![run([0.0, 1.0])]].concat();
        assert!(number(&alone) < 2.0, "{}", number(&alone));
    }
}
