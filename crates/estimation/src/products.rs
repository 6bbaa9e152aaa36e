//! The sums of a segment's innovations, and the elimination of a start heading that is not measured.

use nalgebra::{DMatrix, DVector};

use crate::model::Column;
use crate::normal_equations::NormalEquations;
use crate::settings::MIN_VARIANCE_PRODUCT;

/// Which columns' products a normal equation has. Outer products grow with the square of the columns;
/// candidates that are tested one by one need none with each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Products {
    /// Number of the first columns, which have products with all.
    common: usize,
    /// Those of the first columns whose products are taken, in order.
    rows: Vec<usize>,
    /// For each further column, the first of those of its part: it has products with these.
    first: Vec<usize>,
}

impl Products {
    /// Of so many columns, the last of which come in parts: those of a part have products with what comes
    /// before all parts, and with each other.
    ///
    /// A fit steps along its `free` columns alone: products of two others stay zero. `None`: all are taken.
    pub(crate) fn of(columns: usize, parts: &[usize], free: Option<&[Column]>) -> Self {
        let common = columns - parts.iter().sum::<usize>();
        let is_taken = |row: &usize| free.is_none_or(|free| free.iter().any(|column| column.index() == *row));
        let rows = (0..common).filter(is_taken).collect();
        let mut first = Vec::new();
        for part in parts {
            first.extend(std::iter::repeat_n(common + first.len(), *part));
        }
        Self { common, rows, first }
    }
}

/// Normal equation of one segment, its free heading last.
pub(crate) struct Sums<'p> {
    products: &'p Products,
    columns: usize,
    /// Products with all columns: a row for each that comes first, and one for the heading.
    common: Vec<f64>,
    /// Products of each further column with those of its part up to itself.
    own: Vec<f64>,
    gradient: Vec<f64>,
    chi_square: f64,
    /// Sum of the logarithms of variances, and a product whose logarithm is still to be added: one logarithm
    /// serves many.
    log_det: f64,
    det: f64,
    count: f64,
    /// Is the last column, the start heading, free?
    pub(crate) free: bool,
}

impl<'p> Sums<'p> {
    /// Of no innovation; the columns are those of the normal equation.
    pub(crate) fn new(columns: usize, products: &'p Products) -> Self {
        // One more for a free heading.
        let columns = columns + 1;
        let own = products.first.iter().enumerate().map(|(further, first)| products.common + further + 1 - first).sum();
        Self {
            products,
            columns,
            common: vec![0.0; (products.common + 1) * columns],
            own: vec![0.0; own],
            gradient: vec![0.0; columns],
            chi_square: 0.0,
            log_det: 0.0,
            det: 1.0,
            count: 0.0,
            free: false,
        }
    }

    /// Adds innovations v of variances s, uncorrelated, with derivatives j: all components of a measurement at
    /// once, as sums are read and written once for them.
    #[inline(always)]
    pub(crate) fn add<const N: usize>(&mut self, j: [&[f64]; N], v: [f64; N], s: [f64; N]) {
        let Self { products, columns, common, own, gradient, .. } = self;
        let columns = *columns;
        let j = j.map(|j| &j[..columns]);
        let per_s = s.map(|s| 1.0 / s);
        let pull: [f64; N] = std::array::from_fn(|k| per_s[k] * v[k]);
        let gradient = &mut gradient[..columns];
        for column in 0..columns {
            for k in 0..N {
                gradient[column] += pull[k] * j[k][column];
            }
        }
        let last = self.free.then_some(columns - 1);
        let heading = last.map(|last| (products.common, last));
        for (row, column) in products.rows.iter().map(|row| (*row, *row)).chain(heading) {
            // Products with the columns before it stand in their rows; those of the heading are read as a whole.
            let from = if row == column { row } else { 0 };
            let scaled: [f64; N] = std::array::from_fn(|k| j[k][column] * per_s[k]);
            let out = &mut common[row * columns + from..(row + 1) * columns];
            let of = j.map(|j| &j[from..][..out.len()]);
            for at in 0..out.len() {
                for k in 0..N {
                    out[at] += scaled[k] * of[k][at];
                }
            }
        }
        if own.len() == products.first.len() {
            // All parts are of one column, as they mostly are: many at a time.
            let own = &mut own[..];
            let of = j.map(|j| &j[products.common..][..own.len()]);
            for at in 0..own.len() {
                for k in 0..N {
                    own[at] += of[k][at] * per_s[k] * of[k][at];
                }
            }
        } else {
            let mut own = &mut own[..];
            for (further, &first) in products.first.iter().enumerate() {
                let column = products.common + further;
                let (out, rest) = own.split_at_mut(column + 1 - first);
                let scaled: [f64; N] = std::array::from_fn(|k| j[k][column] * per_s[k]);
                let of = j.map(|j| &j[first..][..out.len()]);
                for at in 0..out.len() {
                    for k in 0..N {
                        out[at] += scaled[k] * of[k][at];
                    }
                }
                own = rest;
            }
        }
        for k in 0..N {
            self.chi_square += v[k] * pull[k];
            self.det *= s[k];
            if !(MIN_VARIANCE_PRODUCT..=MIN_VARIANCE_PRODUCT.recip()).contains(&self.det) {
                self.log_det += self.det.ln();
                self.det = 1.0;
            }
            self.count += 1.0;
        }
    }

    /// The products of all columns but the heading; those that are not taken are zero.
    fn information(&self, columns: usize) -> DMatrix<f64> {
        let mut information = DMatrix::zeros(columns, columns);
        let mut set = |row: usize, column: usize, value: f64| {
            information[(row, column)] = value;
            information[(column, row)] = value;
        };
        for &row in &self.products.rows {
            let products = &self.common[row * self.columns..][..columns];
            products[row..].iter().enumerate().for_each(|(beyond, value)| set(row, row + beyond, *value));
        }
        let mut own = self.own.iter();
        for (further, &first) in self.products.first.iter().enumerate() {
            let row = self.products.common + further;
            (first..=row).zip(&mut own).for_each(|(column, value)| set(row, column, *value));
        }
        information
    }

    /// The normal equation with the free heading eliminated, and the heading's response: its own step, and
    /// that by each column.
    pub(crate) fn eliminated(&self, run: (usize, usize), columns: usize) -> (NormalEquations, Option<(f64, Vec<f64>)>) {
        let mut equations = NormalEquations {
            run,
            information: self.information(columns),
            gradient: DVector::from_column_slice(&self.gradient[..columns]),
            chi_square: self.chi_square,
            log_det: self.log_det + self.det.ln(),
            count: self.count,
        };
        let last = &self.common[self.products.common * self.columns..];
        if !self.free || last[columns] <= 0.0 {
            return (equations, None);
        }
        let (own, gradient) = (last[columns], self.gradient[columns]);
        let by: Vec<f64> = last[..columns].iter().map(|cross| -cross / own).collect();
        for (row, by) in by.iter().enumerate() {
            equations.gradient[row] += by * gradient;
            for (column, cross) in last[..columns].iter().enumerate() {
                equations.information[(row, column)] += by * cross;
            }
        }
        equations.chi_square -= gradient * gradient / own;
        equations.log_det += own.ln();
        equations.count -= 1.0;
        (equations, Some((-gradient / own, by)))
    }
}
