//! Why a figure cannot be drawn or written: each error names the figure, and the panel and series where there
//! is one.

use std::path::PathBuf;

/// Where in a figure something is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// The figure's title.
    pub figure: Box<str>,
    /// The panel's title.
    pub panel: Box<str>,
    /// The series' name.
    pub series: Box<str>,
}

impl std::fmt::Display for Location {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "figure \"{}\", panel \"{}\", series \"{}\"", self.figure, self.panel, self.series)
    }
}

/// What prevents a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A figure without panels.
    #[error("figure \"{figure}\" has no panel")]
    NoPanels {
        /// The figure's title.
        figure: String,
    },
    /// No columns, or more than can be read at the figure's width.
    #[error("figure \"{figure}\": {columns} columns; there can be 1 to {most}")]
    Columns {
        /// The figure's title.
        figure: String,
        /// The columns asked for.
        columns: usize,
        /// The largest number of columns.
        most: usize,
    },
    /// A panel without series.
    #[error("figure \"{figure}\", panel \"{panel}\" has no series")]
    NoSeries {
        /// The figure's title.
        figure: String,
        /// The panel's title.
        panel: String,
    },
    /// A series with too few values to be seen.
    #[error("{location}: {found} {what}; at least {needed} are needed")]
    TooFew {
        /// Where.
        location: Location,
        /// What there is too little of.
        what: &'static str,
        /// The least number that can be drawn.
        needed: usize,
        /// How many there are.
        found: usize,
    },
    /// Lists that belong together and are not equally long.
    #[error("{location}: {found} {what}; {expected} are expected")]
    Lengths {
        /// Where.
        location: Location,
        /// The list that does not fit.
        what: &'static str,
        /// The length that would fit.
        expected: usize,
        /// Its length.
        found: usize,
    },
    /// A value that is NaN, infinite or beyond ±1e100.
    #[error("{location}: {what}[{index}] = {value} cannot be drawn")]
    NotDrawable {
        /// Where.
        location: Location,
        /// The list that holds the value.
        what: &'static str,
        /// Its index there.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A value that has no place on a logarithmic axis.
    #[error("{location}: {what}[{index}] = {value} is not positive, but the axis \"{axis}\" is logarithmic")]
    NotPositive {
        /// Where.
        location: Location,
        /// The axis' label.
        axis: String,
        /// The list that holds the value.
        what: &'static str,
        /// Its index there.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A half-width of an error bar that is negative.
    #[error("{location}: y_error[{index}] = {value} is negative")]
    NegativeError {
        /// Where.
        location: Location,
        /// The index in `y_error`.
        index: usize,
        /// The value.
        value: f64,
    },
    /// Bin edges or a band's abscissae that do not ascend.
    #[error("{location}: {what}[{index}] = {value} is not above {previous}, the one before")]
    NotAscending {
        /// Where.
        location: Location,
        /// The list.
        what: &'static str,
        /// The index of the second value of the pair.
        index: usize,
        /// The value before.
        previous: f64,
        /// The value.
        value: f64,
    },
    /// A band whose lower edge is above its upper edge.
    #[error("{location}: low[{index}] = {low} is above high[{index}] = {high}")]
    BandUpsideDown {
        /// Where.
        location: Location,
        /// The index.
        index: usize,
        /// The lower edge.
        low: f64,
        /// The upper edge.
        high: f64,
    },
    /// Bars on an axis that does not show zero, where their lengths would not compare.
    #[error("{location}: bars need zero on the axis \"{axis}\"")]
    BarsWithoutZero {
        /// Where.
        location: Location,
        /// The axis' label.
        axis: String,
    },
    /// A reference line outside a fixed range.
    #[error("{location}: the line at {value} is outside the fixed range from {low} to {high}")]
    ReferenceOutside {
        /// Where.
        location: Location,
        /// Where the line is.
        value: f64,
        /// The range's lower end.
        low: f64,
        /// The range's upper end.
        high: f64,
    },
    /// A fixed range or an included value that the axis cannot have.
    #[error("figure \"{figure}\", panel \"{panel}\": the axis \"{axis}\" cannot reach from {low} to {high}")]
    AxisRange {
        /// The figure's title.
        figure: String,
        /// The panel's title.
        panel: String,
        /// The axis' label.
        axis: String,
        /// The lower end.
        low: f64,
        /// The upper end.
        high: f64,
    },
    /// Equal aspect on a logarithmic axis, where it has no meaning.
    #[error("figure \"{figure}\", panel \"{panel}\": equal aspect needs two linear axes")]
    EqualAspectOnLog {
        /// The figure's title.
        figure: String,
        /// The panel's title.
        panel: String,
    },
    /// A character that the embedded font cannot show, a line break among them.
    #[error("figure \"{figure}\": the font has no {character:?}, which \"{text}\" contains")]
    NoGlyph {
        /// The figure's title.
        figure: String,
        /// The text.
        text: String,
        /// The character.
        character: char,
    },
    /// A PNG scale that is not positive or gives an enormous picture.
    #[cfg(feature = "png")]
    #[error("figure \"{figure}\": a PNG scale of {scale} is not in 0.1 to {most}")]
    PngScale {
        /// The figure's title.
        figure: String,
        /// The scale asked for, pixels per SVG pixel.
        scale: f64,
        /// The largest scale.
        most: f64,
    },
    /// The SVG could not be turned into pixels.
    #[cfg(feature = "png")]
    #[error("figure \"{figure}\": no PNG: {why}")]
    Raster {
        /// The figure's title.
        figure: String,
        /// The rasteriser's reason.
        why: String,
    },
    /// A file could not be written.
    #[error("{path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}
