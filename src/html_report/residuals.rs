//! Residuals against what was recorded, before and after what was found is in the model.

use ::diagnose::{Component, Profile, Residuals, ResidualsByCovariate};
use report_page::{Axis, Chart, Mark, Role, Series};

use crate::diagnosis_page::that_matter;

/// Half of a 95 % interval, in standard errors.
const HALF_WIDTH: f64 = 1.959_964;
/// Residuals follow a covariate when a model without fault would show as much with this probability. For the
/// title of one picture alone: the checks of all are in the appendix.
const FOLLOWS_P_VALUE: f64 = 1e-3;

/// Those with which the calibrated model's residuals go.
pub(super) fn charts_that_matter(residuals: &Residuals, extended: bool) -> Vec<Chart> {
    let matter = that_matter(residuals);
    matter.into_iter().flat_map(|against| charts(against, extended)).collect()
}

/// All of them.
pub(super) fn all_charts(residuals: &Residuals, extended: bool) -> Vec<Chart> {
    residuals.by_covariate.iter().flat_map(|against| charts(against, extended)).collect()
}

fn charts(against: &ResidualsByCovariate, extended: bool) -> Vec<Chart> {
    against
        .components
        .iter()
        .filter(|component| !component.before.bins.is_empty())
        .map(|component| chart(against, component, extended))
        .collect()
}

fn chart(against: &ResidualsByCovariate, component: &Component, extended: bool) -> Chart {
    let unit = if component.unit == "rad" { "mrad" } else { "mm" };
    let (before, after) = (&component.before, &component.after);
    // Bins of one covariate stand at nearly the same places; where a model left other measurements out they
    // differ, and each has its own places.
    let mut at: Vec<f64> = before.bins.iter().map(|bin| bin.at).collect();
    let same =
        after.bins.len() == before.bins.len() && after.bins.iter().zip(&before.bins).all(|(a, b)| a.count == b.count);
    if extended && !same {
        at.extend(after.bins.iter().map(|bin| bin.at));
        at.sort_by(f64::total_cmp);
        at.dedup();
    }
    let of = |profile: &Profile, value: fn(&::diagnose::Bin) -> f64| -> Vec<Option<f64>> {
        if same {
            return profile.bins.iter().map(|bin| Some(1e3 * value(bin))).collect();
        }
        at.iter().map(|place| profile.bins.iter().find(|bin| bin.at == *place).map(|bin| 1e3 * value(bin))).collect()
    };
    let points = |name: &str, role, profile: &Profile| Series {
        name: name.to_owned(),
        role,
        mark: Mark::Points,
        values: of(profile, |bin| bin.mean),
        half_widths: of(profile, |bin| HALF_WIDTH * bin.sigma),
    };
    let mut series = vec![points("before (calibrated)", Role::Calibrated, before)];
    if extended {
        if same {
            // What the extended model takes out of the residuals is what it says that they follow.
            let explained = before.bins.iter().zip(&after.bins).map(|(b, a)| Some(1e3 * (b.mean - a.mean)));
            series.push(Series {
                name: "what was found explains".to_owned(),
                role: Role::Explained,
                mark: Mark::Line,
                values: explained.collect(),
                half_widths: Vec::new(),
            });
        }
        series.push(points("after (extended)", Role::ExtendedModel, after));
    }
    Chart {
        title: title(against, component, extended),
        caption: "Means over bins with 95 % intervals; zero is right.".to_owned(),
        x: Axis::new(&against.label, &against.unit),
        y: Axis::new(&format!("residual {}", of_component(&component.component)), unit),
        at,
        names: Vec::new(),
        series,
    }
}

fn of_component(component: &str) -> &str {
    if component == "heading" { "of heading" } else { component }
}

/// The finding of one picture.
fn title(against: &ResidualsByCovariate, component: &Component, extended: bool) -> String {
    let what = match &component.component[..] {
        "heading" => "The heading error",
        "across" => "The error across the robot",
        _ => "The error along the robot",
    };
    let label = &against.label;
    let follows = |profile: &Profile| profile.varies_p_value < FOLLOWS_P_VALUE;
    match (follows(&component.before), extended && !follows(&component.after)) {
        (true, true) => format!("{what} follows the {label}; with what was found, no longer"),
        (true, false) if extended => format!("{what} follows the {label}, and still does with what was found"),
        (true, false) => format!("{what} follows the {label}"),
        (false, _) => format!("{what} does not follow the {label}"),
    }
}
