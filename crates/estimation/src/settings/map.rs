//! Of a stated distortion of the instrument's map.

/// Cells into which a map is divided, so many in a correlation length of its distortion.
/// Budgeted: a place is then off by a fiftieth of a length, and the distortion there by a fiftieth of its
/// size.
pub(crate) const MAP_CELLS_PER_LENGTH: f64 = 16.0;

/// Share of a distortion's variance at a place that its functions leave.
/// Budgeted: a hundredth of the variance is within a half per cent of a standard deviation.
pub(crate) const MAX_MAP_REMAINDER: f64 = 0.01;

/// Functions of which a distortion is made, at most, one for each of three coordinates; beyond them it is
/// made of waves.
/// Budgeted: three passes for each, which take about as long as a fit does.
pub(crate) const MAX_MAP_FUNCTIONS: usize = 128;

/// Cells of places, at most, for which functions are sought.
/// Budgeted: 20 MB of numbers.
pub(crate) const MAX_MAP_CELLS: usize = 20_000;

/// Number of lengths of waves of which a map's distortion is made where places are too many.
/// Budgeted: as many passes as the functions of places have at most.
pub(crate) const MAP_WAVES: u32 = 64;

/// Angle between the directions of successive waves, radians.
/// Derived: π (3 − √5), which spreads directions evenly however many there are (Vogel 1979).
pub(crate) const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;
