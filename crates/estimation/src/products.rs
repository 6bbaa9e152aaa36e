//! The sums of a segment's innovations, and the elimination of a start heading that is not measured.

use nalgebra::{DMatrix, DVector};

use crate::layout::Layout;
use crate::model::Column;
use crate::normal_equations::NormalEquations;
use crate::settings::{MIN_VARIANCE_PRODUCT, START_HEADINGS};

/// Which columns' products a normal equation has. Outer products grow with the square of the columns;
/// candidates that are tested one by one need none with each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Products {
    layout: Layout,
    /// Number of the first columns, which have products with all.
    common: usize,
    /// Those of the first columns whose products are taken, in order.
    rows: Vec<usize>,
    /// For each further column, the first of those of its part: it has products with these.
    first: Vec<usize>,
}

impl Products {
    /// Of columns the last of which come in parts: those of a part have products with what comes before all
    /// parts, and with each other.
    ///
    /// A fit steps along its `free` columns alone: products of two others stay zero. `None`: all are taken.
    pub(crate) fn of(layout: Layout, parts: &[usize], free: Option<&[Column]>) -> Self {
        let common = layout.columns() - parts.iter().sum::<usize>();
        let is_free =
            |free: &[Column], row: usize| free.iter().any(|column| column.index() == layout.in_equations(row));
        let is_taken = |row: &usize| free.is_none_or(|free| is_free(free, *row));
        let rows = (0..common).filter(is_taken).collect();
        let mut first = Vec::new();
        for part in parts {
            first.extend(std::iter::repeat_n(common + first.len(), *part));
        }
        Self { layout, common, rows, first }
    }
}

impl Products {
    /// The columns.
    pub(crate) const fn layout(&self) -> Layout {
        self.layout
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
    /// Of no innovation.
    pub(crate) fn new(products: &'p Products) -> Self {
        // One more for a free heading.
        let columns = products.layout.columns() + 1;
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

    /// Adds innovations v of variances s, uncorrelated, with derivatives j: all components of a measurement
    /// at once, as sums are read and written once for them.
    #[inline(always)]
    pub(crate) fn add<const N: usize>(&mut self, j: [&[f64]; N], v: [f64; N], s: [f64; N]) {
        let Self { products, columns, common, own, gradient, .. } = self;
        let (mut per_s, mut pull) = ([0.0; N], [0.0; N]);
        for k in 0..N {
            per_s[k] = 1.0 / s[k];
            pull[k] = per_s[k] * v[k];
        }
        add_multiples(gradient, j, pull);
        // Products with the columns before it stand in their rows; those of the heading are read as a whole.
        let heading = self.free.then_some((products.common, *columns - 1, 0));
        for (row, column, from) in products.rows.iter().map(|row| (*row, *row, *row)).chain(heading) {
            let scaled = scaled_column(j, column, per_s);
            add_multiples(&mut common[row * *columns + from..(row + 1) * *columns], beyond(j, from), scaled);
        }
        if own.len() == products.first.len() {
            // All parts are of one column, as they mostly are: many at a time.
            for (own_j, per_s) in beyond(j, products.common).into_iter().zip(per_s) {
                for (out, j) in own.iter_mut().zip(own_j) {
                    *out += j * per_s * j;
                }
            }
        } else {
            let mut own = &mut own[..];
            for (further, &first) in products.first.iter().enumerate() {
                let column = products.common + further;
                let (out, rest) = own.split_at_mut(column + 1 - first);
                add_multiples(out, beyond(j, first), scaled_column(j, column, per_s));
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

    /// The products of all columns of a normal equation; those that are not taken are zero.
    fn information(&self) -> DMatrix<f64> {
        let Products { layout, common, rows, first } = self.products;
        let columns = layout.columns_of_equations();
        let mut information = DMatrix::zeros(columns, columns);
        let mut set = |row: usize, column: usize, value: f64| {
            let at = (layout.in_equations(row), layout.in_equations(column));
            information[at] = value;
            information[(at.1, at.0)] = value;
        };
        for &row in rows {
            let products = &self.common[row * self.columns..][..layout.columns()];
            products[row..].iter().enumerate().for_each(|(beyond, value)| set(row, row + beyond, *value));
        }
        let mut own = self.own.iter();
        for (further, &first) in first.iter().enumerate() {
            let row = common + further;
            (first..=row).zip(&mut own).for_each(|(column, value)| set(row, column, *value));
        }
        information
    }

    /// The normal equation with the free heading eliminated, and the heading's response. What is not carried
    /// is zero.
    pub(crate) fn eliminated(&self, run: (usize, usize)) -> (NormalEquations, Option<HeadingResponse>) {
        let layout = self.products.layout;
        let carried = layout.columns();
        let of_equations = |of: &[f64]| {
            let mut all = vec![0.0; layout.columns_of_equations()];
            of.iter().enumerate().for_each(|(index, value)| all[layout.in_equations(index)] = *value);
            all
        };
        let mut equations = NormalEquations {
            run,
            information: self.information(),
            gradient: DVector::from_vec(of_equations(&self.gradient[..carried])),
            chi_square: self.chi_square,
            log_det: self.log_det + self.det.ln(),
            count: self.count,
        };
        let last = &self.common[self.products.common * self.columns..];
        if !self.free || last[carried] <= 0.0 {
            return (equations, None);
        }
        let (said, gradient) = (last[carried], self.gradient[carried]);
        // A heading of which the run says hardly anything stays where it is: what errors alone bend would
        // wander on for ever.
        let own = (said + START_HEADINGS.start_heading_precision).powi(2) / said;
        let cross = of_equations(&last[..carried]);
        let by: Vec<f64> = cross.iter().map(|cross| -cross / own).collect();
        for (row, by) in by.iter().enumerate() {
            equations.gradient[row] += by * gradient;
            for (column, cross) in cross.iter().enumerate() {
                equations.information[(row, column)] += by * cross;
            }
        }
        equations.chi_square -= gradient * gradient / own;
        equations.log_det += (said + START_HEADINGS.start_heading_precision).ln();
        equations.count -= 1.0;
        (equations, Some(HeadingResponse { rest: -gradient / own, by, information: own }))
    }
}

/// Response of a free start heading.
#[derive(Debug, Clone)]
pub(crate) struct HeadingResponse {
    /// Its own step, radians.
    pub(crate) rest: f64,
    /// Its step by each column.
    pub(crate) by: Vec<f64>,
    /// Its information, 1/rad².
    pub(crate) information: f64,
}

// Loops, and no closures over arrays: these would be called, and compiled without the kernel's instructions.

/// The rows from a column on.
#[inline(always)]
fn beyond<const N: usize>(mut rows: [&[f64]; N], from: usize) -> [&[f64]; N] {
    for row in &mut rows {
        *row = &row[from..];
    }
    rows
}

/// The rows' values in a column, each times its factor.
#[inline(always)]
fn scaled_column<const N: usize>(rows: [&[f64]; N], column: usize, mut by: [f64; N]) -> [f64; N] {
    for (by, row) in by.iter_mut().zip(rows) {
        *by *= row[column];
    }
    by
}

/// Adds to `out` as many values of each row as it has, times the row's factor.
#[inline(always)]
fn add_multiples<const N: usize>(out: &mut [f64], mut rows: [&[f64]; N], by: [f64; N]) {
    for row in &mut rows {
        *row = &row[..out.len()];
    }
    for (at, out) in out.iter_mut().enumerate() {
        for k in 0..N {
            *out += by[k] * rows[k][at];
        }
    }
}
