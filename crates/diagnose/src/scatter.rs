//! What only scatters: single looks far off, jumps that stay, looks that err alike, and turns that scatter more than the wheels explain.
//!
//! A scatter has no mean to be scanned: failed checks of the fit show most of it. Noise of the turns is in every fit; a fit without it says what it is worth,
//! with half a χ² of one degree of freedom for a variance at its boundary (Chernoff 1954; Self & Liang 1987).

use std::collections::BTreeMap;

use calib::likelihood::{Chain, Column, NoiseComponent};
use calib::methods::joint::JointFit;
use effects::Sign;
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::candidate::terms;
use crate::checks::{Follows, what_follows};
use crate::diagnosis::{Asked, Options, is_covariate};
use crate::document::{Finding, Value};
use crate::naming;
use crate::scan::{Projection, total};
use crate::search::{Extended, cost, count};
use crate::statistics::{p_of_chi_square, p_of_z};

/// Gates of what only scatters: each at a family-wise rate of a thousandth or less.
const SCATTER_LEVEL: f64 = 1e-3;
/// That of turns that scatter: whatever the model lacks makes turns differ from run to run, so that they must do so beyond any doubt.
pub(crate) const TURNS_LEVEL: f64 = 1e-7;

/// Where tails are heavy, what residuals seem to go with must do so beyond doubt: few large errors make such a test fail.
const CERTAINLY: f64 = 1e-6;
/// With more, it is the model that is off, and not the looks.
const MOST_OUTLIERS: f64 = 0.2;

/// Scatter that failed checks show.
pub(crate) fn scatter(asked: &Asked<'_>, options: &Options) -> Vec<Finding> {
    let mut findings = Vec::new();
    let outliers = asked.checked.outliers;
    let fails = |name: &str| asked.checked.checks.iter().find(|check| check.name == name && !check.passes);
    let far = outliers.isolated + outliers.staying;
    #[allow(clippy::cast_precision_loss)]
    if far as f64 > MOST_OUTLIERS * (outliers.looks + far) as f64 {
        // The model does not follow the robot at all: that has no name.
        return findings;
    }
    let turns = of_turns(asked, options);
    let with_something = asked.checked.checks.iter().filter(|check| !check.passes && is_covariate(&check.name));
    let with_something = with_something.map(|check| check.p_value).fold(1.0, f64::min);
    let tails =
        asked.checked.checks.iter().filter(|check| check.name.starts_with("kurtosis_") || check.name == "outliers");
    let tails = tails.map(|check| check.p_value).fold(1.0, f64::min);
    let goes_with_something = with_something < tails.max(CERTAINLY);
    // After the end of a run nothing follows that could be back.
    let followed = asked.base.selections.first().is_some_and(|taken| taken.mean_looks(&asked.base.records) >= 2.0);
    if followed && outliers.p_value < SCATTER_LEVEL && outliers.isolated >= 3 * outliers.staying {
        #[allow(clippy::cast_precision_loss)]
        let share = outliers.isolated as f64 / (outliers.looks + far) as f64;
        let value = Value { value: share, sigma: None, unit: "1".to_owned() };
        let of = outliers.looks + far;
        let what = format!("{} of {of} looks of the instrument lie far off, and the next are back", outliers.isolated);
        let ids = naming::with_sign(Sign::IsolatedLooks, &options.without);
        let parameters = BTreeMap::from([("probability".to_owned(), value)]);
        findings.extend(naming::of_scatter(&ids, outliers.p_value, parameters, &what));
    }
    if goes_with_something {
        // Other large errors that go with what was driven are no scatter; but turns that scatter go with everything that turns, by chance, and less so.
        findings.extend(turns.filter(|turns| turns.p_value < with_something));
        return findings;
    }
    if findings.is_empty() {
        // Tails of one component, and what follows them, say whether the robot jumped or the instrument erred.
        let tails = [("kurtosis_heading", 2, Sign::HeadingJumps), ("kurtosis_along", 0, Sign::WayJumps)];
        let kurtosis = |name: &str| {
            asked.checked.checks.iter().find(|check| check.name == name).map_or(0.0, |check| check.statistic)
        };
        let far_off = outliers.p_value < SCATTER_LEVEL && (outliers.staying > 0 || !followed);
        let heaviest = tails.into_iter().max_by(|a, b| kurtosis(a.0).total_cmp(&kurtosis(b.0)));
        let jump = heaviest.and_then(|(name, component, sign)| {
            let p_value = fails(name).map(|check| check.p_value).or(far_off.then_some(outliers.p_value))?;
            Some((p_value, what_follows(&asked.found.model.fit, component), sign))
        });
        if let Some((p_value, follows, sign)) = jump {
            let ramps = ramps(&asked.found.model.fit);
            let named = |signs: &[Sign]| {
                let mut ids: Vec<&'static str> = Vec::new();
                for id in signs.iter().flat_map(|sign| naming::with_sign(*sign, &options.without)) {
                    if ramps.allow(id) && !ids.contains(&id) {
                        ids.push(id);
                    }
                }
                ids
            };
            // What jumps ahead may turn as well: a bump costs one wheel its way.
            let jumps: &[Sign] =
                if sign == Sign::WayJumps { &[Sign::HeadingJumps, Sign::WayJumps] } else { &[Sign::HeadingJumps] };
            let (stays, errs) = (named(jumps), named(&[Sign::IsolatedLooks, Sign::TailsAtLowSpeed]));
            let (ids, what) = match follows {
                Follows::TheSame => (stays, "single large errors that stay: the robot jumped"),
                Follows::TheOpposite => (errs, "single large errors of the instrument, undone in the next look"),
                // Tails have many causes.
                Follows::Nothing => (
                    [&stays[..], &errs, &["unlisted"]].concat(),
                    "errors have a heavier tail than normal ones, and what follows them does not say whose they are",
                ),
            };
            findings.extend(naming::of_scatter(&ids, p_value, BTreeMap::new(), what));
        }
    }
    if let Some((coefficient, sigmas)) = asked.correlated
        && coefficient > 0.0
    {
        let what = format!(
            "looks that follow each other err alike (correlation {coefficient:.2}), and no term that was tried explains it"
        );
        let mut ids = naming::with_sign(Sign::CorrelatedLooks, &options.without);
        // Where something else is found too, it may be that this is the rest of it.
        if !ids.is_empty() && (asked.in_disguise || !asked.found.model.choices.is_empty()) {
            ids.push("unlisted");
        }
        findings.extend(naming::of_scatter(&ids, p_of_z(sigmas), BTreeMap::new(), &what));
    }
    findings.extend(turns);
    findings
}

/// Where large errors lie: at starts and stops, or anywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ramps {
    /// At starts and stops, far more often than looks do.
    Mostly,
    /// As often as looks do, and too many to be there by chance.
    Anywhere,
    /// They are too few to tell, or all looks have a start or a stop before them.
    CannotBeTold,
}

impl Ramps {
    /// Whether an effect's errors may lie so: wheels stick and slide where they change their speed, and cables and markers lie anywhere.
    fn allow(self, id: &str) -> bool {
        let at_ramps = ["traction_loss", "stick_slip"].contains(&id);
        match self {
            Self::Mostly => at_ramps,
            Self::Anywhere => !at_ramps,
            Self::CannotBeTold => true,
        }
    }
}

/// An innovation this large, in standard deviations, is one that the tails are made of.
const LARGE: f64 = 3.5;
/// Chance at which where large errors lie is told.
const RAMPS_LEVEL: f64 = 1e-3;

/// Where the large errors of a fit lie, by a binomial test against where its looks are.
fn ramps(fit: &JointFit<'_>) -> Ramps {
    let Some(phase) = fit.fit.pass.innovations.first() else { return Ramps::CannotBeTold };
    let at_ramp: Vec<Vec<bool>> = fit.records.chains.iter().map(Chain::changes_of_speed).collect();
    let mut all: Vec<(usize, usize)> = phase.iter().map(|innovation| (innovation.chain, innovation.look)).collect();
    let large = phase.iter().filter(|innovation| innovation.z.abs() > LARGE);
    let mut large: Vec<(usize, usize)> = large.map(|innovation| (innovation.chain, innovation.look)).collect();
    large.extend(&fit.fit.pass.outliers);
    all.extend(&fit.fit.pass.outliers);
    for looks in [&mut all, &mut large] {
        looks.sort_unstable();
        looks.dedup();
    }
    let count = |looks: &[(usize, usize)]| looks.iter().filter(|(chain, look)| at_ramp[*chain][*look]).count();
    #[allow(clippy::cast_precision_loss)]
    let share = count(&all) as f64 / all.len().max(1) as f64;
    let (found, of) = (count(&large) as u64, large.len() as u64);
    let Ok(binomial) = Binomial::new(share, of) else { return Ramps::CannotBeTold };
    // As many or more by chance; and, were nine of ten of them there, as few or fewer.
    if found > 0 && binomial.sf(found - 1) < RAMPS_LEVEL {
        Ramps::Mostly
    } else if Binomial::new(share.max(0.9), of).is_ok_and(|mostly| mostly.cdf(found) < RAMPS_LEVEL) {
        Ramps::Anywhere
    } else {
        Ramps::CannotBeTold
    }
}

/// The chance of a wheelbase that differs as much from run to run, were it one: scores of the runs, each with the variance that it should have.
///
/// Noise of the turns grows with their root, and is soon lost in that of the wheels; a wheelbase that is drawn for each motion errs in proportion to the turn. u_r being
/// the score of run r by the wheelbase, the other free columns taken out, and V_r its variance, Σ u_r² is a weighted sum of χ²s, in law about like one χ² with as much mean
/// and variance. References: Chesher 1984 (the score test of a random coefficient); Satterthwaite 1946.
pub(crate) fn differs_from_run_to_run(model: &Extended<'_>) -> f64 {
    let runs: Vec<_> = model.fit.fit.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    let Some(evidence) = total(&model.fit.fit.pass.runs) else { return 1.0 };
    let own = [Column::Separation.index()];
    let Some(projection) = Projection::beside(&model.fit, &evidence, &own) else { return 1.0 };
    let (mut squares, mut mean, mut spread) = (0.0, 0.0, 0.0);
    for run in &runs {
        let variance = projection.variance_of(run, &evidence, &own)[(0, 0)];
        squares += projection.score_of(run, &evidence, &own)[0].powi(2);
        mean += variance;
        spread += variance * variance;
    }
    if runs.len() < 3 || mean <= 0.0 {
        return 1.0;
    }
    p_of_chi_square(squares * mean / spread, mean * mean / spread)
}

/// Turns that scatter more than the wheels' noise explains, whatever else was found.
fn of_turns(asked: &Asked<'_>, options: &Options) -> Option<Finding> {
    let model = asked.model();
    let without = model.fit.without_noise(NoiseComponent::Turn, &mut terms(&model.choices)).ok()?;
    let most = count(&without).max(count(&model.fit));
    let statistic = 2.0 * (cost(&without, most) - cost(&model.fit, most));
    let p_value = 2.0 * (0.5 * p_of_chi_square(statistic.max(0.0), 1.0)).min(differs_from_run_to_run(model));
    if p_value >= TURNS_LEVEL {
        return None;
    }
    let sigma = model.fit.fit.noise.sigma(NoiseComponent::Turn);
    let value = Value { value: sigma, sigma: None, unit: "rad/sqrt(rad)".to_owned() };
    let parameters = BTreeMap::from([("turn_sigma_rad_per_sqrt_rad".to_owned(), value)]);
    let what = format!("headings scatter with the turn, by {:.1} mrad for each root of a radian", 1e3 * sigma);
    naming::of_scatter(&naming::with_sign(Sign::ScatterWithTurn, &options.without), p_value, parameters, &what)
}
