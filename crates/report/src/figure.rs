//! A figure: its description, and its two forms, SVG and PNG.

use std::path::{Path, PathBuf};

use resvg::{tiny_skia, usvg};

use crate::error::ReportError;
use crate::font::Font;
use crate::layout::Layout;
use crate::panel::Panel;
use atomic_file::write_whole;

/// The width of every figure in SVG pixels; its height follows from its panels.
pub const WIDTH_PX: f64 = 900.0;
/// With more columns the labels of a figure of [`WIDTH_PX`] would fill it.
pub const MOST_COLUMNS: usize = 3;
/// The scale of the PNG that [`Figure::write`] writes: 1800 px wide.
const PNG_SCALE: f64 = 2.0;
const LEAST_PNG_SCALE: f64 = 0.1;
const MOST_PNG_SCALE: f64 = 10.0;

/// Panels in a grid under a title, with a caption.
///
/// ```
/// use report::{Axis, Figure, Marks, Panel, Scale, Series};
///
/// let (effort, bias_mm) = (vec![1.0, 3.0, 10.0], vec![2.1, 1.2, 0.4]);
/// let points = effort.iter().copied().zip(bias_mm).collect();
/// let panel = Panel::new("Bias", Axis::dimensionless("runs").scale(Scale::Log), Axis::new("bias of the track", "mm"))
///     .series(Series::new("umbmark", Marks::Points { points, y_error: Some(vec![0.5, 0.3, 0.2]) }))
///     .series(Series::new("no bias", Marks::HorizontalLine { y: 0.0 }));
/// let figure = Figure::new("More runs, less bias").caption("scenario paper.toml, seed 7").panel(panel);
/// assert!(figure.to_svg()?.contains("bias of the track (mm)"));
/// # Ok::<(), report::ReportError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Figure {
    pub(crate) title: String,
    pub(crate) caption: String,
    pub(crate) columns: usize,
    pub(crate) panels: Vec<Panel>,
}

impl Figure {
    /// A figure without panels yet, in one column.
    pub fn new(title: &str) -> Self {
        Self { title: title.to_owned(), caption: String::new(), columns: 1, panels: Vec::new() }
    }

    /// The text below the panels: what makes the figure reproducible, say scenario, seed and number of trials.
    pub fn caption(mut self, caption: &str) -> Self {
        caption.clone_into(&mut self.caption);
        self
    }

    /// Panels beside each other, 1 to [`MOST_COLUMNS`].
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns;
        self
    }

    /// Adds a panel, row by row.
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// The drawing as an SVG document, [`WIDTH_PX`] wide. Its texts are text: a browser shows them in DejaVu Sans or a font that is no wider.
    ///
    /// # Errors
    /// [`ReportError::NoPanels`], [`ReportError::Columns`] and [`ReportError::NoGlyph`] of the figure; [`ReportError::NoSeries`],
    /// [`ReportError::AxisRange`] and [`ReportError::EqualAspectOnLog`] of a panel; of a series [`ReportError::TooFew`], [`ReportError::Lengths`],
    /// [`ReportError::NotDrawable`] (NaN, infinite), [`ReportError::NotPositive`] (on a logarithmic axis), [`ReportError::NegativeError`],
    /// [`ReportError::NotAscending`], [`ReportError::BandUpsideDown`], [`ReportError::BarsWithoutZero`] and [`ReportError::ReferenceOutside`].
    pub fn to_svg(&self) -> Result<String, ReportError> {
        let font = Font::embedded();
        self.check(&font)?;
        Ok(crate::draw::document(self, &Layout::of(self, &font), &font))
    }

    /// The drawing as a PNG of `scale` pixels per SVG pixel, 0.1 to 10.
    ///
    /// # Errors
    /// As [`Figure::to_svg`]; [`ReportError::PngScale`] for another scale, [`ReportError::Raster`] if the SVG cannot be rasterised.
    pub fn to_png(&self, scale: f64) -> Result<Vec<u8>, ReportError> {
        self.rasterise(&self.to_svg()?, scale)
    }

    fn rasterise(&self, svg: &str, scale: f64) -> Result<Vec<u8>, ReportError> {
        if !(LEAST_PNG_SCALE..=MOST_PNG_SCALE).contains(&scale) {
            return Err(ReportError::PngScale { figure: self.title.clone(), scale, most: MOST_PNG_SCALE });
        }
        let failed = |why: String| ReportError::Raster { figure: self.title.clone(), why };
        let mut options = usvg::Options::default();
        options.fontdb_mut().load_font_data(dejavu::sans::regular().to_vec());
        options.fontdb_mut().load_font_data(dejavu::sans::bold().to_vec());
        let tree = usvg::Tree::from_str(svg, &options).map_err(|error| failed(error.to_string()))?;
        let size = tree.size();
        let pixels = |length: f32| (f64::from(length) * scale).round() as u32;
        let mut pixmap = tiny_skia::Pixmap::new(pixels(size.width()), pixels(size.height()))
            .ok_or_else(|| failed(format!("{} × {} px at scale {scale}", size.width(), size.height())))?;
        let transform = tiny_skia::Transform::from_scale(scale as f32, scale as f32);
        resvg::render(&tree, transform, &mut pixmap.as_mut());
        pixmap.encode_png().map_err(|error| failed(error.to_string()))
    }

    /// Writes `stem.svg` and `stem.png` (1800 px wide) into `dir`, each in one piece, and returns their paths. The folder is made if it is not there.
    ///
    /// # Errors
    /// As [`Figure::to_png`]; [`ReportError::Write`] with the file and the system's reason, a file that was there before is then unharmed.
    pub fn write(&self, dir: &Path, stem: &str) -> Result<[PathBuf; 2], ReportError> {
        let svg = self.to_svg()?;
        let png = self.rasterise(&svg, PNG_SCALE)?;
        let at = |path: &Path, source| ReportError::Write { path: path.to_owned(), source };
        std::fs::create_dir_all(dir).map_err(|error| at(dir, error))?;
        let paths = [dir.join(format!("{stem}.svg")), dir.join(format!("{stem}.png"))];
        for (path, bytes) in paths.iter().zip([svg.as_bytes(), &png]) {
            write_whole(path, bytes).map_err(|error| at(path, error))?;
        }
        Ok(paths)
    }

    fn check(&self, font: &Font) -> Result<(), ReportError> {
        let figure = || self.title.clone();
        if self.panels.is_empty() {
            return Err(ReportError::NoPanels { figure: figure() });
        }
        if !(1..=MOST_COLUMNS).contains(&self.columns) {
            return Err(ReportError::Columns { figure: figure(), columns: self.columns, most: MOST_COLUMNS });
        }
        for panel in &self.panels {
            panel.check(&self.title)?;
        }
        let of_panel = |panel: &Panel| {
            let texts = [&panel.title, &panel.x.label, &panel.y.label].map(Clone::clone);
            texts.into_iter().chain(panel.series.iter().map(|series| series.name.clone())).collect::<Vec<_>>()
        };
        let texts = [self.title.clone(), self.caption.clone()].into_iter().chain(self.panels.iter().flat_map(of_panel));
        for text in texts {
            if let Some(character) = font.missing(&text) {
                return Err(ReportError::NoGlyph { figure: figure(), text, character });
            }
        }
        Ok(())
    }
}
