//! The panels of a sweep's figure as charts of its page: points with their Monte-Carlo errors, joined where
//! levels are numbers.

use std::collections::BTreeMap;

use report::{Marks, Panel};
use report_page::{Axis, Chart, Mark, Role, Series};

/// Half of a 95 % interval, in standard errors.
const HALF_WIDTH: f64 = 1.959_964;

/// What a method has at the places of a panel.
#[derive(Default)]
struct Method {
    points: BTreeMap<u64, (f64, f64)>,
    is_joined: bool,
}

/// A panel as a chart. Reference lines are in the words of the vertical axis: 0, 1 or 95 %.
pub(super) fn chart(panel: &Panel) -> Chart {
    let (title, x, y, series) = panel.parts();
    let (mut at, mut methods): (Vec<f64>, Vec<(String, Method)>) = (Vec::new(), Vec::new());
    for (name, marks) in series.iter().map(report::Series::parts) {
        let position = methods.iter().position(|(own, _)| own == name).unwrap_or_else(|| {
            methods.push((name.to_owned(), Method::default()));
            methods.len() - 1
        });
        let method = &mut methods[position].1;
        match marks {
            Marks::Line { .. } => method.is_joined = true,
            Marks::Points { points, y_error } => {
                at.extend(points.iter().map(|(x, _)| *x));
                for (k, (x, y)) in points.iter().enumerate() {
                    let error = y_error.as_ref().and_then(|errors| errors.get(k).copied()).unwrap_or(0.0);
                    method.points.insert(x.to_bits(), (*y, HALF_WIDTH * error));
                }
            }
            _ => {}
        }
    }
    at.sort_by(f64::total_cmp);
    at.dedup();
    methods.retain(|(_, method)| !method.points.is_empty());
    let series = (0_u8..).zip(methods).map(|(number, (name, method))| Series {
        name,
        role: Role::Method(number),
        mark: if method.is_joined { Mark::Line } else { Mark::Points },
        values: at.iter().map(|x| Some(method.points.get(&x.to_bits())?.0)).collect(),
        half_widths: at.iter().map(|x| Some(method.points.get(&x.to_bits())?.1)).collect(),
    });
    let series = series.collect();
    let of_cases = !x.names().is_empty();
    Chart {
        title: if title.is_empty() { y.label().to_owned() } else { format!("{}: {title}", y.label()) },
        caption: String::new(),
        x: Axis::new(x.label(), "").logarithmic(x.is_log()),
        y: Axis::new(y.label(), "").logarithmic(y.is_log()),
        // Names belong to places from 0 on.
        at: if of_cases { at.iter().map(|place| place - 1.0).collect() } else { at.clone() },
        names: if of_cases { x.names().to_vec() } else { Vec::new() },
        series,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_keep_their_values_at_the_places_of_all() {
        let points = |points: Vec<(f64, f64)>| Marks::Points { points, y_error: Some(vec![0.5; 2]) };
        let panel =
            Panel::new("B", report::Axis::new("noise", "m"), report::Axis::new("RMSE", "%").scale(report::Scale::Log))
                .series(report::Series::line("direct", [(1.0, 3.0), (2.0, 4.0)]))
                .series(report::Series::new("direct", points(vec![(1.0, 3.0), (2.0, 4.0)])))
                .series(report::Series::new("joint", points(vec![(2.0, 1.0), (3.0, 2.0)])));
        let chart = chart(&panel);
        assert_eq!(chart.at, [1.0, 2.0, 3.0]);
        assert_eq!((chart.y.log, chart.x.log, &chart.title[..]), (true, false, "RMSE (%): B"));
        assert_eq!(chart.series[0].values, [Some(3.0), Some(4.0), None]);
        assert_eq!(chart.series[1].values, [None, Some(1.0), Some(2.0)]);
        assert_eq!((chart.series[0].mark, chart.series[1].mark), (Mark::Line, Mark::Points));
        assert_eq!(chart.series[0].half_widths[0], Some(0.5 * HALF_WIDTH));
    }
}
