//! The sums of a chain's innovations, and the elimination of a start heading that nobody saw.

use dataset::ModelTerm;

use super::evidence::Evidence;
use super::model::Column;

/// Which columns' products a normal equation has. Outer products grow with the square of the columns; candidates that are tested one by one need none with
/// each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Products {
    /// So many columns come first, which have products with all.
    common: usize,
    /// For each further column, the first of those of its term: it has products with these.
    first: Vec<usize>,
}

impl Products {
    /// Those of all columns with each other; where terms stand apart from one on, of its columns and those of the ones after with the others' and their own.
    pub(crate) fn of(terms: &[Box<dyn ModelTerm>], apart_from: Option<usize>) -> Self {
        let (own, apart) = terms.split_at(apart_from.unwrap_or(terms.len()).min(terms.len()));
        let common = Column::BASE.len() + own.iter().map(|term| term.parameters().len()).sum::<usize>();
        let mut first = Vec::new();
        for term in apart {
            first.extend(std::iter::repeat_n(common + first.len(), term.parameters().len()));
        }
        Self { common, first }
    }
}

/// Normal equation of one chain, its free heading last.
pub(crate) struct Sums<'p> {
    products: &'p Products,
    columns: usize,
    information: Vec<f64>,
    gradient: Vec<f64>,
    chi_square: f64,
    log_det: f64,
    count: f64,
    /// Is the last column, the start heading, free?
    pub(crate) free: bool,
}

impl<'p> Sums<'p> {
    /// Of no innovation; the columns are those of the evidence.
    pub(crate) fn new(columns: usize, products: &'p Products) -> Self {
        // One more for a free heading.
        let columns = columns + 1;
        Self {
            products,
            columns,
            information: vec![0.0; columns * columns],
            gradient: vec![0.0; columns],
            chi_square: 0.0,
            log_det: 0.0,
            count: 0.0,
            free: false,
        }
    }

    /// Adds an innovation v of variance s with derivatives j.
    pub(crate) fn add(&mut self, j: &[f64], v: f64, s: f64) {
        let per_s = 1.0 / s;
        for (row, &a) in j.iter().enumerate() {
            let scaled = a * per_s;
            if scaled != 0.0 {
                self.gradient[row] += scaled * v;
                let out = &mut self.information[row * self.columns..][..=row];
                let add = |(out, b): (&mut f64, &f64)| *out += scaled * b;
                match row.checked_sub(self.products.common).and_then(|further| self.products.first.get(further)) {
                    Some(&first) => {
                        out[..self.products.common].iter_mut().zip(j).for_each(add);
                        out[first..].iter_mut().zip(&j[first..]).for_each(add);
                    }
                    None => out.iter_mut().zip(j).for_each(add),
                }
            }
        }
        self.chi_square += v * v * per_s;
        self.log_det += s.ln();
        self.count += 1.0;
    }

    /// The evidence with the free heading at its best, and how that follows the others: at rest, and by each column.
    pub(crate) fn eliminated(&self, run: (usize, usize), columns: usize) -> (Evidence, Option<(f64, Vec<f64>)>) {
        let mut evidence = Evidence::new(run, columns);
        for row in 0..columns {
            evidence.gradient[row] = self.gradient[row];
            for column in 0..=row {
                let value = self.information[row * self.columns + column];
                evidence.information[(row, column)] = value;
                evidence.information[(column, row)] = value;
            }
        }
        (evidence.chi_square, evidence.log_det, evidence.count) = (self.chi_square, self.log_det, self.count);
        let last = &self.information[columns * self.columns..];
        if !self.free || last[columns] <= 0.0 {
            return (evidence, None);
        }
        let (own, gradient) = (last[columns], self.gradient[columns]);
        let by: Vec<f64> = last[..columns].iter().map(|cross| -cross / own).collect();
        for (row, by) in by.iter().enumerate() {
            evidence.gradient[row] += by * gradient;
            for (column, cross) in last[..columns].iter().enumerate() {
                evidence.information[(row, column)] += by * cross;
            }
        }
        evidence.chi_square -= gradient * gradient / own;
        evidence.log_det += own.ln();
        evidence.count -= 1.0;
        (evidence, Some((-gradient / own, by)))
    }
}
