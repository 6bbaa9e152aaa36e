//! What normal equations say of causes: sizes under each, and how far off one cause's prediction stays when
//! another may do its best.
//!
//! With Î the information of old and planned runs together, n what is free beside and b another name's
//! sizes: a's size s leaves λ = sᵀ(Î_aa − Î_a,nb Î_nb,nb⁻¹ Î_nb,a)s, the noncentrality of the test of b
//! against a, ‖P⊥[n, b] a‖² (Atkinson & Fedorov 1975, T-optimum designs for discriminating between models).

use estimation::{Column, ModelFit, NormalEquations, RIDGE, inverse};
use nalgebra::{DMatrix, DVector};

use super::manoeuvres::{Manoeuvre, Part};
use crate::candidates::candidate::Candidate;
use crate::fits::model_comparison::log_odds_margin;
use crate::settings::{LEVELS, PLAN};

/// How sure it must be that causes are discriminated. The log of the odds is normal with mean λ/2 and
/// variance λ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Confidence {
    /// With probability 0.95.
    P95,
    /// With probability 0.5.
    P50,
}

/// The log odds that are exceeded with probability 0.95: λ/2 − e√λ at the likeliest of those errors e of
/// the new measurements and of √λ, a size not being known better than by the old data, that are as unlikely
/// as that (the design point of first-order reliability, Hasofer & Lind 1974).
fn certain_log_odds(root: f64, root_sigma: f64) -> f64 {
    let at = |step: u32| {
        let (measurements, size) =
            (std::f64::consts::FRAC_PI_2 * f64::from(step) / f64::from(PLAN.design_point_steps)).sin_cos();
        let root = (root - LEVELS.normal_quantile_one_sided_95 * size * root_sigma).max(0.0);
        0.5 * root * root - LEVELS.normal_quantile_one_sided_95 * measurements * root
    };
    (0..=PLAN.design_point_steps).map(at).fold(f64::INFINITY, f64::min)
}

/// One of several names, with its columns of the normal equation.
#[derive(Debug, Clone)]
pub(crate) struct RivalColumns {
    pub(crate) candidate: Candidate,
    pub(crate) columns: Vec<usize>,
}

/// Columns that are free beside the candidates', and the weight of what is plausible of every column.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    pub(crate) free: Vec<usize>,
    pub(crate) prior: DVector<f64>,
}

impl Frame {
    /// Of a fit with further terms: first those of the fit, then those of the candidates.
    pub(crate) fn of(fit: &ModelFit<'_>, terms: &[Candidate]) -> Self {
        let base = Column::BASE.map(|column| match column {
            Column::LeftWheel | Column::RightWheel | Column::Separation => PLAN.geometry_prior_sigma,
            Column::SensorX | Column::SensorY => PLAN.lever_prior_sigma_m,
            Column::SensorTheta => LEVELS.sensor_heading_prior_sigma_rad,
            // Plans are of the instrument that sees poses.
            Column::GyroScale => PLAN.gyro_scale_prior_sigma,
            Column::Latency | Column::Term(_) => PLAN.latency_prior_sigma_s,
        });
        let of_terms = terms.iter().flat_map(Candidate::parameters).map(|parameter| parameter.prior_sigma);
        let precisions: Vec<f64> = base.into_iter().chain(of_terms).map(|sd| 1.0 / (sd * sd)).collect();
        Self { free: fit.columns.iter().map(|column| column.index()).collect(), prior: DVector::from_vec(precisions) }
    }

    /// The normal equation of some columns with what is plausible of them.
    fn matrix(&self, equations: &NormalEquations, columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            equations.information[(columns[i], columns[j])] + if i == j { self.prior[columns[i]] } else { 0.0 }
        })
    }

    /// Estimates of some columns from normal equations, as steps from the model in force, and their
    /// covariance.
    pub(crate) fn estimate(
        &self,
        equations: &NormalEquations,
        columns: &[usize],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let covariance = inverse(&self.matrix(equations, columns), RIDGE)?;
        let gradient = DVector::from_fn(columns.len(), |k, _| equations.gradient[columns[k]]);
        Some((-(&covariance * gradient), covariance))
    }

    /// The information on some columns with others at their best.
    pub(crate) fn information(
        &self,
        equations: &NormalEquations,
        own: &[usize],
        others: &[usize],
    ) -> Option<DMatrix<f64>> {
        let inverse = inverse(&self.matrix(equations, others), RIDGE)?;
        let cross = DMatrix::from_fn(own.len(), others.len(), |i, j| equations.information[(own[i], others[j])]);
        let raw = DMatrix::from_fn(own.len(), own.len(), |i, j| equations.information[(own[i], own[j])]);
        Some(raw - &cross * inverse * cross.transpose())
    }

    /// Free columns and a candidate's.
    pub(crate) fn with(&self, rival_columns: &RivalColumns) -> Vec<usize> {
        self.free.iter().chain(&rival_columns.columns).copied().collect()
    }
}

/// How well two causes are discriminated, whichever of them is true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PairDiscrimination {
    /// √λ: in standard deviations.
    pub(crate) sigmas: f64,
    /// By how much the log odds exceed the margin of the diagnosis with probability 0.5. Where causes must be
    /// significant, at most by how much they are.
    even: f64,
    /// The same with probability 0.95.
    certain: f64,
}

impl PairDiscrimination {
    pub(crate) fn margin(&self, confidence: Confidence) -> f64 {
        match confidence {
            Confidence::P95 => self.certain,
            Confidence::P50 => self.even,
        }
    }

    fn or_worse(self, other: Self) -> Self {
        Self {
            sigmas: self.sigmas.min(other.sigmas),
            even: self.even.min(other.even),
            certain: self.certain.min(other.certain),
        }
    }
}

/// Names with the sizes that the old data give them, and their covariances.
#[derive(Debug, Clone)]
pub(crate) struct Rivals {
    pub(crate) frame: Frame,
    pub(crate) rival_columns: Vec<RivalColumns>,
    pub(crate) estimates: Vec<DVector<f64>>,
    covariances: Vec<DMatrix<f64>>,
    /// By how much the log of the odds against nothing at all must speak for a name as well.
    min_log_odds: f64,
}

impl Rivals {
    pub(crate) fn new(frame: Frame, rival_columns: Vec<RivalColumns>, before: &NormalEquations) -> Option<Self> {
        let estimate = |rival_columns: &RivalColumns| {
            let (step, covariance) = frame.estimate(before, &frame.with(rival_columns))?;
            let (first, own) = (frame.free.len(), rival_columns.columns.len());
            Some((step.rows(first, own).into_owned(), covariance.view((first, first), (own, own)).into_owned()))
        };
        let (estimates, covariances) = rival_columns.iter().map(estimate).collect::<Option<_>>()?;
        Some(Self { frame, rival_columns, estimates, covariances, min_log_odds: f64::NEG_INFINITY })
    }

    /// The same names, which must stand out from nothing by so many standard deviations too.
    pub(crate) fn significant_by(self, sigmas: f64) -> Self {
        Self { min_log_odds: 0.5 * sigmas * sigmas, ..self }
    }

    /// Every pair of names.
    pub(crate) fn pairs(&self) -> Vec<(usize, usize)> {
        let n = self.rival_columns.len();
        (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b))).collect()
    }

    /// What normal equations make of a pair, whichever of the two is true.
    pub(crate) fn discrimination(&self, equations: &NormalEquations, a: usize, b: usize) -> Option<PairDiscrimination> {
        let if_first_is_true = |a: usize, b: usize| {
            let (own, size) = (&self.rival_columns[a].columns, &self.estimates[a]);
            let left = self.frame.information(equations, own, &self.frame.with(&self.rival_columns[b]))?;
            let alone = self.frame.information(equations, own, &self.frame.free)?;
            // √λ = √(sᵀ L s) has the gradient L s / √λ.
            let odds = |information: &DMatrix<f64>| {
                let gradient = information * size;
                let lambda = size.dot(&gradient).max(0.0);
                let root = lambda.sqrt();
                let sigma = (gradient.transpose() * &self.covariances[a] * &gradient)[0].max(0.0).sqrt() / root;
                (root, 0.5 * lambda, if root > 0.0 { certain_log_odds(root, sigma) } else { 0.0 })
            };
            let ((sigmas, even, certain), (_, even_alone, certain_alone)) = (odds(&left), odds(&alone));
            let margin_of_diagnosis = log_odds_margin(even_alone);
            Some(PairDiscrimination {
                sigmas,
                even: (even - margin_of_diagnosis).min(even_alone - self.min_log_odds),
                certain: (certain - margin_of_diagnosis).min(certain_alone - self.min_log_odds),
            })
        };
        Some(if_first_is_true(a, b)?.or_worse(if_first_is_true(b, a)?))
    }
}

/// Normal equations with so many times a pair of runs added.
pub(crate) fn with_runs(before: &NormalEquations, added: &[(&NormalEquations, f64)]) -> NormalEquations {
    let mut all = before.clone();
    added.iter().for_each(|(equations, times)| all.add(equations, *times));
    all
}

/// The same with the runs of a plan's parts, each made up among the options.
pub(crate) fn with_parts(
    before: &NormalEquations,
    parts: &[Part],
    options: &[(Manoeuvre, NormalEquations)],
) -> NormalEquations {
    let added: Vec<(&NormalEquations, f64)> = parts
        .iter()
        .filter_map(|part| {
            let (_, equations) = options.iter().find(|(manoeuvre, _)| *manoeuvre == part.manoeuvre)?;
            Some((equations, f64::from(part.pairs)))
        })
        .collect();
    with_runs(before, &added)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::fits::statistics::p_of_z;

    /// Normal equations of measurements whose derivatives by the columns are the rows of `slopes`, each with
    /// unit variance, and of measured values.
    pub(in crate::plan) fn normal_equations(slopes: &DMatrix<f64>, values: &DVector<f64>) -> NormalEquations {
        NormalEquations {
            run: (0, 0),
            information: slopes.transpose() * slopes,
            gradient: -(slopes.transpose() * values),
            chi_square: values.dot(values),
            log_det: 0.0,
            count: 0.0,
        }
    }

    /// Of two names, columns 1 and 2, beside a nuisance, column 0.
    pub(in crate::plan) fn rivals(before: &NormalEquations) -> Rivals {
        let rival_columns = |column| RivalColumns {
            candidate: Candidate::Effect { id: "slip_speed", variant: 0, at: None },
            columns: vec![column],
        };
        let frame = Frame { free: vec![0], prior: DVector::from_element(3, 1e-9) };
        Rivals::new(frame, vec![rival_columns(1), rival_columns(2)], before).expect("determined")
    }

    /// Column 0 is the nuisance; names 1 and 2 differ only in the third measurement, which is not in the old
    /// data.
    #[test]
    fn what_another_name_can_say_as_well_tells_nothing() {
        let old = DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
        let before = normal_equations(&old, &DVector::from_column_slice(&[0.3, 10.0]));
        let rivals = rivals(&before);
        // Both names say 10, and nothing discriminates them.
        assert!(rivals.estimates.iter().all(|size| (size[0] - 10.0).abs() < 1e-6), "{:?}", rivals.estimates);
        let discrimination = rivals.discrimination(&before, 0, 1).expect("determined");
        assert!(discrimination.sigmas < 1e-3 && discrimination.margin(Confidence::P50) < 0.0, "{discrimination:?}");
        // One more measurement depends on name 1 alone. True at 10, name 1 leaves 10² · (2 − 1·1/1) to name 2
        // at its best, and name 2 leaves 10² · (1 − 1·1/2) to name 1.
        let new = normal_equations(&DMatrix::from_row_slice(1, 3, &[0.0, 1.0, 0.0]), &DVector::zeros(1));
        let after = with_runs(&before, &[(&new, 1.0)]);
        let discrimination = rivals.discrimination(&after, 0, 1).expect("determined");
        // To the size of the priors. Without the other name at its best both would leave 100 or more.
        assert!((discrimination.sigmas - 50_f64.sqrt()).abs() < 1e-4, "{discrimination:?}");
        assert!((discrimination.margin(Confidence::P50) - (25.0 - 3.0)).abs() < 1e-3, "{discrimination:?}");
        // A size of 10 ± 1 makes √λ uncertain by a tenth.
        let certain = certain_log_odds(50_f64.sqrt(), 0.1 * 50_f64.sqrt());
        assert!((discrimination.margin(Confidence::P95) - (certain - 3.0)).abs() < 1e-3, "{discrimination:?}");
    }

    #[test]
    fn causes_that_must_be_significant_are_discriminated_only_where_they_are() {
        let old = DMatrix::from_row_slice(2, 3, &[1.0, 0.0, 0.0, 0.0, 1.0, 1.0]);
        let before = normal_equations(&old, &DVector::from_column_slice(&[0.3, 4.0]));
        // Four measurements see name 1 alone, and tell it from name 2: to 4² · (5 − 1) and 4² · (1 − 1/5)
        // of λ.
        let new = normal_equations(&DMatrix::from_row_slice(1, 3, &[0.0, 2.0, 0.0]), &DVector::zeros(1));
        let after = with_runs(&before, &[(&new, 1.0)]);
        let margin = |rivals: &Rivals| rivals.discrimination(&after, 0, 1).expect("determined").margin(Confidence::P50);
        let plain = rivals(&before);
        assert!((margin(&plain) - (6.4 - 3.0)).abs() < 1e-3, "{}", margin(&plain));
        // Name 2 stands out as before, by 4 standard deviations.
        let both = plain.clone().significant_by(4.5);
        assert!((margin(&both) - 0.5 * (16.0 - 4.5 * 4.5)).abs() < 1e-3, "{}", margin(&both));
    }

    /// The log of the odds, drawn with all that is not known of it, is lower than what holds for certain in
    /// one of twenty: integrated over the size. The bound is of first order: a third of that either way.
    #[test]
    fn what_holds_for_certain_fails_once_in_twenty() {
        for (root, sigma) in [(4.6, 0.0), (6.0, 0.5), (7.0, 1.5), (12.0, 3.0)] {
            let bound = certain_log_odds(root, sigma);
            let steps = (-400..=400).map(|k| f64::from(k) * 0.0125);
            let (mut below, mut all) = (0.0, 0.0);
            for z in steps {
                let (density, root) = ((-0.5 * z * z).exp(), root + sigma * z);
                // ½ r² + r e is below the bound where e is below this.
                let error = (bound - 0.5 * root * root) / root;
                let relative_odds = if error > 0.0 { 1.0 - 0.5 * p_of_z(error) } else { 0.5 * p_of_z(error) };
                below += density * relative_odds;
                all += density;
            }
            let share = below / all;
            assert!((0.033..0.067).contains(&share), "{root} ± {sigma}: {share}");
        }
    }

    #[test]
    fn a_pair_is_as_well_told_as_the_worse_of_both_ways() {
        let of = |sigmas, even, certain| PairDiscrimination { sigmas, even, certain };
        assert_eq!(of(1.0, 5.0, 2.0).or_worse(of(2.0, 4.0, 3.0)), of(1.0, 4.0, 2.0));
        assert_eq!((of(1.0, 5.0, 2.0).margin(Confidence::P50), of(1.0, 5.0, 2.0).margin(Confidence::P95)), (5.0, 2.0));
        // Known for certain, λ/2 is exceeded but for the measurements' own error. Rejects one of two sides.
        assert!((certain_log_odds(6.0, 0.0) - (18.0 - 1.645 * 6.0)).abs() < 1e-9);
        // A size that may be nothing leaves nothing.
        assert!(certain_log_odds(1.0, 10.0) <= 0.0 && certain_log_odds(0.0, 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_frame_weighs_what_is_plausible_and_takes_out_what_is_free() {
        let prior = DVector::from_column_slice(&[0.0, 1.0, 0.0]);
        let frame = Frame { free: vec![0], prior };
        let slopes = DMatrix::from_row_slice(3, 3, &[2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
        let equations = normal_equations(&slopes, &DVector::from_column_slice(&[2.0, 4.0, 0.0]));
        // Column 1 alone: (1·4 + 1·0)/(1 + 1 + 1), with its prior of 1.
        let (step, covariance) = frame.estimate(&equations, &[1]).expect("determined");
        assert!((step[0] - 4.0 / 3.0).abs() < 1e-9 && (covariance[(0, 0)] - 1.0 / 3.0).abs() < 1e-9);
        // Column 1 has 2, of which column 0 explains 1·1/5.
        let information = frame.information(&equations, &[1], &[0]).expect("determined");
        assert!((information[(0, 0)] - 1.8).abs() < 1e-9, "{information}");
        let columns = RivalColumns {
            candidate: Candidate::Effect { id: "slip_speed", variant: 0, at: None },
            columns: vec![2, 1],
        };
        assert_eq!(frame.with(&columns), [0, 2, 1]);
        let twice = with_runs(&equations, &[(&equations, 2.0), (&equations, -1.0)]);
        assert!((twice.information[(0, 0)] - 10.0).abs() < 1e-12);
    }
}
