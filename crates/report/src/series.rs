//! What is drawn in a panel: one series of marks under one name.

use crate::axis::{Axis, LARGEST, Scale};
use crate::error::{Location, ReportError};

/// The palette of Okabe and Ito (2008), distinct under the common colour blindnesses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the names say it")]
pub enum Colour {
    Black,
    Orange,
    SkyBlue,
    BluishGreen,
    Yellow,
    Blue,
    Vermilion,
    ReddishPurple,
}

impl Colour {
    /// The colours that names get in turn. Yellow is left out: on white it is hard to see.
    pub const IN_TURN: [Self; 7] =
        [Self::Blue, Self::Vermilion, Self::BluishGreen, Self::Orange, Self::ReddishPurple, Self::SkyBlue, Self::Black];

    /// As SVG and CSS write it.
    #[must_use]
    pub fn hex(self) -> &'static str {
        match self {
            Self::Black => "#000000",
            Self::Orange => "#e69f00",
            Self::SkyBlue => "#56b4e9",
            Self::BluishGreen => "#009e73",
            Self::Yellow => "#f0e442",
            Self::Blue => "#0072b2",
            Self::Vermilion => "#d55e00",
            Self::ReddishPurple => "#cc79a7",
        }
    }
}

/// How values become visible. All numbers are in the units of the panel's axes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Marks {
    /// Points joined in the given order.
    Line {
        /// At least two points (x, y).
        points: Vec<(f64, f64)>,
    },
    /// Single markers, with error bars if wanted.
    Points {
        /// The points (x, y).
        points: Vec<(f64, f64)>,
        /// Half the height of each point's error bar, not negative. On a logarithmic axis a bar that reaches
        /// zero ends at the frame.
        y_error: Option<Vec<f64>>,
    },
    /// The area between two curves.
    Band {
        /// Ascending abscissae, at least two.
        x: Vec<f64>,
        /// The lower curve.
        low: Vec<f64>,
        /// The upper curve.
        high: Vec<f64>,
    },
    /// A histogram. Its axis of heights is linear and shows zero.
    Bars {
        /// Ascending edges of the bins, one more than heights.
        edges: Vec<f64>,
        /// The height of each bin.
        heights: Vec<f64>,
    },
    /// A reference across the panel, its name written beside the frame instead of in the legend.
    HorizontalLine {
        /// Where.
        y: f64,
    },
    /// A reference up the panel, its name written above the frame instead of in the legend.
    VerticalLine {
        /// Where.
        x: f64,
    },
}

/// Marks with a name. Series of one name share colour, line style and marker throughout a figure, and in a
/// panel one entry of the legend: so a band and the line within it are named once.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Series {
    pub(crate) name: String,
    pub(crate) marks: Marks,
    pub(crate) colour: Option<Colour>,
}

/// Whether a value is finite, and so are differences of such values.
fn drawable(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// A direction of the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Along {
    X,
    Y,
}

impl Series {
    /// Its name, and what is drawn.
    #[must_use]
    pub fn parts(&self) -> (&str, &Marks) {
        (&self.name, &self.marks)
    }

    /// Marks under a name.
    pub fn new(name: &str, marks: Marks) -> Self {
        Self { name: name.to_owned(), marks, colour: None }
    }

    /// A line through points (x, y).
    pub fn line(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(name, Marks::Line { points: points.into_iter().collect() })
    }

    /// Markers at points (x, y), without error bars.
    pub fn points(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::new(name, Marks::Points { points: points.into_iter().collect(), y_error: None })
    }

    /// A colour of its own instead of the next in turn; references are grey otherwise.
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = Some(colour);
        self
    }

    pub(crate) fn is_reference(&self) -> bool {
        matches!(self.marks, Marks::HorizontalLine { .. } | Marks::VerticalLine { .. })
    }

    pub(crate) fn is_bars(&self) -> bool {
        matches!(self.marks, Marks::Bars { .. })
    }

    /// The values along one direction, by the name of the list that holds them.
    fn lists(&self, along: Along) -> Vec<(&'static str, Vec<f64>)> {
        let pick = |points: &[(f64, f64)]| {
            points.iter().map(|&(x, y)| if along == Along::X { x } else { y }).collect::<Vec<_>>()
        };
        match (&self.marks, along) {
            (Marks::Line { points } | Marks::Points { points, .. }, Along::X) => vec![("x", pick(points))],
            (Marks::Line { points } | Marks::Points { points, .. }, Along::Y) => vec![("y", pick(points))],
            (Marks::Band { x, .. }, Along::X) => vec![("x", x.clone())],
            (Marks::Band { low, high, .. }, Along::Y) => vec![("low", low.clone()), ("high", high.clone())],
            (Marks::Bars { edges, .. }, Along::X) => vec![("edges", edges.clone())],
            (Marks::Bars { heights, .. }, Along::Y) => vec![("heights", heights.clone())],
            (Marks::HorizontalLine { y }, Along::Y) => vec![("y", vec![*y])],
            (Marks::VerticalLine { x }, Along::X) => vec![("x", vec![*x])],
            (Marks::HorizontalLine { .. }, Along::X) | (Marks::VerticalLine { .. }, Along::Y) => Vec::new(),
        }
    }

    /// All values that an automatic range along a direction has to show.
    pub(crate) fn extent(&self, along: Along, scale: Scale) -> Vec<f64> {
        let mut values: Vec<f64> = self.lists(along).into_iter().flat_map(|(_, list)| list).collect();
        if let (Marks::Points { points, y_error: Some(errors) }, Along::Y) = (&self.marks, along) {
            let ends = points.iter().zip(errors).flat_map(|(&(_, y), error)| [y - error, y + error]);
            values.extend(ends.filter(|&end| scale == Scale::Linear || end > 0.0));
        }
        values
    }

    /// Whether the marks can be drawn on these axes.
    pub(crate) fn check(&self, location: impl Fn() -> Location, x: &Axis, y: &Axis) -> Result<(), ReportError> {
        let enough = |what, found, needed| {
            (found >= needed).then_some(()).ok_or_else(|| ReportError::TooFew {
                location: location(),
                what,
                needed,
                found,
            })
        };
        let as_long = |what, found, expected| {
            (found == expected).then_some(()).ok_or_else(|| ReportError::Lengths {
                location: location(),
                what,
                expected,
                found,
            })
        };
        let ascending = |what, values: &[f64]| match values.windows(2).position(|pair| pair[0] >= pair[1]) {
            None => Ok(()),
            Some(at) => Err(ReportError::NotAscending {
                location: location(),
                what,
                index: at + 1,
                previous: values[at],
                value: values[at + 1],
            }),
        };
        match &self.marks {
            Marks::Line { points } => enough("points", points.len(), 2)?,
            Marks::Points { points, y_error } => {
                enough("points", points.len(), 1)?;
                as_long("y_error", y_error.as_ref().map_or(points.len(), Vec::len), points.len())?;
            }
            Marks::Band { x, low, high } => {
                enough("x", x.len(), 2)?;
                as_long("low", low.len(), x.len())?;
                as_long("high", high.len(), x.len())?;
            }
            Marks::Bars { edges, heights } => {
                enough("heights", heights.len(), 1)?;
                as_long("edges", edges.len(), heights.len() + 1)?;
            }
            Marks::HorizontalLine { .. } | Marks::VerticalLine { .. } => {}
        }
        for (along, axis) in [(Along::X, x), (Along::Y, y)] {
            for (what, values) in self.lists(along) {
                self.check_values(&location, what, &values, axis)?;
            }
        }
        match &self.marks {
            Marks::Points { y_error: Some(errors), .. } => {
                for (index, &value) in errors.iter().enumerate() {
                    if !drawable(value) {
                        return Err(ReportError::NotDrawable { location: location(), what: "y_error", index, value });
                    }
                    if value < 0.0 {
                        return Err(ReportError::NegativeError { location: location(), index, value });
                    }
                }
            }
            Marks::Band { x, low, high } => {
                ascending("x", x)?;
                if let Some(index) = (0..x.len()).find(|&index| low[index] > high[index]) {
                    let (low, high) = (low[index], high[index]);
                    return Err(ReportError::BandUpsideDown { location: location(), index, low, high });
                }
            }
            Marks::Bars { edges, .. } => {
                ascending("edges", edges)?;
                let hidden = matches!(y.range, crate::Range::Fixed { low, high } if !(low..=high).contains(&0.0));
                if hidden || y.scale == Scale::Log {
                    return Err(ReportError::BarsWithoutZero { location: location(), axis: y.label.clone() });
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn check_values(
        &self,
        location: &impl Fn() -> Location,
        what: &'static str,
        values: &[f64],
        axis: &Axis,
    ) -> Result<(), ReportError> {
        for (index, &value) in values.iter().enumerate() {
            if !drawable(value) {
                return Err(ReportError::NotDrawable { location: location(), what, index, value });
            }
            // A height of zero on a logarithmic axis is said as what it is: bars have no place there.
            if axis.scale == Scale::Log && value <= 0.0 && what != "heights" {
                return Err(ReportError::NotPositive {
                    location: location(),
                    axis: axis.label.clone(),
                    what,
                    index,
                    value,
                });
            }
            if let (true, crate::Range::Fixed { low, high }) = (self.is_reference(), axis.range)
                && !(low..=high).contains(&value)
            {
                return Err(ReportError::ReferenceOutside { location: location(), value, low, high });
            }
        }
        Ok(())
    }
}
