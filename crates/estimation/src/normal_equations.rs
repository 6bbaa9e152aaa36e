//! What one run says of the mean parameters: a normal equation around the model in force.

use nalgebra::{DMatrix, DVector};

use crate::model::Column;

/// Sums of a run's whitened innovations v/√s and their derivatives j/√s by the mean parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Which run: session and run in the order given.
    pub run: (usize, usize),
    /// Σ j jᵀ/s.
    pub information: DMatrix<f64>,
    /// Σ j v/s: the gradient of half of [`Self::chi_square`].
    pub gradient: DVector<f64>,
    /// Σ v²/s.
    pub chi_square: f64,
    /// Σ ln s.
    pub log_det: f64,
    /// How many scalar innovations.
    pub count: f64,
}

impl Evidence {
    pub(crate) fn new(run: (usize, usize), columns: usize) -> Self {
        Self {
            run,
            information: DMatrix::zeros(columns, columns),
            gradient: DVector::zeros(columns),
            chi_square: 0.0,
            log_det: 0.0,
            count: 0.0,
        }
    }

    /// Adds another's sums, each times `weight`.
    pub fn add(&mut self, other: &Self, weight: f64) {
        self.information += weight * &other.information;
        self.gradient += weight * &other.gradient;
        self.chi_square += weight * other.chi_square;
        self.log_det += weight * other.log_det;
        self.count += weight * other.count;
    }

    /// −log likelihood at the model in force, without its constant.
    #[must_use]
    pub fn cost(&self) -> f64 {
        0.5 * (self.chi_square + self.log_det)
    }

    /// −log likelihood after a step of some columns, to second order.
    #[must_use]
    pub fn cost_after(&self, columns: &[Column], step: &DVector<f64>) -> f64 {
        let Information { matrix, gradient } = self.of(columns);
        self.cost() + gradient.dot(step) + 0.5 * (step.transpose() * matrix * step)[0]
    }

    /// The normal equation of some columns.
    #[must_use]
    pub fn of(&self, columns: &[Column]) -> Information {
        let at: Vec<usize> = columns.iter().map(|column| column.index()).collect();
        Information {
            matrix: DMatrix::from_fn(at.len(), at.len(), |i, j| self.information[(at[i], at[j])]),
            gradient: DVector::from_fn(at.len(), |i, _| self.gradient[at[i]]),
        }
    }
}

/// A normal equation of chosen columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    /// Fisher information.
    pub matrix: DMatrix<f64>,
    /// Gradient of the cost.
    pub gradient: DVector<f64>,
}

impl Information {
    /// The step to the minimum and the covariance there; `None` when some direction is not determined at all.
    #[must_use]
    pub fn solve(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        // In columns of like size: radians, metres and ratios differ by orders of magnitude.
        let size = self.matrix.diagonal().map(|diagonal| diagonal.max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(size.len(), size.len(), |i, j| self.matrix[(i, j)] / (size[i] * size[j]));
        let inverse = scaled.cholesky()?.inverse();
        let covariance = DMatrix::from_fn(size.len(), size.len(), |i, j| inverse[(i, j)] / (size[i] * size[j]));
        Some((-(&covariance * &self.gradient), covariance))
    }
}

/// The sum over runs, in their order.
pub(crate) fn total(runs: &[Evidence]) -> Option<Evidence> {
    let (first, others) = runs.split_first()?;
    let mut sum = first.clone();
    others.iter().for_each(|run| sum.add(run, 1.0));
    Some(sum)
}
