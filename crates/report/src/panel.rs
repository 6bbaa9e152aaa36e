//! One panel of a figure: two axes and the series between them.

use crate::axis::{Axis, Scale, Span};
use crate::error::{Location, ReportError};
use crate::series::{Along, Series};

/// Two axes with series. Bands and bars are drawn first, then references and lines, then points; in each of
/// these groups in the given order.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Panel {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series>,
    pub(crate) equal_aspect: bool,
    pub(crate) legend: bool,
}

impl Panel {
    /// Title, horizontal and vertical axis, and series in order.
    pub fn parts(&self) -> (&str, &Axis, &Axis, &[Series]) {
        (&self.title, &self.x, &self.y, &self.series)
    }

    /// A panel without series yet, with a legend. An empty title takes no space if all titles of the row are
    /// empty.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self { title: title.to_owned(), x, y, series: Vec::new(), equal_aspect: false, legend: true }
    }

    /// Adds a series.
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// One unit of x as long as one of y: for paths in the plane. Automatic ranges give way; between fixed
    /// ones the frame does.
    pub fn equal_aspect(mut self) -> Self {
        self.equal_aspect = true;
        self
    }

    /// No legend: for a series that title and axes already say, or whose name another panel shows.
    pub fn without_legend(mut self) -> Self {
        self.legend = false;
        self
    }

    pub(crate) fn spans(&self) -> (Span, Span) {
        let extent = |along, scale| self.series.iter().flat_map(|s| s.extent(along, scale)).collect::<Vec<_>>();
        let bars = self.series.iter().any(Series::is_bars);
        (self.x.span(&extent(Along::X, self.x.scale), false), self.y.span(&extent(Along::Y, self.y.scale), bars))
    }

    pub(crate) fn check(&self, figure: &str) -> Result<(), ReportError> {
        let (figure, panel) = (|| figure.to_owned(), || self.title.clone());
        if self.series.is_empty() {
            return Err(ReportError::NoSeries { figure: figure(), panel: panel() });
        }
        for axis in [&self.x, &self.y] {
            axis.check().map_err(|(low, high)| ReportError::AxisRange {
                figure: figure(),
                panel: panel(),
                axis: axis.label.clone(),
                low,
                high,
            })?;
        }
        if self.equal_aspect && (self.x.scale, self.y.scale) != (Scale::Linear, Scale::Linear) {
            return Err(ReportError::EqualAspectOnLog { figure: figure(), panel: panel() });
        }
        for series in &self.series {
            let location =
                || Location { figure: figure().into(), panel: panel().into(), series: series.name.as_str().into() };
            series.check(location, &self.x, &self.y)?;
        }
        Ok(())
    }
}
