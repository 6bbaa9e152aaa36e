//! Two versions of some records with the measurements that fits of both take.
//!
//! Which poses between rows a fit takes depends on the rows ([`estimation::Records`]): counts that are
//! restored may say less of what lies between them. Costs compare where they are of the same measurements,
//! and are not compared where motions are unknown.

use std::borrow::Cow;
use std::collections::HashSet;

use dataset::Dataset;
use estimation::ModelFit;

/// A run, and the bits of an instant in it.
type Instant = ((usize, usize), u64);

/// Both with the poses that both fits take, each the fit of its records; `None` where each takes as many as
/// the other.
pub(crate) fn with_same_measurements(
    datasets: &[Dataset],
    base: &ModelFit<'_>,
    records: &[Dataset],
    fit: &ModelFit<'_>,
) -> Option<[Vec<Dataset>; 2]> {
    if base.records.measurements() == fit.records.measurements() {
        return None;
    }
    let (of_base, of_fit) = (instants(base), instants(fit));
    let (mut datasets, mut records) = (datasets.to_vec(), records.to_vec());
    for (session, (dataset, other)) in datasets.iter_mut().zip(&mut records).enumerate() {
        for (number, (run, other)) in dataset.runs.iter_mut().zip(&mut other.runs).enumerate() {
            let at = |t_s: f64| ((session, number), t_s.to_bits());
            let both = run.truth.iter().zip(&other.truth);
            let keep: Vec<bool> =
                both.map(|(own, other)| of_base.contains(&at(own.t_s)) && of_fit.contains(&at(other.t_s))).collect();
            run.retain_truth(&keep);
            other.retain_truth(&keep);
        }
    }
    Some([datasets, records])
}

/// When the measurements of a fit were made.
fn instants(fit: &ModelFit<'_>) -> HashSet<Instant> {
    let of_segment = |(number, segment): (usize, &estimation::Segment<'_>)| {
        let run = segment.run;
        (0..).map_while(move |of| Some((run, fit.records.measurement_s(number, of)?.to_bits())))
    };
    fit.records.segments.iter().enumerate().flat_map(of_segment).collect()
}

/// Records whose motion is unknown where that of others is.
pub(crate) fn with_unknown_motion_of<'r>(of: &[Dataset], records: &'r [Dataset]) -> Cow<'r, [Dataset]> {
    let spans = |datasets: &'_ [Dataset]| -> Vec<_> {
        datasets.iter().flat_map(|dataset| &dataset.runs).map(|run| run.unknown_motion.clone()).collect()
    };
    if spans(of) == spans(records) {
        return Cow::Borrowed(records);
    }
    let mut records = records.to_vec();
    let runs = records.iter_mut().flat_map(|dataset| &mut dataset.runs);
    for (run, other) in runs.zip(of.iter().flat_map(|dataset| &dataset.runs)) {
        run.unknown_motion.clone_from(&other.unknown_motion);
    }
    Cow::Owned(records)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small_robot::{fitted, session};

    #[test]
    fn both_keep_what_both_fits_take() {
        let whole = [session(0, 0.0)];
        let mut fewer = whole.clone();
        let lengths = |datasets: &[Dataset]| datasets[0].runs.iter().map(|run| run.truth.len()).collect::<Vec<_>>();
        let all = lengths(&whole);
        fewer[0].runs[2].truth.remove(1);
        // What a fit does not take stays away from both; of the other records the same rows.
        let (of_whole, of_fewer) = (fitted(&whole), fitted(&fewer));
        let [first, second] = with_same_measurements(&whole, &of_fewer, &whole, &of_whole).expect("they differ");
        let mut expected = all.clone();
        expected[2] -= 1;
        assert_eq!((lengths(&first), lengths(&second)), (expected.clone(), expected));
        assert_eq!(first[0].runs[2].truth, fewer[0].runs[2].truth);
        assert!(with_same_measurements(&whole, &of_whole, &whole, &of_whole).is_none());
    }

    #[test]
    fn records_get_the_unknown_motion_of_others() {
        use dataset::UnknownMotion;
        let (sound, mut other) = ([session(0, 0.0)], [session(0, 0.0)]);
        assert!(matches!(with_unknown_motion_of(&sound, &other), Cow::Borrowed(_)));
        other[0].runs[3].add_unknown_motion([UnknownMotion { from_s: 1.0, to_s: 2.0 }]);
        let with = with_unknown_motion_of(&other, &sound);
        assert!(with[0].runs[3].is_motion_unknown(1.0, 2.0) && !with[0].runs[2].is_motion_unknown(1.0, 2.0));
    }
}
