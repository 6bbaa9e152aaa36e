//! What the tables of instruments have in common: columns that make records of rows, and the marked points
//! that rows speak of.

use std::collections::HashMap;

use crate::error::{DatasetError, shown};
use crate::record::{MarkedPoint, Run};
use crate::table::Row;

/// Marked points that an error lists.
const LISTED_POINTS: usize = 20;

/// Where the columns of one kind of table stand, and what a row becomes.
pub(super) trait TruthColumns: std::fmt::Debug {
    fn reserve(&self, run: &mut Run, rows: usize);
    fn push(&self, row: &Row<'_>, run: &mut Run, points: &PointIndex) -> Result<(), DatasetError>;

    /// The instants' column, where a row speaks of one instant and stands for itself: only then can a run be
    /// cut between two of them.
    fn instant(&self) -> Option<usize> {
        None
    }
}

/// Which marked point an id speaks of.
#[derive(Debug)]
pub(super) struct PointIndex {
    pub(super) by_id: HashMap<Box<[u8]>, usize>,
    pub(super) known: String,
}

impl PointIndex {
    pub(super) fn new(points: &[MarkedPoint]) -> Self {
        let by_id = points.iter().map(|point| point.id.as_bytes().into()).zip(0..).collect();
        let mut known: Vec<_> = points.iter().take(LISTED_POINTS).map(|point| shown(point.id.as_bytes())).collect();
        if points.len() > LISTED_POINTS {
            known.push("…".to_owned());
        } else if points.is_empty() {
            known.push("none".to_owned());
        }
        Self { by_id, known: known.join(", ") }
    }
}
