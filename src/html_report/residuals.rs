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

/// How to read them, for who drives and does no statistics.
pub(super) const HOW_TO_READ: &str = "Each point is the mean difference between a measured pose and its prediction by the odometry from the measurement before: ahead (along), to the left (across) or turned to the left (heading). The horizontal axis is a quantity that was recorded while driving. A flat line at zero means that the odometry is right whatever this quantity is; a slope or a wave means that the error depends on it.";

/// All of them: first those in which something shows, the strongest first; then the others.
pub(super) fn all_charts(residuals: &Residuals, extended: bool) -> [Vec<Chart>; 2] {
    let mut all: Vec<(&ResidualsByCovariate, &Component)> = Vec::new();
    for against in &residuals.by_covariate {
        let drawn = against.components.iter().filter(|component| !component.before.bins.is_empty());
        all.extend(drawn.map(|component| (against, component)));
    }
    // p-values of large statistics are all zero in a double: the statistic itself goes on.
    all.sort_by(|(_, a), (_, b)| {
        let of = |component: &Component| (component.before.varies_p_value, -component.before.varies_chi_square);
        let ((p, chi), (q, psi)) = (of(a), of(b));
        p.total_cmp(&q).then(chi.total_cmp(&psi))
    });
    let (shows, others): (Vec<_>, Vec<_>) = all.into_iter().partition(|(_, component)| shows(component));
    [shows, others].map(|of| of.into_iter().map(|(against, component)| chart(against, component, extended)).collect())
}

/// Something shows, before or after what was found is taken out.
fn shows(component: &Component) -> bool {
    [&component.before, &component.after].iter().any(|profile| profile.varies_p_value < FOLLOWS_P_VALUE)
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
        caption: format!("{} Points: means; bars: 95 %.", meaning(&component.component)),
        x: Axis::new(&against.label, &against.unit),
        y: Axis::new(&format!("residual {}", of_component(&component.component)), unit),
        at,
        names: Vec::new(),
        series,
    }
}

/// What a value above zero means.
fn meaning(component: &str) -> &'static str {
    match component {
        "heading" => "Above zero the robot had turned further to the left than the odometry says.",
        "across" => "Above zero the robot was further left than the odometry says.",
        _ => "Above zero the robot was further ahead than the odometry says.",
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
        (false, false) if extended => format!("{what} follows the {label} only once what was found is taken out"),
        (false, _) => format!("{what} does not follow the {label}"),
    }
}
