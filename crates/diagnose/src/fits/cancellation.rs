//! Effects that take each other back: a model that explains what was driven by the difference of two errors
//! that are larger than it.

use std::ops::Range;

use estimation::total;
use nalgebra::{DMatrix, DVector};

use crate::fits::augmented_model::AugmentedModel;
use crate::settings::SEARCH;

/// Whether effects of a model only cancel each other: each given the other is significant, and on any driving
/// but that which was recorded their difference is another.
pub(crate) fn effects_cancel(model: &AugmentedModel<'_>) -> bool {
    cancellation(model) > SEARCH.max_cancellation
}

/// How much more an effect would explain by itself, at the size that it has beside others, than it does
/// together with them: the largest θᵢᵀIᵢᵢθᵢ over θᵀIθ of any that are taken together, with the information I
/// that the free columns and the other effects leave.
fn cancellation(model: &AugmentedModel<'_>) -> f64 {
    let Some(equations) = total(&model.fit.solution.pass.runs) else { return 0.0 };
    let effects = model.candidates.len();
    let of_some = |chosen: u32| {
        let chosen: Vec<usize> = (0..effects).filter(|index| chosen >> index & 1 == 1).collect();
        let columns: Vec<usize> = chosen.iter().flat_map(|&index| model.columns(index)).collect();
        let sizes: Vec<f64> = chosen.iter().flat_map(|&index| model.estimates(index).as_slice().to_vec()).collect();
        let information = model.fit.eliminated(&equations, &columns)?.of_columns(&equations, &columns).information;
        let mut end = 0;
        let parts = chosen.iter().map(|&index| {
            let start = end;
            end += model.range(index).len();
            start..end
        });
        Some(largest_part(&information, &DVector::from_vec(sizes), parts))
    };
    (0..1_u32 << effects).filter(|chosen| chosen.count_ones() > 1).filter_map(of_some).fold(0.0, f64::max)
}

/// The largest θᵢᵀIᵢᵢθᵢ over θᵀIθ.
fn largest_part(
    information: &DMatrix<f64>,
    estimates: &DVector<f64>,
    parts: impl Iterator<Item = Range<usize>>,
) -> f64 {
    let explained = |range: Range<usize>| {
        let (own, size) = (estimates.rows_range(range.clone()), range.len());
        own.dot(&(information.view((range.start, range.start), (size, size)) * own))
    };
    let together = explained(0..estimates.len());
    parts.map(|part| explained(part) / together).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_that_take_each_other_back_explain_more_one_by_one() {
        // Correlation 0.9 between two of information 1. Sizes 1 and −1: each explains 1, both 2 − 1.8.
        let information = DMatrix::from_row_slice(3, 3, &[1.0, 0.9, 0.0, 0.9, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let of = |sizes: [f64; 3], parts: [Range<usize>; 2]| {
            largest_part(&information, &DVector::from_column_slice(&sizes), parts.into_iter())
        };
        assert!((of([1.0, -1.0, 0.0], [0..1, 1..2]) - 5.0).abs() < 1e-12);
        // Of one sense they help each other: 1 of 3.8. Rejects a ratio that goes by correlation alone.
        assert!((of([1.0, 1.0, 0.0], [0..1, 1..2]) - 1.0 / 3.8).abs() < 1e-12);
        // Parameters of one effect may cancel: together they are one part, of all that is explained but 1.
        assert!((of([1.0, -1.0, 1.0], [0..2, 2..3]) - 1.0 / 1.2).abs() < 1e-12);
    }
}
