//! Gross faults: one rewriting of the faulty records is the faultless log.

use dataset::Dataset;
use effects::{CATALOGUE, Hypothesis};

use super::watched::{Row, drive, perfect, rows};

/// A gross fault by its sizes, and how far its best rewriting may be from the faultless log, radians of a
/// wheel, with the reason.
type RecordFault = (&'static str, &'static [(&'static str, f64)], f64);

const GROSS: &[RecordFault] = &[
    ("swapped_wheels", &[("swapped", 1.0)], 0.0),
    ("reversed_wheel", &[("left", 1.0), ("right", 0.0)], 0.0),
    ("reversed_wheel", &[("left", 0.0), ("right", 1.0)], 0.0),
    ("reversed_wheel", &[("left", 1.0), ("right", 1.0)], 0.0),
    // A count of the log, 1.6e-4 rad over the factor, as logs keep whole ones.
    ("wrong_counts_per_turn", &[("factor", 0.25)], 6.4e-4),
    ("wrong_counts_per_turn", &[("factor", 25.4)], 1e-5),
    ("wrong_counts_per_turn", &[("factor", std::f64::consts::TAU)], 1e-4),
    ("counter_wrap", &[("bits", 16.0)], 0.0),
    ("torn_read", &[("probability", 0.02), ("jump_counts", 256.0)], 0.0),
    ("torn_read", &[("probability", 0.02), ("jump_counts", 65_536.0)], 0.0),
    // What a row counted that was never read is known from the rows around, to what a ramp changes it by.
    ("counter_reset", &[("probability", 0.02), ("persistent", 0.0)], 0.05),
    ("counter_reset", &[("probability", 0.002), ("persistent", 1.0)], 0.05),
    // What was driven in a gap is not known: at ramps it is guessed from the rows around.
    ("dropped_samples", &[("probability", 0.05)], 0.05),
    ("time_unit", &[("factor", 1e3)], 0.0),
    ("time_unit", &[("factor", 1e6)], 0.0),
];

/// Largest difference between the wheels of two records at the rows that both have, from the first row on,
/// radians; infinite where a row of `found` is none.
fn apart(found: &Dataset, faultless: &Dataset) -> f64 {
    let mut worst = 0.0_f64;
    for (found_run, run) in found.runs.iter().zip(&faultless.runs) {
        let angles = |dataset: &Dataset, run| {
            let rows = rows(run, dataset.robot.ticks_per_rev.expect("ticks"));
            let first = rows[0].wheel_rad;
            let after = |row: &Row| row.wheel_rad.zip_with(row.turned_rad, |before, turned| before + turned);
            rows.iter()
                .map(|row| (row.t_s + row.dt_s, after(row).zip_with(first, |now, first| now - first)))
                .collect::<Vec<_>>()
        };
        let all = angles(faultless, run);
        for (t_s, wheel_rad) in angles(found, found_run) {
            let k = all.partition_point(|(row_s, _)| *row_s < t_s - 1e-6);
            let Some((_, expected)) = all.get(k).filter(|(row_s, _)| (row_s - t_s).abs() < 1e-6) else {
                return f64::INFINITY;
            };
            let off = wheel_rad.zip_with(*expected, |a, b| (a - b).abs());
            worst = worst.max(off.left).max(off.right);
        }
    }
    worst
}

#[test]
fn one_rewriting_of_faulty_records_is_the_faultless_log_and_names_the_fault() {
    let faultless = drive(&perfect(), 2);
    for (id, values, remains) in GROSS {
        let mut scenario = perfect();
        let fault = effects::effect_from_estimates(id, values).expect("an effect");
        scenario.effects = vec![fault.clone()];
        let faulty = drive(&scenario, 2);
        let Some(Hypothesis::Records(rewrite)) = effects::hypothesis(id) else { panic!("{id} rewrites records") };
        // Rounding of angles in turns.
        let allowed = remains + 1e-9;
        assert!(apart(&faulty, &faultless) > allowed, "{id} {values:?} harms nothing");
        let corrections = rewrite(&faulty);
        let right = corrections.iter().filter(|correction| apart(&correction.records, &faultless) <= allowed);
        let right: Vec<_> = right.collect();
        let tried: Vec<_> = corrections
            .iter()
            .map(|correction| (&correction.sentence, apart(&correction.records, &faultless)))
            .collect();
        assert_eq!(right.len(), 1, "{id} {values:?}: {tried:?}");
        let named = effects::effect_from_estimates(id, &right[0].values).expect("its sizes make an effect");
        named.physical().check().expect("and a physical one");
        if values[0].0 == "probability" {
            // A share of 1000 rows and more, or of 2000 counts: five standard deviations.
            let of = |values: &[(&str, f64)]| values[0].1;
            assert!(
                (of(&right[0].values) - of(values)).abs() < 5.0 * (of(values) / 1000.0).sqrt(),
                "{:?}",
                right[0].values
            );
        } else {
            assert_eq!(named, fault, "{:?}", right[0].sentence);
        }
    }
}

#[test]
fn faultless_records_show_no_fault_that_leaves_a_mark_in_them() {
    let faultless = drive(&perfect(), 2);
    for id in CATALOGUE {
        let Some(Hypothesis::Records(rewrite)) = effects::hypothesis(id) else { continue };
        let sentences: Vec<String> = rewrite(&faultless).into_iter().map(|correction| correction.sentence).collect();
        // Which column is which, and which way it counts, only what was seen outside can say: these two are
        // always tried.
        let always = ["swapped_wheels", "reversed_wheel"].contains(id);
        assert_eq!(sentences.is_empty(), !always, "{id}: {sentences:?}");
    }
}
