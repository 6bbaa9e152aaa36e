//! A figure in pixels.

use resvg::{tiny_skia, usvg};

use crate::error::ReportError;
use crate::figure::Figure;

/// The scale of the PNG that [`Figure::write`] writes: 1800 px wide.
pub(crate) const WRITTEN_SCALE: f64 = 2.0;

const MIN_SCALE: f64 = 0.1;
const MAX_SCALE: f64 = 10.0;

impl Figure {
    /// The drawing as a PNG of `scale` pixels per SVG pixel, 0.1 to 10.
    ///
    /// # Errors
    /// As [`Figure::to_svg`]; [`ReportError::PngScale`] for another scale, [`ReportError::Raster`] if the SVG
    /// cannot be rasterised.
    pub fn to_png(&self, scale: f64) -> Result<Vec<u8>, ReportError> {
        self.rasterise(&self.to_svg()?, scale)
    }

    pub(crate) fn rasterise(&self, svg: &str, scale: f64) -> Result<Vec<u8>, ReportError> {
        if !(MIN_SCALE..=MAX_SCALE).contains(&scale) {
            return Err(ReportError::PngScale { figure: self.title.clone(), scale, most: MAX_SCALE });
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
}
