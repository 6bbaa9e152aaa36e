//! Normal equations of the mean parameters around the model in force: the sums of one run, systems of chosen
//! columns, the Schur complement, inverse and cluster-robust covariance.
//!
//! With (I, g) over all columns, n the free ones and c others: I_c|n = I_cc − I_cn I_nn⁻¹ I_nc and g_c|n =
//! g_c − I_cn I_nn⁻¹ g_n.
//! References: Rao 1948 (score tests on I_c|n, g_c|n); White 1982 and Liang & Zeger 1986 (cluster-robust
//! covariance); Bell & McCaffrey 2002 (leverage of a cluster).

use nalgebra::{DMatrix, DVector};

use crate::model::Column;
use crate::settings::{FREE_EIGENVALUE, RIDGE};

/// Sums of a run's whitened innovations v/√s and their derivatives j/√s by the mean parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
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

impl NormalEquations {
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
        self.cost() + self.of(columns).cost_of(step)
    }

    /// The block of the information with these rows and columns.
    #[must_use]
    pub fn block(&self, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| self.information[(rows[i], columns[j])])
    }

    /// The gradient of these columns.
    #[must_use]
    pub fn gradient_of(&self, columns: &[usize]) -> DVector<f64> {
        DVector::from_fn(columns.len(), |i, _| self.gradient[columns[i]])
    }

    /// The normal equation of some columns.
    #[must_use]
    pub fn of(&self, columns: &[Column]) -> Information {
        let at: Vec<usize> = columns.iter().map(|column| column.index()).collect();
        Information { matrix: self.block(&at, &at), gradient: self.gradient_of(&at) }
    }
}

/// A system of chosen columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    /// Fisher information.
    pub matrix: DMatrix<f64>,
    /// Gradient of the cost.
    pub gradient: DVector<f64>,
}

impl Information {
    /// By how much a step raises the cost, to second order.
    #[must_use]
    pub fn cost_of(&self, step: &DVector<f64>) -> f64 {
        self.gradient.dot(step) + 0.5 * (step.transpose() * &self.matrix * step)[0]
    }

    /// The system along the columns of a basis.
    #[must_use]
    pub fn along(&self, basis: &DMatrix<f64>) -> Self {
        Self { matrix: basis.transpose() * &self.matrix * basis, gradient: basis.transpose() * &self.gradient }
    }

    /// The system with precisions added to its diagonal.
    #[must_use]
    pub fn with_precision(mut self, precision: impl IntoIterator<Item = f64>) -> Self {
        for (k, precision) in precision.into_iter().enumerate() {
            self.matrix[(k, k)] += precision;
        }
        self
    }

    /// The step to the minimum and the covariance there; `None` when some direction is not determined at all.
    #[must_use]
    pub fn solve(&self) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let covariance = inverse(&self.matrix, 0.0)?;
        Some((-(&covariance * &self.gradient), covariance))
    }
}

/// The inverse of an information matrix by Cholesky, after scaling its diagonal to one (radians, metres and
/// ratios differ by orders of magnitude); `ridge` is added to each diagonal element as a share of it. `None`
/// when a direction is not determined.
#[must_use]
pub fn inverse(matrix: &DMatrix<f64>, ridge: f64) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let size = matrix.diagonal().map(|diagonal| diagonal.max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (size[i] * size[j]) + if i == j { ridge } else { 0.0 });
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (size[i] * size[j])))
}

/// An orthonormal basis of the directions of `columns` columns that may move: those orthogonal to the fixed
/// ones.
#[must_use]
pub fn free_basis(columns: usize, fixed: &[DVector<f64>]) -> DMatrix<f64> {
    if fixed.is_empty() {
        return DMatrix::identity(columns, columns);
    }
    let fixed = DMatrix::from_columns(fixed);
    let eigen = (&fixed * fixed.transpose()).symmetric_eigen();
    let free: Vec<_> = (0..columns)
        .filter(|&k| eigen.eigenvalues[k] < FREE_EIGENVALUE)
        .map(|k| eigen.eigenvectors.column(k).into_owned())
        .collect();
    if free.is_empty() { DMatrix::zeros(columns, 0) } else { DMatrix::from_columns(&free) }
}

/// Normal equation of some columns with the free ones eliminated.
#[derive(Debug, Clone, PartialEq)]
pub struct Projected {
    /// I_c|n.
    pub information: DMatrix<f64>,
    /// g_c|n.
    pub gradient: DVector<f64>,
    /// Share of each column's information that is left.
    pub share: Vec<f64>,
}

/// The Schur complement: takes free columns out of normal equations.
#[derive(Debug, Clone)]
pub struct SchurComplement {
    free: DMatrix<f64>,
    columns: Vec<usize>,
    inverse: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl SchurComplement {
    /// Of free columns along a basis of theirs; `None` where they are not determined.
    #[must_use]
    pub fn of(equations: &NormalEquations, columns: &[Column], basis: DMatrix<f64>) -> Option<Self> {
        let own = equations.of(columns).along(&basis);
        let inverse = inverse(&own.matrix, RIDGE)?;
        let columns = columns.iter().map(|column| column.index()).collect();
        Some(Self { gradient: own.gradient, free: basis, columns, inverse })
    }

    /// The score of one run by some columns, less the part that the free columns, which all runs share,
    /// explain.
    #[must_use]
    pub fn score_of(&self, run: &NormalEquations, all: &NormalEquations, columns: &[usize]) -> DVector<f64> {
        let cross = all.block(columns, &self.columns) * &self.free;
        let free = self.free.transpose() * run.gradient_of(&self.columns);
        run.gradient_of(columns) - cross * &self.inverse * free
    }

    /// The variance of that score.
    #[must_use]
    pub fn variance_of(&self, run: &NormalEquations, all: &NormalEquations, columns: &[usize]) -> DMatrix<f64> {
        let weights = all.block(columns, &self.columns) * &self.free * &self.inverse * self.free.transpose();
        let cross = run.block(columns, &self.columns) * weights.transpose();
        run.block(columns, columns) - &cross - cross.transpose()
            + &weights * run.block(&self.columns, &self.columns) * weights.transpose()
    }

    /// The normal equation of some columns with the free ones eliminated.
    #[must_use]
    pub fn of_columns(&self, equations: &NormalEquations, columns: &[usize]) -> Projected {
        let cross = equations.block(columns, &self.columns) * &self.free;
        let own = equations.block(columns, columns);
        let information = &own - &cross * &self.inverse * cross.transpose();
        let share = (0..columns.len()).map(|k| if own[(k, k)] > 0.0 { information[(k, k)] / own[(k, k)] } else { 0.0 });
        let gradient = equations.gradient_of(columns) - &cross * &self.inverse * &self.gradient;
        Projected { share: share.collect(), gradient, information }
    }
}

/// Covariance of an estimate by the scatter of clusters: I⁻¹ (Σ u uᵀ) I⁻¹ with each cluster's score u taken
/// as it would be without the cluster in the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct ClusterRobust {
    /// The covariance.
    pub covariance: DMatrix<f64>,
    /// Clusters left out: the fit without them is not determined.
    pub left_out: usize,
}

impl ClusterRobust {
    /// Of clusters by the variance of their scores and the scores; `inverse` is that of the whole
    /// information.
    #[must_use]
    pub fn of(inverse: &DMatrix<f64>, clusters: impl IntoIterator<Item = Information>) -> Self {
        let n = inverse.nrows();
        let (mut scatter, mut count, mut left_out) = (DMatrix::zeros(n, n), 0.0, 0);
        for Information { matrix, gradient } in clusters {
            count += 1.0;
            let Some(others) = (DMatrix::identity(n, n) - matrix * inverse).try_inverse() else {
                left_out += 1;
                continue;
            };
            let without = others * gradient;
            scatter += &without * without.transpose();
        }
        Self { covariance: inverse * (scatter * ((count - 1.0) / count)) * inverse, left_out }
    }
}

/// The sum over runs, in their order.
#[must_use]
pub fn total(runs: &[NormalEquations]) -> Option<NormalEquations> {
    let (first, others) = runs.split_first()?;
    let mut sum = first.clone();
    others.iter().for_each(|run| sum.add(run, 1.0));
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three columns, the first free: I = [[2, 1, 0], [1, 3, 1], [0, 1, 4]], g = (2, 0, 1).
    fn equations() -> NormalEquations {
        let mut all = NormalEquations::new((0, 0), 3);
        all.information = DMatrix::from_row_slice(3, 3, &[2.0, 1.0, 0.0, 1.0, 3.0, 1.0, 0.0, 1.0, 4.0]);
        all.gradient = DVector::from_column_slice(&[2.0, 0.0, 1.0]);
        all
    }

    #[test]
    fn the_schur_complement_is_that_on_paper() {
        let all = equations();
        let left = SchurComplement::of(&all, &[Column::LeftWheel], free_basis(1, &[])).expect("determined");
        let Projected { information, gradient, share } = left.of_columns(&all, &[1, 2]);
        // I_cc − I_cn I_nn⁻¹ I_nc = [[3 − 1/2, 1], [1, 4]], g_c − I_cn I_nn⁻¹ g_n = (0 − 1/2·2, 1). The ridge
        // changes them by 1e-12.
        let expected = DMatrix::from_row_slice(2, 2, &[2.5, 1.0, 1.0, 4.0]);
        assert!((information - expected).amax() < 1e-11);
        assert!((gradient - DVector::from_column_slice(&[-1.0, 1.0])).amax() < 1e-11);
        assert!((share[0] - 2.5 / 3.0).abs() < 1e-11 && share[1] == 1.0);
    }

    #[test]
    fn the_inverse_is_scaled_and_refuses_what_is_not_determined() {
        let matrix = DMatrix::from_row_slice(2, 2, &[4e12, 1.0, 1.0, 1e-10]);
        let found = inverse(&matrix, 0.0).expect("regular");
        // Determinant 4e12 · 1e-10 − 1 = 399; a few roundings of each element.
        let expected = DMatrix::from_row_slice(2, 2, &[1e-10, -1.0, -1.0, 4e12]) / 399.0;
        assert!(found.iter().zip(expected.iter()).all(|(found, of)| (found / of - 1.0).abs() < 1e-12), "{found}");
        assert!(inverse(&DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0 - 1e-9]), 0.0).is_none());
    }

    #[test]
    fn a_basis_leaves_out_the_fixed_directions() {
        let fixed = DVector::from_column_slice(&[0.6, 0.8, 0.0]);
        let basis = free_basis(3, std::slice::from_ref(&fixed));
        assert_eq!(basis.ncols(), 2);
        assert!((basis.transpose() * fixed).amax() < 1e-12);
    }

    #[test]
    fn clusters_that_agree_have_the_covariance_of_their_mean() {
        // One parameter, four runs of unit information: θ = mean, scores ∓1 about it. The score without the
        // run is u/(1 − 1/4), so the covariance is (1/4)² · 4 · (4/3)² · 3/4 = 1/3: the sample variance 4/3
        // over four.
        let runs = [1.0, -1.0, 1.0, -1.0].map(|score| Information {
            matrix: DMatrix::from_element(1, 1, 1.0),
            gradient: DVector::from_element(1, score),
        });
        let found = ClusterRobust::of(&DMatrix::from_element(1, 1, 0.25), runs);
        assert!((found.covariance[(0, 0)] - 1.0 / 3.0).abs() < 1e-15 && found.left_out == 0);
        // A run that is all there is has no fit without it.
        let alone = [Information { matrix: DMatrix::from_element(1, 1, 4.0), gradient: DVector::from_element(1, 1.0) }];
        assert_eq!(ClusterRobust::of(&DMatrix::from_element(1, 1, 0.25), alone).left_out, 1);
    }
}
