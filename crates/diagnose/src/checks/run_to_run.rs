//! Whether the wheelbase differs from run to run by more than its estimate's errors.

use estimation::{Column, total};

use crate::fits::augmented_model::AugmentedModel;
use crate::fits::statistics::p_of_differing_scores;

/// p-value of a wheelbase that differs so much between runs, were it constant: scores of the runs, each
/// with its variance.
///
/// Turn noise grows with the root of the turn, and is soon lost in that of the wheels; a wheelbase that is
/// drawn for each motion errs in proportion to the turn. With u_r the score of run r by the wheelbase, the
/// other free columns projected out, and V_r its variance, Σ u_r² is larger than Σ V_r.
/// Reference: Chesher 1984 (the score test of a random coefficient).
pub(crate) fn differs_from_run_to_run(model: &AugmentedModel<'_>) -> f64 {
    let runs = &model.fit.solution.pass.runs;
    let Some(equations) = total(runs) else { return 1.0 };
    let own = [Column::Separation.index()];
    let Some(projection) = model.fit.eliminated(&equations, &own) else { return 1.0 };
    p_of_differing_scores(runs.iter().filter(|run| run.count > 0.0).map(|run| {
        let score = projection.score_of(run, &equations, &own)[0];
        (score, projection.variance_of(run, &equations, &own)[(0, 0)])
    }))
}
