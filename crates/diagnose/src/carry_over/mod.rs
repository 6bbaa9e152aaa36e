//! What carries over: whether a term that was found has the size in each session, and in each kind of path,
//! that all the others give it.
//!
//! A term is found because it raises the likelihood of what was driven. Runs of one day, or of one kind of
//! path, share whatever else was special there, and held-out runs among them share it too. Each unit, a
//! session or a kind of path, therefore gets a share of the found size of its own, all fitted together with
//! the geometry that they have in common: one step of Gauss and Newton from the fit, with a covariance that
//! is robust over runs. With a of the unit and b of all others, the extension lowers the unit's error
//! exactly when a/b > ½: the contrast a − ½ b decides. A unit is asked where the others determine b, and
//! where a = b would show. What the units have says what another one will have: where their sizes scatter so
//! that it may well have less than half, none of them need to refute the term for it to stay open.
//!
//! References: Liang & Zeger 1986 (covariance over clusters); Holm 1979; Higgins, Thompson & Spiegelhalter
//! 2009 (what a new unit will have).

pub(crate) mod contrast;
pub(crate) mod heterogeneity;

use std::collections::BTreeMap;

use estimation::{ClusterRobust, Information, NormalEquations, RIDGE, inverse};
use nalgebra::{DMatrix, DVector};

use crate::candidates::kinds::kinds_of_runs;
use crate::carry_over::contrast::Contrast;
use crate::carry_over::heterogeneity::Heterogeneity;
use crate::document::Value;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::statistics::{holm, p_of_z};
use crate::settings::{CARRY_OVER, LEVELS};

/// What is a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Level {
    /// A session: a dataset.
    Session,
    /// A kind of path.
    Kind,
}

impl Level {
    pub(crate) const BOTH: [Self; 2] = [Self::Session, Self::Kind];

    const fn noun(self) -> &'static str {
        match self {
            Self::Session => "session",
            Self::Kind => "kind of path",
        }
    }
}

/// Runs by unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Units {
    /// The units' names, in the order in which they were driven first.
    pub(crate) names: Vec<String>,
    /// The unit of each run.
    pub(crate) of_run: BTreeMap<(usize, usize), usize>,
}

impl Units {
    /// The units of a model's runs; `names` are those of the sessions.
    pub(crate) fn of(model: &AugmentedModel<'_>, names: &[String], level: Level) -> Self {
        let mut units = Self { names: Vec::new(), of_run: BTreeMap::new() };
        let kinds = kinds_of_runs(&model.fit);
        for run in model.fit.solution.pass.runs.iter().filter(|run| run.count > 0.0) {
            let name = match level {
                Level::Session => match names.get(run.run.0) {
                    // Sessions may be called alike.
                    Some(name) if names.iter().filter(|other| *other == name).count() == 1 => name.clone(),
                    Some(name) => format!("{name} ({})", run.run.0 + 1),
                    None => format!("{}", run.run.0 + 1),
                },
                Level::Kind => kinds.get(&run.run).map_or_else(|| "mixed".to_owned(), |kind| (*kind).to_owned()),
            };
            let unit = units.names.iter().position(|known| *known == name).unwrap_or_else(|| {
                units.names.push(name);
                units.names.len() - 1
            });
            units.of_run.insert(run.run, unit);
        }
        units
    }
}

/// Sizes of one term by the units of one level, as shares of the size found in all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SizesByUnit {
    level: Level,
    units: Vec<UnitShare>,
    heterogeneity: Option<Heterogeneity>,
}

/// One unit's share, and how it stands against the others.
#[derive(Debug, Clone, PartialEq)]
struct UnitShare {
    name: String,
    /// Share of the size found, with its standard deviation; `None` where the unit does not determine it.
    own: Option<(f64, f64)>,
    contrast: Option<Contrast>,
}

/// Whether a term carries over, and the sizes by unit behind that.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CarryOver {
    /// `None` where these data cannot tell.
    pub(crate) carries_over: Option<bool>,
    pub(crate) why: String,
    by_level: Vec<SizesByUnit>,
}

impl CarryOver {
    /// How the sizes differ between the units of each level that has enough of them.
    pub(crate) fn heterogeneity(&self) -> impl Iterator<Item = (Level, Heterogeneity)> {
        self.by_level.iter().filter_map(|sizes| Some((sizes.level, sizes.heterogeneity?)))
    }

    /// Sizes of each parameter by the units of a level: of units that determine them.
    pub(crate) fn sizes(
        &self,
        level: Level,
        parameters: &[(&str, &str, f64)],
    ) -> BTreeMap<String, BTreeMap<String, Value>> {
        let units = self.by_level.iter().filter(|sizes| sizes.level == level).flat_map(|sizes| &sizes.units);
        let of = |(share, sigma): (f64, f64)| {
            let value = |(name, unit, size): &(&str, &str, f64)| {
                let value = Value { value: share * size, sigma: Some(sigma * size.abs()), unit: (*unit).to_owned() };
                ((*name).to_owned(), value)
            };
            parameters.iter().map(value).collect::<BTreeMap<String, Value>>()
        };
        units.filter_map(|unit| Some((unit.name.clone(), of(unit.own?)))).collect()
    }
}

/// Whether one candidate of a fitted model carries over to the sessions and kinds of path that its data have.
pub(crate) fn carry_over(model: &AugmentedModel<'_>, candidate: usize, names: &[String]) -> CarryOver {
    let sizes = Level::BOTH.map(|level| sizes_by_unit(model, candidate, &Units::of(model, names, level), level));
    let by_level: Vec<SizesByUnit> = sizes.into_iter().flatten().collect();
    let (carries_over, why) = verdict(&by_level);
    CarryOver { carries_over, why, by_level }
}

/// The verdict over the units of all levels.
fn verdict(by_level: &[SizesByUnit]) -> (Option<bool>, String) {
    if by_level.is_empty() {
        return (None, "one session and one kind of path: no other was driven".to_owned());
    }
    let mut supported = Vec::new();
    let mut open = Vec::new();
    for sizes in by_level {
        let noun = sizes.level.noun();
        let testable: Vec<(&str, Contrast)> = sizes
            .units
            .iter()
            .filter_map(|unit| Some((unit.name.as_str(), unit.contrast.filter(Contrast::is_testable)?)))
            .collect();
        let z = |contrast: &Contrast| contrast.value.0 / contrast.value.1;
        let p_below: Vec<f64> =
            testable.iter().map(|(_, of)| if z(of) < 0.0 { 0.5 * p_of_z(z(of)) } else { 1.0 }).collect();
        let refuted = holm(&p_below, CARRY_OVER.refuted_level);
        if let Some(((name, _), _)) = testable.iter().zip(refuted).find(|(_, refuted)| *refuted) {
            return (Some(false), format!("{noun} {name} has less than half of the size that the others give it"));
        }
        let of = sizes.units.len();
        let scatters = sizes.heterogeneity.filter(|of| {
            of.less_than_half > CARRY_OVER.max_less_than_half && of.p_value < CARRY_OVER.heterogeneity_level
        });
        if let Some(Heterogeneity { tau, less_than_half, .. }) = scatters {
            open.push(format!(
                "sizes scatter by {:.0} % over each {noun}: another one has less than half with a probability of {:.2}",
                100.0 * tau,
                less_than_half
            ));
        } else if testable.len() >= CARRY_OVER.min_testable_units
            && testable.iter().all(|(_, contrast)| z(contrast) > CARRY_OVER.supported_sigmas)
        {
            supported.push(format!("{} of {of} by {noun}", testable.len()));
        } else {
            let plain = |unit: &&UnitShare| {
                unit.own.is_some_and(|(share, sigma)| share.abs() > CARRY_OVER.min_sigmas_of_others * sigma)
            };
            let shown: Vec<&str> = sizes.units.iter().filter(plain).map(|unit| unit.name.as_str()).collect();
            open.push(match (&shown[..], testable.len()) {
                ([only], _) => format!("only {noun} {only} shows it"),
                (_, tested) if tested < CARRY_OVER.min_testable_units => format!("{tested} of {of} testable by {noun}"),
                _ => {
                    let weak = testable.iter().find(|(_, contrast)| z(contrast) <= CARRY_OVER.supported_sigmas);
                    format!("too weak in {noun} {}", weak.map_or("", |(name, _)| name))
                }
            });
        }
    }
    let all = [&supported[..], &open[..]].concat().join("; ");
    if open.is_empty() {
        return (Some(true), format!("at least half of this size wherever it can be tested: {all}"));
    }
    (None, all)
}

/// The shares of the units of a level; `None` where there is one unit only.
fn sizes_by_unit(model: &AugmentedModel<'_>, candidate: usize, units: &Units, level: Level) -> Option<SizesByUnit> {
    if units.names.len() < 2 {
        return None;
    }
    let system = System::of(model, candidate)?;
    let unit_of = |run: (usize, usize)| units.of_run.get(&run).copied();
    let number = units.names.len();
    let all = system.shares(number, unit_of);
    let share = |unit: usize| {
        let (shares, covariance) = all.as_ref()?;
        let sigma = covariance[(unit, unit)].sqrt();
        (sigma.is_finite() && sigma > 0.0).then(|| (shares[unit], sigma))
    };
    let contrast = |unit: usize| {
        let (shares, covariance) = system.shares(2, |run| unit_of(run).map(|of| usize::from(of != unit)))?;
        Contrast::of(shares[0], shares[1], &covariance)
    };
    let of_units: Vec<UnitShare> = units
        .names
        .iter()
        .enumerate()
        .map(|(unit, name)| UnitShare { name: name.clone(), own: share(unit), contrast: contrast(unit) })
        .collect();
    let determined: Vec<(f64, f64)> = of_units.iter().filter_map(|unit| unit.own).collect();
    Some(SizesByUnit { level, units: of_units, heterogeneity: Heterogeneity::of(&determined) })
}

/// The runs' normal equations by the columns that all units share, and along the size found of one candidate.
struct System {
    /// Of each run: the shared columns first, the candidate's last.
    runs: Vec<((usize, usize), Information)>,
    shared: usize,
}

impl System {
    fn of(model: &AugmentedModel<'_>, candidate: usize) -> Option<Self> {
        let fit = &model.fit;
        let size = model.estimates(candidate);
        let own: Vec<usize> = model.columns(candidate);
        let columns: Vec<_> = fit.columns.iter().copied().filter(|column| !own.contains(&column.index())).collect();
        let basis = fit.free_basis_of(&columns);
        let shared = basis.ncols();
        let at: Vec<usize> = columns.iter().map(|column| column.index()).chain(own.iter().copied()).collect();
        // The shared columns along what is free of them, the candidate's along its size.
        let mut along = DMatrix::zeros(at.len(), shared + 1);
        along.view_mut((0, 0), (columns.len(), shared)).copy_from(&basis);
        along.view_mut((columns.len(), shared), (own.len(), 1)).copy_from(&size);
        let of_run = |run: &NormalEquations| {
            let own = Information { matrix: run.block(&at, &at), gradient: run.gradient_of(&at) };
            (run.run, own.along(&along))
        };
        let runs: Vec<_> = fit.solution.pass.runs.iter().filter(|run| run.count > 0.0).map(of_run).collect();
        (!runs.is_empty()).then_some(Self { runs, shared })
    }

    /// The units' shares of the size, and their covariance: the wider of that by the noise and that by the
    /// scatter of runs, where there are enough. `None` where they are not determined.
    fn shares(
        &self,
        units: usize,
        unit_of: impl Fn((usize, usize)) -> Option<usize>,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let n = self.shared + units;
        let spread = |(run, own): &((usize, usize), Information)| {
            let unit = unit_of(*run)?;
            let mut to = DMatrix::zeros(self.shared + 1, n);
            (0..self.shared).for_each(|k| to[(k, k)] = 1.0);
            to[(self.shared, self.shared + unit)] = 1.0;
            Some(own.along(&to))
        };
        let runs: Vec<Information> = self.runs.iter().filter_map(spread).collect();
        let mut sum = Information { matrix: DMatrix::zeros(n, n), gradient: DVector::zeros(n) };
        for run in &runs {
            sum.matrix += &run.matrix;
            sum.gradient += &run.gradient;
        }
        let by_noise = inverse(&sum.matrix, RIDGE)?;
        let step = -(&by_noise * &sum.gradient);
        let own = |matrix: &DMatrix<f64>| matrix.view((self.shared, self.shared), (units, units)).into_owned();
        let mut covariance = own(&by_noise);
        if runs.len() >= LEVELS.min_runs + units {
            let ClusterRobust { covariance: by_runs, left_out } = ClusterRobust::of(&by_noise, runs);
            let by_runs = own(&by_runs);
            if left_out == 0 && by_runs.trace() > covariance.trace() {
                covariance = by_runs;
            }
        }
        // The found size is a share of one.
        let shares = step.rows(self.shared, units).map(|step| 1.0 + step);
        Some((shares, covariance))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A verdict without the sizes behind it.
    pub(crate) fn of_verdict(carries_over: Option<bool>) -> CarryOver {
        CarryOver { carries_over, why: String::new(), by_level: Vec::new() }
    }

    fn unit(name: &str, own: (f64, f64), contrast: (f64, f64)) -> UnitShare {
        let contrast = Contrast { value: contrast, sigmas_of_others: 10.0, power_sigmas: 0.5 / contrast.1 };
        UnitShare { name: name.to_owned(), own: Some(own), contrast: Some(contrast) }
    }

    fn sessions(units: Vec<UnitShare>) -> SizesByUnit {
        SizesByUnit { level: Level::Session, units, heterogeneity: None }
    }

    #[test]
    fn two_units_that_agree_support_and_one_that_does_not_refutes() {
        let agree = || unit("a", (1.0, 0.1), (0.5, 0.1));
        assert_eq!(verdict(&[sessions(vec![agree(), agree()])]).0, Some(true));
        // Of a size of a tenth: 0.1 − 0.5 = −0.4, four standard deviations below nothing.
        let (found, why) = verdict(&[sessions(vec![agree(), unit("b", (0.1, 0.1), (-0.4, 0.1)), agree()])]);
        assert_eq!(found, Some(false), "{why}");
        assert!(why.contains("session b"), "{why}");
        // One testable unit is none to compare with; half of the size neither supports nor refutes.
        let weak = unit("b", (1.0, 1.0), (0.5, 1.0));
        assert_eq!(verdict(&[sessions(vec![agree(), weak])]).0, None);
        assert_eq!(verdict(&[sessions(vec![agree(), unit("b", (0.5, 0.1), (0.0, 0.1))])]).0, None);
        assert_eq!(verdict(&[]).0, None);
        // Units that all have more than half, but differ so that another may not.
        let units = || vec![unit("a", (0.6, 0.02), (0.1, 0.02)), unit("b", (2.0, 0.02), (1.5, 0.02)), agree()];
        assert_eq!(verdict(&[sessions(units())]).0, Some(true));
        let heterogeneity = Heterogeneity::of(&[(0.6, 0.02), (2.0, 0.02), (1.0, 0.1)]);
        let (found, why) = verdict(&[SizesByUnit { heterogeneity, ..sessions(units()) }]);
        assert_eq!(found, None);
        assert!(why.contains("another one has less than half"), "{why}");
    }

    #[test]
    fn shares_of_units_are_those_on_paper() {
        // No shared column. Runs of units a, a, b with information 2, 2, 4 of the size found and gradients
        // −2, 0, 2: shares 1 + 2/4 and 1 − 2/4, variances 1/4.
        let run = |run, information, gradient| {
            let own = Information {
                matrix: DMatrix::from_element(1, 1, information),
                gradient: DVector::from_element(1, gradient),
            };
            ((0, run), own)
        };
        let system = System { runs: vec![run(0, 2.0, -2.0), run(1, 2.0, 0.0), run(2, 4.0, 2.0)], shared: 0 };
        let (shares, covariance) = system.shares(2, |(_, run)| Some(usize::from(run == 2))).expect("determined");
        // The ridge changes them by 1e-11.
        assert!((shares[0] - 1.5).abs() < 1e-9 && (shares[1] - 0.5).abs() < 1e-9, "{shares}");
        assert!((covariance[(0, 0)] - 0.25).abs() < 1e-9 && covariance[(0, 1)].abs() < 1e-9, "{covariance}");
    }

    #[test]
    fn why_a_term_stays_open_is_said() {
        let weak = |name: &str, share: f64| UnitShare { contrast: None, ..unit(name, (share, 0.1), (0.5, 0.1)) };
        let why = |units: Vec<UnitShare>| verdict(&[sessions(units)]).1;
        // Three standard deviations and no more are not plain.
        assert_eq!(why(vec![weak("a", 1.0), weak("b", 0.3)]), "only session a shows it");
        assert_eq!(why(vec![weak("a", -1.0), weak("b", 0.2)]), "only session a shows it");
        assert_eq!(why(vec![weak("a", 1.0), weak("b", 1.0)]), "0 of 2 testable by session");
        let agrees = || unit("c", (1.0, 0.1), (0.5, 0.1));
        assert_eq!(why(vec![agrees(), weak("b", 1.0)]), "1 of 2 testable by session");
        let near = || unit("b", (0.6, 0.1), (0.1, 0.1));
        assert_eq!(why(vec![agrees(), near()]), "too weak in session b");
        let both = verdict(&[sessions(vec![agrees(), agrees()]), sessions(vec![agrees(), near()])]);
        assert_eq!(both, (None, "2 of 2 by session; too weak in session b".to_owned()));
        let (all, why) = verdict(&[sessions(vec![agrees(), agrees(), weak("b", 1.0)])]);
        assert!(all == Some(true) && why.ends_with("can be tested: 2 of 3 by session"), "{why}");
        // A unit that is 1.7 below nothing is none of three by chance: 0.045 · 3. Rejects each for itself,
        // and one that is as far above.
        let below = |z: f64| unit("b", (0.4, 0.1), (-0.1 * z, 0.1));
        assert_eq!(verdict(&[sessions(vec![agrees(), below(1.7), agrees()])]).0, None);
        assert_eq!(verdict(&[sessions(vec![agrees(), below(2.2), agrees()])]).0, Some(false));
        assert_eq!(verdict(&[sessions(vec![agrees(), below(-2.2), agrees()])]).0, Some(true));
    }

    #[test]
    fn sizes_are_shares_of_what_was_found() {
        let by_level = vec![
            sessions(vec![
                unit("a", (0.5, 0.1), (0.1, 0.1)),
                UnitShare { own: None, ..unit("b", (1.0, 0.1), (0.5, 0.1)) },
            ]),
            SizesByUnit { level: Level::Kind, ..sessions(vec![unit("spin", (2.0, 0.1), (0.1, 0.1))]) },
        ];
        let of = CarryOver { carries_over: None, why: String::new(), by_level };
        let sizes = of.sizes(Level::Session, &[("slip_s_m", "s/m", -0.04)]);
        // A standard deviation has no sign.
        let value = Value { value: -0.02, sigma: Some(0.004), unit: "s/m".to_owned() };
        assert_eq!(sizes, BTreeMap::from([("a".to_owned(), BTreeMap::from([("slip_s_m".to_owned(), value)]))]));
        assert!(of.sizes(Level::Kind, &[("slip_s_m", "s/m", -0.04)]).contains_key("spin"));
        assert_eq!(of.heterogeneity().count(), 0);
    }

    fn system(shared: usize, runs: &[(&[f64], &[f64])]) -> System {
        let run = |(number, (matrix, gradient)): (usize, &(&[f64], &[f64]))| {
            let n = shared + 1;
            let (matrix, gradient) = (DMatrix::from_row_slice(n, n, matrix), DVector::from_column_slice(gradient));
            ((0, number), Information { matrix, gradient })
        };
        System { runs: runs.iter().enumerate().map(run).collect(), shared }
    }

    #[test]
    fn shares_are_fitted_together_with_what_units_have_in_common() {
        // The sum over the shared column and those of two units is [[2, 1, −1], [1, 2, 0], [−1, 0, 2]] with
        // the gradient (0, −1, 1): steps −1, 1, −1, and a covariance of the units of [[3, −1], [−1, 3]]/4.
        // Rejects the units by themselves, ½ and a variance of ½.
        let (a, b) = ([1.0, 1.0, 1.0, 2.0], [1.0, -1.0, -1.0, 2.0]);
        let system = system(1, &[(&a, &[0.0, -1.0]), (&b, &[0.0, 1.0]), (&b, &[9.0, 9.0])]);
        let unit = |(_, run): (usize, usize)| [Some(0), Some(1), None][run];
        let (shares, covariance) = system.shares(2, unit).expect("determined");
        assert!((shares[0] - 2.0).abs() < 1e-9 && shares[1].abs() < 1e-9, "{shares}");
        let expected = [0.75, -0.25, 0.75];
        let found = [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]];
        assert!(found.iter().zip(expected).all(|(found, of)| (found - of).abs() < 1e-9), "{covariance}");
    }

    #[test]
    fn runs_that_scatter_beyond_the_noise_widen_the_shares_where_there_are_enough_of_them() {
        // Of each of two units four runs with information 1 and scores of 3, either way: without the run in
        // the fit 4, so that the variance is 7/8 · 64/16. The noise alone makes ¼.
        let scores = |score: f64| [[score], [-score]].concat().repeat(4);
        let variance = |score: f64, runs: usize| {
            let gradients: Vec<Vec<f64>> = scores(score).iter().map(|of| vec![*of]).collect();
            let runs: Vec<(&[f64], &[f64])> = gradients[..runs].iter().map(|of| (&[1.0][..], &of[..])).collect();
            system(0, &runs).shares(2, |(_, run)| Some(run / 4)).expect("determined").1[(0, 0)]
        };
        assert!((variance(3.0, 8) - 3.5).abs() < 1e-9, "{}", variance(3.0, 8));
        // Runs that scatter less than the noise, and too few of them, leave it.
        assert!((variance(0.1, 8) - 0.25).abs() < 1e-9 && (variance(3.0, 7) - 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_unit_has_its_runs_and_its_name() {
        use crate::small_robot::{fitted, session};
        let datasets = [session(0, 0.0), session(1, 0.0), session(2, 0.0)];
        let model = AugmentedModel::base(&fitted(&datasets));
        let names = ["a", "b", "a"].map(ToOwned::to_owned);
        let sessions = Units::of(&model, &names, Level::Session);
        // Sessions that are called alike are told by their numbers, and one without a name too.
        assert_eq!(sessions.names, ["a (1)", "b", "a (3)"]);
        assert_eq!(Units::of(&model, &names[..2], Level::Session).names, ["a", "b", "3"]);
        let kinds = Units::of(&model, &names, Level::Kind);
        assert_eq!(kinds.names, ["straight", "spin", "square"]);
        assert_eq!((kinds.of_run.len(), kinds.of_run[&(1, 5)], kinds.of_run[&(2, 7)]), (24, 1, 2));
        assert_eq!((sessions.of_run[&(0, 0)], sessions.of_run[&(2, 7)]), (0, 2));
    }

    #[test]
    fn regress_no_number_of_a_carry_over_moves() {
        use crate::small_robot::{assert_unmoved, fitted, session, with_effects};
        // The third session has a third of what the others have.
        let datasets = [session(0, 0.1), session(1, 0.1), session(2, 0.03)];
        let names = ["a", "b", "c"].map(ToOwned::to_owned);
        let model = with_effects(&fitted(&datasets), &["slip_speed", "truth_latency"]);
        let text = [0, 1].map(|candidate| format!("{:#?}\n", carry_over(&model, candidate, &names)));
        assert_unmoved("carry_over.txt", &text.concat());
        // One session of one kind has nothing to carry over to.
        let mut one = [session(0, 0.1)];
        one[0].runs.retain(|run| run.info.protocol == Some(dataset::Protocol::SquareCw));
        let model = with_effects(&fitted(&one), &["slip_speed"]);
        assert_eq!(carry_over(&model, 0, &names).by_level, []);
    }
}
