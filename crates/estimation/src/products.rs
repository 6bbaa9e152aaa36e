//! The sums of a segment's innovations, and the elimination of a start heading that is not measured.

use nalgebra::{DMatrix, DVector};

use crate::normal_equations::NormalEquations;
use crate::settings::MIN_VARIANCE_PRODUCT;

/// Which columns' products a normal equation has. Outer products grow with the square of the columns;
/// candidates that are tested one by one need none with each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Products {
    /// Number of the first columns, which have products with all.
    common: usize,
    /// For each further column, the first of those of its part: it has products with these.
    first: Vec<usize>,
}

impl Products {
    /// Of so many columns, the last of which come in parts: those of a part have products with what comes
    /// before all parts, and with each other.
    pub(crate) fn of(columns: usize, parts: &[usize]) -> Self {
        let common = columns - parts.iter().sum::<usize>();
        let mut first = Vec::new();
        for part in parts {
            first.extend(std::iter::repeat_n(common + first.len(), *part));
        }
        Self { common, first }
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

    /// Adds an innovation v of variance s with derivatives j.
    #[inline(always)]
    pub(crate) fn add(&mut self, j: &[f64], v: f64, s: f64) {
        let per_s = 1.0 / s;
        for (gradient, j) in self.gradient.iter_mut().zip(j) {
            *gradient += per_s * v * j;
        }
        let last = if self.free { Some(&j[self.columns - 1]) } else { None };
        for (row, a) in self.common.chunks_exact_mut(self.columns).zip(j[..self.products.common].iter().chain(last)) {
            let scaled = a * per_s;
            for (out, b) in row.iter_mut().zip(j) {
                *out += scaled * b;
            }
        }
        if self.own.len() == self.products.first.len() {
            // All parts are of one column, as they mostly are: many at a time.
            for (out, j) in self.own.iter_mut().zip(&j[self.products.common..]) {
                *out += j * per_s * j;
            }
        } else {
            let mut own = &mut self.own[..];
            for (further, &first) in self.products.first.iter().enumerate() {
                let column = self.products.common + further;
                let (out, rest) = own.split_at_mut(column + 1 - first);
                let scaled = j[column] * per_s;
                for (out, b) in out.iter_mut().zip(&j[first..]) {
                    *out += scaled * b;
                }
                own = rest;
            }
        }
        self.chi_square += v * v * per_s;
        self.det *= s;
        if !(MIN_VARIANCE_PRODUCT..=MIN_VARIANCE_PRODUCT.recip()).contains(&self.det) {
            self.log_det += self.det.ln();
            self.det = 1.0;
        }
        self.count += 1.0;
    }

    /// The products of all columns but the heading; those that are not taken are zero.
    fn information(&self, columns: usize) -> DMatrix<f64> {
        let mut information = DMatrix::zeros(columns, columns);
        let mut set = |row: usize, column: usize, value: f64| {
            information[(row, column)] = value;
            information[(column, row)] = value;
        };
        for (row, products) in self.common.chunks_exact(self.columns).take(self.products.common).enumerate() {
            products[row..columns].iter().enumerate().for_each(|(beyond, value)| set(row, row + beyond, *value));
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
