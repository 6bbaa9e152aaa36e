//! Of poses that were measured between two rows of a log.

rules::settings! {
    PosesBetweenRows
    /// Variance that poses of one row have in common, over that of the instrument, up to which all are taken.
    /// Budgeted: the mean of many then varies by a few tenths more than is said, in the worst case.
    max_shared_variance_ratio: f64 = 0.1,
    /// Variance of what the log does not tell between two rows, over that of the instrument, up to which a
    /// pose between them is taken.
    /// Tuned: of 200 nulls under motion capture (seeds 18018 and 20020) 15 have a finding with all poses, 11
    /// up to 1, 12 up to 0.3 and 15 up to 0.1; right first causes 83 of 94, 83 of 90, 85 of 92 and 85 of 91.
    /// That was before poses beside rows that are rounded more than the instrument's noise were all kept.
    max_interpolated_variance_ratio: f64 = 1.0,
    /// Poses of a segment near its rows from which on the others are left out.
    /// Budgeted: the scatter of eight says a variance to a half of itself.
    min_poses_near_rows: usize = 8,
}
