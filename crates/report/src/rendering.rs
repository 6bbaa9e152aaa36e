//! The two forms of a figure: its SVG, and the PNG that is made of it.

use std::path::{Path, PathBuf};

use resvg::{tiny_skia, usvg};

use crate::draw::document;
use crate::error::ReportError;
use crate::figure::Figure;
use crate::font::Font;
use crate::layout::Layout;
use atomic_file::write_whole;

/// The scale of the PNG that [`Figure::write`] writes: 1800 px wide.
const PNG_SCALE: f64 = 2.0;
const MIN_PNG_SCALE: f64 = 0.1;
const MAX_PNG_SCALE: f64 = 10.0;

impl Figure {
    /// The drawing as an SVG document, [`WIDTH_PX`](crate::WIDTH_PX) wide. Its texts are text: a browser
    /// shows them in DejaVu Sans or a font that is no wider.
    ///
    /// # Errors
    /// [`ReportError::NoPanels`], [`ReportError::Columns`] and [`ReportError::NoGlyph`] of the figure;
    /// [`ReportError::NoSeries`], [`ReportError::AxisRange`] and [`ReportError::EqualAspectOnLog`] of a
    /// panel; of a series [`ReportError::TooFew`], [`ReportError::Lengths`], [`ReportError::NotDrawable`]
    /// (NaN, infinite), [`ReportError::NotPositive`] (on a logarithmic axis), [`ReportError::NegativeError`],
    /// [`ReportError::NotAscending`], [`ReportError::BandUpsideDown`], [`ReportError::BarsWithoutZero`] and
    /// [`ReportError::ReferenceOutside`].
    pub fn to_svg(&self) -> Result<String, ReportError> {
        let font = Font::embedded();
        self.check(&font)?;
        Ok(document(self, &Layout::of(self, &font), &font))
    }

    /// The drawing as a PNG of `scale` pixels per SVG pixel, 0.1 to 10.
    ///
    /// # Errors
    /// As [`Figure::to_svg`]; [`ReportError::PngScale`] for another scale, [`ReportError::Raster`] if the SVG
    /// cannot be rasterised.
    pub fn to_png(&self, scale: f64) -> Result<Vec<u8>, ReportError> {
        self.rasterise(&self.to_svg()?, scale)
    }

    fn rasterise(&self, svg: &str, scale: f64) -> Result<Vec<u8>, ReportError> {
        if !(MIN_PNG_SCALE..=MAX_PNG_SCALE).contains(&scale) {
            return Err(ReportError::PngScale { figure: self.title.clone(), scale, most: MAX_PNG_SCALE });
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

    /// Writes `stem.svg` and `stem.png` (1800 px wide) into `dir`, each in one piece, and returns their
    /// paths. The folder is made if it is not there.
    ///
    /// # Errors
    /// As [`Figure::to_png`]; [`ReportError::Write`] with the file and the system's reason, a file that was
    /// there before is then unharmed.
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
}
