//! Which derivatives a filter carries.
//!
//! Most fits free the geometry and terms alone: the extrinsics, the latency and a gyroscope's scale are then
//! in no step, and carrying derivatives by them takes longer than by the three geometry parameters.

use crate::model::Column;
use crate::pass_options::PassOptions;

/// The columns that a filter has: those of the geometry, perhaps those of instruments, those of terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Whether the columns of the instruments are among them.
    pub(crate) instruments: bool,
    /// How many columns terms have.
    pub(crate) parameters: usize,
}

impl Layout {
    /// All columns, with so many of terms.
    pub(crate) const fn whole(parameters: usize) -> Self {
        Self { instruments: true, parameters }
    }

    /// The columns that a pass over poses solves for, and all where it does not say. `own`: groups have
    /// instruments of their own.
    pub(crate) fn of(pass_options: &PassOptions<'_>, parameters: usize, own: bool) -> Self {
        let is_of_instrument =
            |column: &Column| !matches!(column, Column::Term(_)) && !Column::GEOMETRY.contains(column);
        let instruments = own || pass_options.free.is_none_or(|free| free.iter().any(is_of_instrument));
        Self { instruments, parameters }
    }

    /// Where the columns of terms begin.
    pub(crate) const fn first_term(self) -> usize {
        if self.instruments { Column::BASE.len() } else { Column::GEOMETRY.len() }
    }

    /// How many columns there are.
    pub(crate) const fn columns(self) -> usize {
        self.first_term() + self.parameters
    }

    /// How many columns a normal equation has.
    pub(crate) const fn columns_of_equations(self) -> usize {
        Column::BASE.len() + self.parameters
    }

    /// The index in a normal equation of a column, by its index here.
    pub(crate) const fn in_equations(self, index: usize) -> usize {
        if index < Column::GEOMETRY.len() { index } else { index + Column::BASE.len() - self.first_term() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_follow_the_geometry_where_nothing_of_an_instrument_is_free() {
        let free = [Column::LeftWheel, Column::Term(1)];
        let narrow = Layout::of(&PassOptions { free: Some(&free), ..PassOptions::default() }, 2, false);
        assert_eq!((narrow.columns(), narrow.columns_of_equations()), (5, 10));
        let at: Vec<usize> = (0..narrow.columns()).map(|index| narrow.in_equations(index)).collect();
        assert_eq!(at, [0, 1, 2, 8, 9]);
        let free = [Column::LeftWheel, Column::Latency];
        for (free, own) in [(Some(&free[..]), false), (None, false), (Some(&free[..1]), true)] {
            let whole = Layout::of(&PassOptions { free, ..PassOptions::default() }, 2, own);
            assert_eq!(whole, Layout::whole(2));
            assert!((0..whole.columns()).all(|index| whole.in_equations(index) == index));
        }
    }
}
