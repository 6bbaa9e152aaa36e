//! Pictures from results: a [`Figure`] is a description, and its SVG and PNG are two forms of the same
//! drawing.
//!
//! No numerics of its own: what is drawn was computed elsewhere, and a value that cannot be drawn is an
//! error, never a gap. Equal descriptions give equal bytes. No font of the machine is used.
//!
//! Why no plotting crate: `plotters` measures text through `font-kit`, the system's fonts; `charming` renders
//! in a JavaScript engine; `kuva` 0.6 (95 000 lines, young) came nearest, but drew the outermost points half
//! outside the frame and does not look for a place where a legend covers no data. What is left is arithmetic
//! on margins. The hard parts are crates: `svg` (the document, escaping), `ttf-parser` (text widths),
//! `dejavu` (DejaVu Sans 2.37, Bitstream Vera licence, 1.4 MB linked: complete in Greek and superscripts, and
//! wider than the usual fallbacks of a browser, so that a text that fits here fits there).
//!
//! The feature `png` adds a PNG beside every SVG, by `resvg` (of linebender, without its `system-fonts`).

mod axis;
mod draw;
mod error;
mod figure;
mod font;
mod frame;
mod layout;
mod legend;
mod marks;
mod panel;
#[cfg(feature = "png")]
mod png;
mod rendering;
mod series;
mod ticks;

pub use axis::{Axis, Range, Scale};
pub use error::{Location, ReportError};
pub use figure::{Figure, MAX_COLUMNS, WIDTH_PX};
pub use panel::Panel;
pub use series::{Colour, Marks, Series};
