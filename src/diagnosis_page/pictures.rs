//! The diagnosis drawn: residuals against what was recorded, and what names predict.

use diagnose::{Component, NextExperiment, Profile, Residuals, ResidualsByCovariate};
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

/// Covariates with which the calibrated model's residuals go, the strongest first.
pub(crate) fn that_matter(residuals: &Residuals) -> Vec<&ResidualsByCovariate> {
    let tests: usize = residuals.by_covariate.iter().map(|against| against.components.len()).sum();
    let mut all: Vec<&ResidualsByCovariate> = residuals.by_covariate.iter().collect();
    // p-values of large statistics are all zero in a double: the statistic itself goes on.
    all.sort_by(|a, b| chi_square(b).total_cmp(&chi_square(a)));
    let level = STANDS_OUT / tests.max(1) as f64;
    let standing = all.iter().filter(|against| p_value(against) < level).count();
    all.truncate(standing.clamp(LEAST, MOST));
    all
}

/// All pictures. `extended` says whether there is an extended model.
pub(super) fn pictures(residuals: &Residuals, next: Option<&NextExperiment>, extended: bool) -> Vec<Picture> {
    let mut pictures: Vec<Picture> = Vec::new();
    let matter = that_matter(residuals);
    if !matter.is_empty() {
        let labels: Vec<&str> = matter.iter().map(|against| &against.label[..]).collect();
        let alt = format!("Mean residuals against {}", labels.join(", "));
        pictures.push(("residuals", alt, figure("Residuals against what matters most", &matter, residuals, extended)));
        let all: Vec<&ResidualsByCovariate> = residuals.by_covariate.iter().collect();
        let alt = "Mean residuals against every covariate".to_owned();
        pictures.push(("residuals-all", alt, figure("Residuals against every covariate", &all, residuals, extended)));
    }
    if let Some(figure) = next.and_then(predictions) {
        pictures.push(("next-experiment", "What each name predicts for the next experiment".to_owned(), figure));
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

/// What each name predicts, with what is not known of it.
fn predictions(next: &NextExperiment) -> Option<Figure> {
    let predicted = next.predicted.as_ref()?;
    let unit = if predicted.component == "heading" { "mrad" } else { "mm" };
    let quantity = match &predicted.component[..] {
        "along" => "ahead of dead reckoning",
        "across" => "to the left of dead reckoning",
        _ => "turned to the left of dead reckoning",
    };
    let most = predicted.values.len() as f64 + 0.5;
    let x = Axis::dimensionless("name").range(Range::Fixed { low: 0.5, high: most });
    let mut panel = Panel::new("", x, Axis::new(quantity, unit).include(0.0));
    for (place, (id, value)) in (1..).map(f64::from).zip(&predicted.values) {
        let point = vec![(place, 1e3 * value.value)];
        let error = Some(vec![1e3 * BAND * value.sigma.unwrap_or(0.0)]);
        panel = panel.series(Series::new(&format!("{place}: {id}"), Marks::Points { points: point, y_error: error }));
    }
    let when = if predicted.share_of_duration > 0.999 {
        "at the end".to_owned()
    } else {
        format!("after {:.0} % of the time", 100.0 * predicted.share_of_duration)
    };
    let caption = format!(
        "Mean of the {} runs, {when}. Bars: 95 %, noise and what is not known of each name.",
        predicted.direction
    );
    Some(Figure::new("What each name predicts").caption(&caption).panel(panel))
}
