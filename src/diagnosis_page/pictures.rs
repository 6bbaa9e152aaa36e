//! The diagnosis drawn: residuals against what was recorded, and what names predict.

use diagnose::{Component, NextExperiment, Predicted, Profile, Residuals, ResidualsByCovariate};
use report::{Axis, Colour, Figure, Marks, Panel, Range, Series};

/// Half of a band's width, in standard errors: 95 %.
const BAND: f64 = 1.959_964;
/// Covariates in the first picture.
const MOST: usize = 4;
/// With nothing that stands out, so many are drawn all the same.
const LEAST: usize = 1;
/// A covariate stands out when a model without fault would show as much with this probability, over all
/// covariates and components.
const STANDS_OUT: f64 = 0.01;

const BEFORE: &str = "calibrated model";
const AFTER: &str = "extended model";

/// A picture: its file's stem, a text for who does not see it, and the drawing.
pub(super) type Picture = (&'static str, String, Figure);

/// The smallest p-value of a covariate's components.
fn p_value(against: &ResidualsByCovariate) -> f64 {
    against.components.iter().map(|component| component.before.varies_p_value).fold(1.0, f64::min)
}

fn chi_square(against: &ResidualsByCovariate) -> f64 {
    against.components.iter().map(|component| component.before.varies_chi_square).fold(0.0, f64::max)
}

/// All covariates, the strongest first.
fn strongest_first(residuals: &Residuals) -> Vec<&ResidualsByCovariate> {
    let mut all: Vec<&ResidualsByCovariate> = residuals.by_covariate.iter().collect();
    // p-values of large statistics are all zero in a double: the statistic itself goes on.
    all.sort_by(|a, b| chi_square(b).total_cmp(&chi_square(a)));
    all
}

/// How many of them stand out.
fn standing(residuals: &Residuals) -> usize {
    let tests: usize = residuals.by_covariate.iter().map(|against| against.components.len()).sum();
    let level = STANDS_OUT / tests.max(1) as f64;
    residuals.by_covariate.iter().filter(|against| p_value(against) < level).count()
}

/// Covariates with which the calibrated model's residuals go, the strongest first.
pub(crate) fn that_matter(residuals: &Residuals) -> Vec<&ResidualsByCovariate> {
    let mut all = strongest_first(residuals);
    all.truncate(standing(residuals).clamp(LEAST, MOST));
    all
}

/// All pictures. `extended` says whether there is an extended model.
pub(super) fn pictures(residuals: &Residuals, next: Option<&NextExperiment>, extended: bool) -> Vec<Picture> {
    let mut pictures: Vec<Picture> = Vec::new();
    let matter = that_matter(residuals);
    let standing = standing(residuals);
    if !matter.is_empty() {
        let labels: Vec<&str> = matter.iter().map(|against| &against.label[..]).collect();
        let alt = format!("Mean residuals against {}", labels.join(", "));
        let title = if standing == 0 {
            "The residuals follow nothing that was recorded".to_owned()
        } else {
            let names: Vec<&str> = matter.iter().map(|against| &against.label[..]).collect();
            format!("The residuals follow the {}", names.join(", the "))
        };
        pictures.push(("residuals", alt, figure(&title, &matter, residuals, extended)));
        let all = strongest_first(residuals);
        let alt = "Mean residuals against every covariate, those that they follow first".to_owned();
        let title = format!(
            "The residuals follow {standing} of {} covariates; the strongest first",
            residuals.by_covariate.len()
        );
        pictures.push(("residuals-all", alt, figure(&title, &all, residuals, extended)));
    }
    if let Some(figure) = next.and_then(predictions) {
        pictures.push(("next-experiment", "What each cause predicts for the next experiment".to_owned(), figure));
    }
    pictures
}

fn figure(title: &str, against: &[&ResidualsByCovariate], residuals: &Residuals, extended: bool) -> Figure {
    let scatter = |name: &str| {
        let of = residuals.by_covariate.iter().flat_map(|against| &against.components);
        of.filter(|component| component.component == name).map(|component| 1e3 * component.scatter).fold(0.0, f64::max)
    };
    let caption = format!(
        "{} measurements. A residual is what a measurement sees beyond what counts, model and the measurements before predict. Points: means over bins; bars and band: 95 %, \
         as if measurements erred independently. Single residuals scatter by {:.2} mm along, {:.2} mm across and \
         {:.2} mrad of heading: each panel has its own scale.",
        residuals.measurements,
        scatter("along"),
        scatter("across"),
        scatter("heading"),
    );
    let columns = against.iter().map(|against| against.components.len()).max().unwrap_or(1);
    let mut figure = Figure::new(title).caption(&caption).columns(columns);
    for (row, against) in against.iter().enumerate() {
        for component in &against.components {
            let panel = panel(against, component, extended);
            figure =
                figure.panel(if row == 0 && component.component == "along" { panel } else { panel.without_legend() });
        }
    }
    figure
}

fn panel(against: &ResidualsByCovariate, component: &Component, extended: bool) -> Panel {
    let unit = if component.unit == "rad" { "mrad" } else { "mm" };
    let mut x = if against.unit.is_empty() {
        Axis::dimensionless(&against.label)
    } else {
        Axis::new(&against.label, &against.unit)
    };
    if against.unit == "°" {
        x = x.range(Range::Fixed { low: -180.0, high: 180.0 });
    }
    let y = Axis::new(&format!("residual {}", residual(&component.component)), unit).include(0.0);
    let mut panel = Panel::new("", x, y);
    let points = |profile: &Profile| profile.bins.iter().map(|bin| (bin.at, 1e3 * bin.mean)).collect::<Vec<_>>();
    if extended && component.after.bins.len() > 1 && ascends(&component.after) {
        let edge = |sign: f64| {
            component.after.bins.iter().map(|bin| 1e3 * (bin.mean + sign * BAND * bin.sigma)).collect::<Vec<_>>()
        };
        let band = Marks::Band {
            x: component.after.bins.iter().map(|bin| bin.at).collect(),
            low: edge(-1.0),
            high: edge(1.0),
        };
        panel = panel
            .series(Series::new(AFTER, band).colour(Colour::Blue))
            .series(Series::line(AFTER, points(&component.after)).colour(Colour::Blue));
    } else if extended {
        panel = panel.series(with_bars(AFTER, &component.after).colour(Colour::Blue));
    }
    panel
        .series(Series::new("0", Marks::HorizontalLine { y: 0.0 }))
        .series(with_bars(BEFORE, &component.before).colour(Colour::Vermilion))
}

fn residual(component: &str) -> &str {
    if component == "heading" { "of heading" } else { component }
}

fn ascends(profile: &Profile) -> bool {
    profile.bins.windows(2).all(|pair| pair[0].at < pair[1].at)
}

fn with_bars(name: &str, profile: &Profile) -> Series {
    let points = profile.bins.iter().map(|bin| (bin.at, 1e3 * bin.mean)).collect();
    let errors = profile.bins.iter().map(|bin| 1e3 * BAND * bin.sigma).collect();
    Series::new(name, Marks::Points { points, y_error: Some(errors) })
}

/// How far apart the causes are.
pub(crate) fn predictions_title(predicted: &Predicted) -> String {
    let unit = if predicted.component == "heading" { "mrad" } else { "mm" };
    let values = || predicted.values.values().map(|value| 1e3 * value.value);
    let apart = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
    format!("The next experiment sets the causes up to {apart:.1} {unit} apart")
}

/// What each cause predicts, with what is not known of it.
fn predictions(next: &NextExperiment) -> Option<Figure> {
    let predicted = next.predicted.as_ref()?;
    let unit = if predicted.component == "heading" { "mrad" } else { "mm" };
    let quantity = match &predicted.component[..] {
        "along" => "ahead of dead reckoning",
        "across" => "to the left of dead reckoning",
        _ => "turned to the left of dead reckoning",
    };
    let x = Axis::named("if the cause is", predicted.values.keys().cloned());
    let places = || (1..).map(f64::from).zip(predicted.values.values());
    let points = places().map(|(place, value)| (place, 1e3 * value.value)).collect();
    let errors = places().map(|(_, value)| 1e3 * BAND * value.sigma.unwrap_or(0.0)).collect();
    let points = Series::new("prediction", Marks::Points { points, y_error: Some(errors) });
    let panel = Panel::new("", x, Axis::new(quantity, unit).include(0.0))
        .series(Series::new("0", Marks::HorizontalLine { y: 0.0 }))
        .series(points.colour(Colour::Blue))
        .without_legend();
    let when = if predicted.share_of_duration > 0.999 {
        "at the end".to_owned()
    } else {
        format!("after {:.0} % of the time", 100.0 * predicted.share_of_duration)
    };
    let caption = format!(
        "Mean of the {} runs, {when}. Bars: 95 %, noise and what is not known of each cause.",
        predicted.direction
    );
    Some(Figure::new(&predictions_title(predicted)).caption(&caption).panel(panel))
}
