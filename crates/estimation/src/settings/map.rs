//! Of a stated distortion of the instrument's map.

rules::settings! {
    Map
    /// Cells into which a map is divided, so many in a correlation length of its distortion.
    /// Budgeted: a place is then off by a fiftieth of a length, and the distortion there by a fiftieth of its
    /// size.
    map_cells_per_length: f64 = 16.0,
    /// Share of a distortion's variance at a place that its functions leave.
    /// Budgeted: a hundredth of the variance is within a half per cent of a standard deviation.
    max_map_remainder: f64 = 0.01,
    /// Functions of which a distortion is made, at most, one for each of three coordinates; beyond them it is
    /// made of waves.
    /// Budgeted: three passes for each, which take about as long as a fit does.
    max_map_functions: usize = 128,
    /// Cells of places, at most, for which functions are sought.
    /// Budgeted: 20 MB of numbers.
    max_map_cells: usize = 20_000,
    /// Number of lengths of waves of which a map's distortion is made where places are too many.
    /// Budgeted: as many passes as the functions of places have at most.
    map_waves: u32 = 64,
    /// Angle between the directions of successive waves, radians.
    /// Derived: π (3 − √5), which spreads directions evenly however many there are (Vogel 1979).
    golden_angle_rad: f64 = 2.399_963_229_728_653,
}
