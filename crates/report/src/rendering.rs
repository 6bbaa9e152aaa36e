//! The forms of a figure on disk: its SVG, and with the feature `png` the PNG that is made of it.

use std::path::{Path, PathBuf};

use crate::draw::document;
use crate::error::ReportError;
use crate::figure::Figure;
use crate::font::Font;
use crate::layout::Layout;
use atomic_file::write_whole;

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

    /// Writes `stem.svg` into `dir`, and with the feature `png` also `stem.png` (1800 px wide), each in one
    /// piece, and returns their paths. The folder is made if it is not there.
    ///
    /// # Errors
    /// As [`Figure::to_svg`]; [`ReportError::Write`] with the file and the system's reason, a file that was
    /// there before is then unharmed; with `png` as `Figure::to_png`.
    pub fn write(&self, dir: &Path, stem: &str) -> Result<Vec<PathBuf>, ReportError> {
        let svg = self.to_svg()?;
        let forms = [
            #[cfg(feature = "png")]
            ("png", self.rasterise(&svg, crate::png::WRITTEN_SCALE)?),
            ("svg", svg.into_bytes()),
        ];
        let at = |path: &Path, source| ReportError::Write { path: path.to_owned(), source };
        atomic_file::create_folder(dir).map_err(|error| at(dir, error))?;
        let mut paths = Vec::with_capacity(forms.len());
        for (extension, bytes) in forms {
            let path = dir.join(format!("{stem}.{extension}"));
            write_whole(&path, &bytes).map_err(|error| at(&path, error))?;
            paths.push(path);
        }
        Ok(paths)
    }
}
