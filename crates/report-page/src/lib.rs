//! One self-contained HTML page from results: it loads nothing, and what it may run is named by hash.
//!
//! The typed [`Report`] goes in, the text of the page comes out. There are no numerics but the decimation of
//! paths. Templates escape by themselves (askama); data for the script stand in blocks of JSON that nothing
//! in them can leave (`embedded_json.rs`); the content security policy holds the hashes of the one style
//! sheet and the scripts (`content_policy.rs`).

mod bars;
mod chart;
mod content_policy;
mod decimation;
mod embedded_json;
mod error;
mod error_picture;
mod numbers;
mod page;
mod path_picture;
mod report;
mod role;
mod sketch;
mod table;

pub use bars::{Bar, Bars};
pub use chart::{Axis, Chart, Mark, Series};
pub use error::PageError;
pub use error_picture::{ErrorPicture, ModelErrors, RunErrors};
pub use path_picture::{MAX_DRAWN_RUNS, POINT_BUDGET, PathPicture, PathRun};
pub use report::{Block, MadeBy, Report, Section, Tile, Tone};
pub use role::Role;
pub use sketch::{Manoeuvre, Sketch};
pub use table::{Cell, Table};
