//! The covariance of one measured pose, as a row of the truth states it.

use crate::settings::MIN_DETERMINANT;

/// Covariance of the errors of one measured pose, in the room's frame.
///
/// Zeros say that a part is not known: of all elements with a position, or of all with the heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseCovariance {
    /// Variance of x, m².
    pub xx_m2: f64,
    /// Covariance of x and y, m².
    pub xy_m2: f64,
    /// Covariance of x and heading, m rad.
    pub xt_m_rad: f64,
    /// Variance of y, m².
    pub yy_m2: f64,
    /// Covariance of y and heading, m rad.
    pub yt_m_rad: f64,
    /// Variance of the heading, rad².
    pub tt_rad2: f64,
}

impl PoseCovariance {
    /// The columns of `truth.csv`, in the order of the fields.
    pub const COLUMNS: [&str; 6] = ["cov_xx", "cov_xy", "cov_xt", "cov_yy", "cov_yt", "cov_tt"];

    /// The covariance with these elements, in the order of [`Self::COLUMNS`]; `None` where all are zero, as
    /// drivers without a covariance write.
    ///
    /// # Errors
    /// Why the elements are those of no covariance.
    pub fn stated(elements: [f64; 6]) -> Result<Option<Self>, &'static str> {
        let [xx, xy, xt, yy, yt, tt] = elements;
        if !elements.iter().all(|element| element.is_finite()) {
            return Err("an element is not finite");
        }
        if xx < 0.0 || yy < 0.0 || tt < 0.0 {
            return Err("a variance is negative");
        }
        if (xx > 0.0) != (yy > 0.0) {
            return Err("one of cov_xx and cov_yy is zero");
        }
        if xx == 0.0 && (xy != 0.0 || xt != 0.0 || yt != 0.0) || tt == 0.0 && (xt != 0.0 || yt != 0.0) {
            return Err("a covariance with a variance of zero");
        }
        if elements == [0.0; 6] {
            return Ok(None);
        }
        let correlation = |covariance: f64, a: f64, b: f64| {
            if covariance == 0.0 { 0.0 } else { covariance / (a.sqrt() * b.sqrt()) }
        };
        let (r_xy, r_xt, r_yt) = (correlation(xy, xx, yy), correlation(xt, xx, tt), correlation(yt, yy, tt));
        let of_position = 1.0 - r_xy * r_xy;
        let of_all = of_position + 2.0 * r_xy * r_xt * r_yt - r_xt * r_xt - r_yt * r_yt;
        if of_position < MIN_DETERMINANT || of_all < MIN_DETERMINANT {
            return Err("it is not positive definite");
        }
        Ok(Some(Self { xx_m2: xx, xy_m2: xy, xt_m_rad: xt, yy_m2: yy, yt_m_rad: yt, tt_rad2: tt }))
    }

    /// The elements in the order of [`Self::COLUMNS`].
    #[must_use]
    pub const fn elements(&self) -> [f64; 6] {
        [self.xx_m2, self.xy_m2, self.xt_m_rad, self.yy_m2, self.yt_m_rad, self.tt_rad2]
    }

    /// The same without the heading; `None` where it states nothing else.
    #[must_use]
    pub fn of_position(&self) -> Option<Self> {
        let position = Self { xt_m_rad: 0.0, yt_m_rad: 0.0, tt_rad2: 0.0, ..*self };
        (self.xx_m2 > 0.0).then_some(position)
    }

    /// The standard deviation of each coordinate where both have the same and no errors are correlated, and
    /// that of the heading; `None` where one number a part does not tell all.
    #[must_use]
    pub fn as_sigmas(&self) -> Option<[Option<f64>; 2]> {
        let known = |variance: f64| Some(variance.sqrt()).filter(|sigma| *sigma > 0.0);
        let is_plain = self.xx_m2 == self.yy_m2 && [self.xy_m2, self.xt_m_rad, self.yt_m_rad] == [0.0; 3];
        is_plain.then(|| [known(self.xx_m2), known(self.tt_rad2)])
    }

    /// The covariance of A times the errors of the position and of `turn` times that of the heading.
    #[must_use]
    pub(crate) fn mapped(&self, a: [[f64; 2]; 2], turn: f64) -> Self {
        let quadratic = |i: usize, j: usize| {
            let [[p, q], [r, s]] = [a[i], a[j]];
            p * r * self.xx_m2 + (p * s + q * r) * self.xy_m2 + q * s * self.yy_m2
        };
        let with_turn = |i: usize| turn * (a[i][0] * self.xt_m_rad + a[i][1] * self.yt_m_rad);
        Self {
            xx_m2: quadratic(0, 0),
            xy_m2: quadratic(0, 1),
            xt_m_rad: with_turn(0),
            yy_m2: quadratic(1, 1),
            yt_m_rad: with_turn(1),
            tt_rad2: turn * turn * self.tt_rad2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_not_stated_and_what_no_covariance_can_be_is_refused() {
        assert_eq!(PoseCovariance::stated([0.0; 6]), Ok(None));
        let good = [4e-4, 1e-4, 2e-5, 1e-4, -1e-5, 1e-4];
        assert_eq!(PoseCovariance::stated(good).map(|of| of.map(|of| of.elements())), Ok(Some(good)));
        for (position_alone, is_good) in
            [([1.0, 0.5, 0.0, 1.0, 0.0, 0.0], true), ([1.0, 1.0, 0.0, 1.0, 0.0, 0.0], false)]
        {
            assert_eq!(PoseCovariance::stated(position_alone).is_ok(), is_good, "{position_alone:?}");
        }
        let heading_alone =
            PoseCovariance::stated([0.0, 0.0, 0.0, 0.0, 0.0, 0.04]).expect("a heading").expect("stated");
        assert_eq!((heading_alone.as_sigmas(), heading_alone.of_position()), (Some([None, Some(0.2)]), None));
        for (elements, why) in [
            ([-1.0, 0.0, 0.0, 1.0, 0.0, 1.0], "negative"),
            ([1.0, 0.0, 0.0, 0.0, 0.0, 1.0], "one of"),
            ([1.0, 0.0, 0.5, 1.0, 0.0, 0.0], "with a variance of zero"),
            ([0.0, 0.5, 0.0, 0.0, 0.0, 1.0], "with a variance of zero"),
            ([1.0, 2.0, 0.0, 1.0, 0.0, 1.0], "positive definite"),
            // Each pair is possible, all three are not.
            ([1.0, 0.9, 0.9, 1.0, -0.9, 1.0], "positive definite"),
            ([f64::NAN, 0.0, 0.0, 1.0, 0.0, 1.0], "finite"),
        ] {
            let found = PoseCovariance::stated(elements).expect_err(why);
            assert!(found.contains(why), "{elements:?}: {found}");
        }
    }

    #[test]
    fn a_covariance_goes_with_its_coordinates() {
        let [xx, xy, xt, yy, yt, tt] = [4.0, 1.0, 0.5, 2.0, -0.25, 9.0];
        let of = PoseCovariance::stated([xx, xy, xt, yy, yt, tt]).expect("possible").expect("stated");
        // Axes exchanged, y then mirrored, and the heading clockwise: exact in powers of two.
        let mapped = of.mapped([[0.0, 1.0], [-1.0, 0.0]], -1.0);
        assert_eq!(mapped.elements(), [yy, -xy, -yt, xx, xt, tt]);
        assert_eq!(of.mapped([[0.5, 0.0], [0.0, 0.5]], 2.0).elements(), [1.0, 0.25, 0.5, 0.5, -0.25, 36.0]);
    }
}
