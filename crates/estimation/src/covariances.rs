//! Symmetric matrices of a pose, several at a time: the filter's covariance, and its derivatives by the
//! logarithm of each variance.

use kinematics::Rotation;
use nalgebra::{Matrix3, Vector3};

/// Several symmetric matrices of a pose, element by element: each operation acts on all of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Covariances<const N: usize> {
    xx: [f64; N],
    xy: [f64; N],
    yy: [f64; N],
    xt: [f64; N],
    yt: [f64; N],
    tt: [f64; N],
}

/// Row and column of each element.
const ELEMENTS: [(usize, usize); 6] = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)];

pub(crate) type Covariance = Covariances<1>;

impl<const N: usize> Covariances<N> {
    pub(crate) const ZERO: Self =
        Self { xx: [0.0; N], xy: [0.0; N], yy: [0.0; N], xt: [0.0; N], yt: [0.0; N], tt: [0.0; N] };

    #[inline(always)]
    pub(crate) fn of(matrices: [&Matrix3<f64>; N]) -> Self {
        let at = |row: usize, column: usize| matrices.map(|matrix| matrix[(row, column)]);
        Self { xx: at(0, 0), xy: at(0, 1), yy: at(1, 1), xt: at(0, 2), yt: at(1, 2), tt: at(2, 2) }
    }

    /// F P Fᵀ for a step of the pose by (dx, dy): F = [1 0 a; 0 1 b; 0 0 1] with a = −dy, b = dx.
    #[inline(always)]
    pub(super) fn carry(&mut self, a: f64, b: f64) {
        for k in 0..N {
            let (xt, yt, tt) = (self.xt[k], self.yt[k], self.tt[k]);
            self.xx[k] += a * (2.0 * xt + a * tt);
            self.xy[k] += a * yt + b * xt + a * b * tt;
            self.yy[k] += b * (2.0 * yt + b * tt);
            self.xt[k] += a * tt;
            self.yt[k] += b * tt;
        }
    }

    /// R P Rᵀ for a turn of the frame.
    #[inline(always)]
    pub(super) fn turned(&self, Rotation { sin, cos }: Rotation) -> Self {
        let mut turned = Self::ZERO;
        for k in 0..N {
            let (xx, xy, yy) = (self.xx[k], self.xy[k], self.yy[k]);
            turned.xx[k] = cos * cos * xx - 2.0 * sin * cos * xy + sin * sin * yy;
            turned.xy[k] = sin * cos * (xx - yy) + (cos * cos - sin * sin) * xy;
            turned.yy[k] = sin * sin * xx + 2.0 * sin * cos * xy + cos * cos * yy;
            turned.xt[k] = cos * self.xt[k] - sin * self.yt[k];
            turned.yt[k] = sin * self.xt[k] + cos * self.yt[k];
            turned.tt[k] = self.tt[k];
        }
        turned
    }

    #[inline(always)]
    pub(super) fn times(mut self, by: [f64; N]) -> Self {
        for element in self.elements() {
            for (element, by) in element.iter_mut().zip(by) {
                *element *= by;
            }
        }
        self
    }

    /// Adds matrix `of` of others to matrix `at`.
    #[inline(always)]
    pub(super) fn add<const M: usize>(&mut self, at: usize, others: &Covariances<M>, of: usize) {
        self.xx[at] += others.xx[of];
        self.xy[at] += others.xy[of];
        self.yy[at] += others.yy[of];
        self.xt[at] += others.xt[of];
        self.yt[at] += others.yt[of];
        self.tt[at] += others.tt[of];
    }

    #[inline(always)]
    fn elements(&mut self) -> [&mut [f64; N]; 6] {
        [&mut self.xx, &mut self.xy, &mut self.yy, &mut self.xt, &mut self.yt, &mut self.tt]
    }

    /// Adds `times` the outer product of a column to matrix `at`.
    #[inline(always)]
    pub(super) fn add_outer(&mut self, at: usize, column: &Vector3<f64>, times: f64) {
        self.xx[at] += column.x * column.x * times;
        self.xy[at] += column.x * column.y * times;
        self.yy[at] += column.y * column.y * times;
        self.xt[at] += column.x * column.z * times;
        self.yt[at] += column.y * column.z * times;
        self.tt[at] += column.z * column.z * times;
    }

    /// Matrix `of`.
    pub(crate) fn matrix(&self, of: usize) -> Matrix3<f64> {
        let Self { xx, xy, yy, xt, yt, tt } = self;
        Matrix3::new(xx[of], xy[of], xt[of], xy[of], yy[of], yt[of], xt[of], yt[of], tt[of])
    }

    /// P h: the three coordinates of each.
    #[allow(clippy::needless_range_loop)] // nine arrays side by side
    #[inline(always)]
    pub(crate) fn along(&self, h: &Vector3<f64>) -> [[f64; N]; 3] {
        let mut along = [[0.0; N]; 3];
        for k in 0..N {
            along[0][k] = self.xx[k] * h.x + self.xy[k] * h.y + self.xt[k] * h.z;
            along[1][k] = self.xy[k] * h.x + self.yy[k] * h.y + self.yt[k] * h.z;
            along[2][k] = self.xt[k] * h.x + self.yt[k] * h.y + self.tt[k] * h.z;
        }
        along
    }

    /// P − A P M − (A P M)ᵀ − K (P − P_x) Kᵀ, with P_x `after`, A `left` and M `right`.
    #[allow(clippy::needless_range_loop)] // arrays side by side
    #[inline(always)]
    pub(super) fn smoothed(
        &self,
        after: &Self,
        gain: &Matrix3<f64>,
        left: &Matrix3<f64>,
        right: &Matrix3<f64>,
    ) -> Self {
        let (mut learnt, mut after) = (*self, *after);
        for (learnt, after) in learnt.elements().into_iter().zip(after.elements()) {
            for k in 0..N {
                learnt[k] -= after[k];
            }
        }
        let half = self.between(left, right);
        let learnt = learnt.between(gain, &gain.transpose());
        let mut smoothed = *self;
        for (element, (row, column)) in smoothed.elements().into_iter().zip(ELEMENTS) {
            for k in 0..N {
                element[k] -= half[row][column][k] + half[column][row][k] + learnt[row][column][k];
            }
        }
        smoothed
    }

    /// A P M.
    #[allow(clippy::needless_range_loop)] // arrays side by side
    #[inline(always)]
    fn between(&self, left: &Matrix3<f64>, right: &Matrix3<f64>) -> [[[f64; N]; 3]; 3] {
        let Self { xx, xy, yy, xt, yt, tt } = self;
        let rows = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
        let mut half = [[[0.0; N]; 3]; 3];
        let mut product = [[[0.0; N]; 3]; 3];
        for row in 0..3 {
            for column in 0..3 {
                for k in 0..N {
                    half[row][column][k] = left[(row, 0)] * rows[0][column][k]
                        + left[(row, 1)] * rows[1][column][k]
                        + left[(row, 2)] * rows[2][column][k];
                }
            }
            for column in 0..3 {
                for k in 0..N {
                    product[row][column][k] = half[row][0][k] * right[(0, column)]
                        + half[row][1][k] * right[(1, column)]
                        + half[row][2][k] * right[(2, column)];
                }
            }
        }
        product
    }

    /// P′ − P′h kᵀ − k (P′h)ᵀ + s′ k kᵀ.
    #[inline(always)]
    pub(super) fn lower_with_gain(&mut self, gain: &Vector3<f64>, ph_by: &[[f64; N]; 3], s_by: &[f64; N]) {
        let [px, py, pt] = ph_by;
        for k in 0..N {
            let (sx, sy, st) = (s_by[k] * gain.x, s_by[k] * gain.y, s_by[k] * gain.z);
            self.xx[k] -= (2.0 * px[k] - sx) * gain.x;
            self.xy[k] -= px[k] * gain.y + (py[k] - sy) * gain.x;
            self.yy[k] -= (2.0 * py[k] - sy) * gain.y;
            self.xt[k] -= px[k] * gain.z + (pt[k] - st) * gain.x;
            self.yt[k] -= py[k] * gain.z + (pt[k] - st) * gain.y;
            self.tt[k] -= (2.0 * pt[k] - st) * gain.z;
        }
    }
}

impl Covariance {
    /// P − k (P h)ᵀ.
    #[inline(always)]
    pub(crate) fn lower(&mut self, gain: &Vector3<f64>, ph: &Vector3<f64>) {
        self.xx[0] -= gain.x * ph.x;
        self.xy[0] -= gain.x * ph.y;
        self.yy[0] -= gain.y * ph.y;
        self.xt[0] -= gain.x * ph.z;
        self.yt[0] -= gain.y * ph.z;
        self.tt[0] -= gain.z * ph.z;
    }
}
