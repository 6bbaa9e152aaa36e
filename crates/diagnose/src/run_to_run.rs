//! Whether the wheelbase differs from run to run by more than its estimate's errors.

use estimation::{Column, total};

use crate::augmented_model::AugmentedModel;
use crate::statistics::p_of_chi_square;

/// p-value of a wheelbase that differs so much between runs, were it constant: scores of the runs, each
/// with its variance.
///
/// Turn noise grows with the root of the turn, and is soon lost in that of the wheels; a wheelbase that is
/// drawn for each motion errs in proportion to the turn. With u_r the score of run r by the wheelbase, the
/// other free columns projected out, and V_r its variance, Σ u_r² is a weighted sum of χ² variables. It is
/// approximated by one χ² of the same mean and variance.
/// References: Chesher 1984 (the score test of a random coefficient); Satterthwaite 1946.
pub(crate) fn differs_from_run_to_run(model: &AugmentedModel<'_>) -> f64 {
    let runs: Vec<_> = model.fit.solution.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    let Some(equations) = total(&model.fit.solution.pass.runs) else { return 1.0 };
    let own = [Column::Separation.index()];
    let Some(projection) = model.fit.eliminated(&equations, &own) else { return 1.0 };
    let (mut squares, mut mean, mut spread) = (0.0, 0.0, 0.0);
    for run in &runs {
        let variance = projection.variance_of(run, &equations, &own)[(0, 0)];
        squares += projection.score_of(run, &equations, &own)[0].powi(2);
        mean += variance;
        spread += variance * variance;
    }
    if runs.len() < 3 || mean <= 0.0 {
        return 1.0;
    }
    p_of_chi_square(squares * mean / spread, mean * mean / spread)
}
