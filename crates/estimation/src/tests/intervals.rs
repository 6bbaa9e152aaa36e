//! The wheels' intervals along a segment: each goes on where the one before ends.

use super::*;

#[test]
fn intervals_go_on_where_the_one_before_ends() {
    let dataset = golden::dense();
    let records = Records::of(&[dataset.session()]);
    for segment in &records.segments {
        assert!(segment.intervals.len() > 600, "{}", segment.intervals.len());
        for pair in segment.intervals.windows(2) {
            let (before, next) = (&pair[0], &pair[1]);
            // Sums of stamps of seconds.
            assert!((before.t_s + before.dt_s - next.t_s).abs() < 1e-9, "{before:?} {next:?}");
            // Where a row is cut by a measurement, how late it is stamped goes in proportion.
            assert!((before.late_s[1] - next.late_s[0]).abs() < 1e-9, "{:?} {:?}", before.late_s, next.late_s);
            for side in kinematics::Side::BOTH {
                let [end, start] = [before.rate_at_ends_rad_s[1][side], next.rate_at_ends_rad_s[0][side]];
                let is_joined = (end - start).abs() < 1e-9;
                // Over a gap of the log rates are those of its sides.
                assert!(is_joined || before.dt_s > 0.1 || next.dt_s > 0.1, "{end} {start} at {}", next.t_s);
            }
        }
        let late = segment.intervals.iter().filter(|interval| interval.late_s[0].abs() > 5e-4).count();
        assert!(late > 100, "stamps hardly jitter: {late}");
    }
}
