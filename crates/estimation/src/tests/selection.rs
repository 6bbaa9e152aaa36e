//! Which measurements and rows the likelihood takes: thinning, and decimation of fast logs.

use dataset::{Displacement, Odometry};

use super::*;
use crate::FitSettings;
use crate::NormalEquations;
use crate::decimation::Decimated;
use crate::segment::Segment;

#[test]
fn thinned_measurements_are_far_enough_apart_and_end_with_the_last() {
    let dataset = dataset(true);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning { every_s: 4.0, phases: 2 }, &MODEL);
    let measurements = |phase: usize| -> Vec<usize> {
        selections[phase].propagations[0].iter().map(|propagation| propagation.measurement).collect()
    };
    // Measurements every 2 s up to 12 s: at 4, 8, 12 s, and from 6 s on.
    assert_eq!(measurements(0), [2, 4, 6]);
    assert_eq!(measurements(1), [3, 6]);
    let first = &selections[1].propagations[0][0];
    assert_eq!((first.intervals.clone(), first.from), (0..6, 0));
}

/// Normal variables by the sum of twelve uniform ones of `SplitMix64` (Steele, Lea & Flood 2014).
pub(super) struct Normals(pub(super) u64);

impl Normals {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        f64::from(u32::try_from((z ^ (z >> 31)) >> 32).expect("half of the bits")) / f64::from(u32::MAX)
    }

    pub(super) fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Displacements of each run; each takes a second.
const DISPLACEMENTS: [u32; 8] = [40; 8];

/// Runs measured by displacements of a second, with errors of which a share `autocorrelation` lasts from one
/// to the next (a first-order autoregression of variance one, in millimetres and milliradians).
pub(super) fn displacement_dataset(runs: &[u32], autocorrelation: f64, seed: u64) -> Dataset {
    let mut normals = Normals(seed);
    let mut dataset = dataset(true);
    let base = dataset.runs[0].clone();
    let run = |(number, displacements): (usize, &u32)| {
        let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
        let (mut measured, mut errors) = (Vec::new(), [0.0; 3].map(|_: f64| normals.next()));
        for second in 0..*displacements {
            let k = (second as usize + number) % LEFT_RAD.len();
            let turned = Wheels { left: LEFT_RAD[k], right: RIGHT_RAD[k] };
            for (side, rad) in [(&mut angles.left, turned.left), (&mut angles.right, turned.right)] {
                let before = *side.last().expect("a start");
                side.push(before + rad);
            }
            let travel_m = Wheels { left: 0.0811 * turned.left, right: 0.0797 * turned.right };
            let slid_m = travel_m.map(|travel_m: f64| travel_m + 3e-4 * travel_m.abs().sqrt() * normals.next());
            let moved = Increment::from_travel(slid_m, 0.366).arc();
            errors = errors.map(|error| {
                autocorrelation * error + (1.0 - autocorrelation * autocorrelation).sqrt() * normals.next()
            });
            measured.push(Displacement {
                t0_s: f64::from(second),
                t1_s: f64::from(second + 1),
                dx_m: moved.x_m + 1e-3 * errors[0],
                dy_m: moved.y_m + 1e-3 * errors[1],
                dtheta_rad: moved.theta_rad + 1e-3 * errors[2],
            });
        }
        let t_s = (0..=*displacements).map(f64::from).collect();
        let odometry = Odometry { t_s, wheels: WheelLog::Angles(angles), ..Odometry::default() };
        let info = RunInfo { id: format!("run-{number}"), ..base.info.clone() };
        Run { info, odometry, displacements: measured, ..Run::default() }
    };
    dataset.runs = runs.iter().enumerate().map(run).collect();
    dataset
}

#[test]
fn thinned_displacements_are_far_enough_apart_and_every_run_has_one() {
    let dataset = displacement_dataset(&[6, 1], 0.0, 0);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning { every_s: 2.5, phases: 2 }, &MODEL);
    let taken = |phase: usize| -> Vec<usize> {
        let propagations = selections[phase].propagations.iter().enumerate();
        propagations.filter(|(_, propagations)| !propagations.is_empty()).map(|(segment, _)| segment).collect()
    };
    // They end at 1 … 6 s: the first phase takes those at 1 and 4 s, the second, due from 1 + 1.25 s on,
    // those at 3 and 6 s. The run of one gives it to both.
    assert_eq!(taken(0), [0, 3, 6]);
    assert_eq!(taken(1), [2, 5, 6]);
    assert!(records.times_between().all(|between_s| (between_s - 1.0).abs() < 1e-12));
    // Of the runs, not of the displacements, each of which is a segment of its own.
    assert!((selections[0].mean_measurements(&records) - 1.5).abs() < 1e-12);
    let all = Selection::of(&records, Thinning::NONE, &MODEL);
    assert!((all[0].mean_measurements(&records) - 3.5).abs() < 1e-12);
}

/// Of 20 datasets with white errors, four or more would be thinned by chance once in 20 000 times (1 % each).
/// Were displacements not neighbours, none of those whose errors last would.
#[test]
fn displacements_are_thinned_where_their_errors_last_and_only_there() {
    let thinned = |autocorrelation: f64| {
        let of = |seed: &u64| {
            let dataset = displacement_dataset(&DISPLACEMENTS, autocorrelation, *seed);
            let joint = FitSettings { nuisances: false, thin: true, thin_displacements: true };
            joint.fit(&[dataset.session()]).expect("a fit").thinning != Thinning::NONE
        };
        (1..=20_u64).filter(of).count()
    };
    assert!(thinned(0.0) < 4);
    assert_eq!(thinned(0.7), 20);
}

#[test]
fn phases_that_take_the_same_of_a_run_count_it_as_often_and_filter_it_alike() {
    let dataset = dataset(true);
    let records = Records::of(&[dataset.session()]);
    let all = Selection::of(&records, Thinning::NONE, &MODEL).remove(0);
    let few = Selection::of(&records, Thinning { every_s: 4.0, phases: 1 }, &MODEL).remove(0);
    // Its first run is that of the one, its second that of the other.
    let mut mixed = all.clone();
    mixed.propagations[1].clone_from(&few.propagations[1]);
    let phases = [all.clone(), all, mixed.clone(), mixed, few];
    let times = |run: std::ops::Range<usize>| Selection::times_in_a_row(&phases, &run);
    assert_eq!((times(0..1), times(1..2)), (4, 2));
    let with_memory = |terms: usize| -> Vec<Box<dyn ModelTerm>> {
        (0..terms).map(|_| Box::new(RunDistanceTerm { distance_m: 0.0 }) as Box<dyn ModelTerm>).collect()
    };
    let passed = |phases: &[Selection], terms: usize| {
        let mut terms = with_memory(terms);
        let model = Model { term_values: vec![0.001; 2 * terms.len()], ..MODEL };
        let pass_options =
            PassOptions { noise_score: true, innovations: true, samples: true, keep: true, ..PassOptions::default() };
        pass(&records, phases, &model, &NOISE, &[0.0; 2], &mut terms, pass_options)
    };
    for terms in [0, 1] {
        let together = passed(&phases, terms);
        let one_by_one: Vec<Pass> = phases.iter().map(|phase| passed(std::slice::from_ref(phase), terms)).collect();
        for (phase, alone) in one_by_one.iter().enumerate() {
            assert_eq!(together.innovations[phase], alone.innovations[0]);
            assert_eq!(together.samples[phase], alone.samples[0]);
        }
        for (number, run) in together.runs.iter().enumerate() {
            let mut mean = NormalEquations::new(run.run, run.gradient.len());
            one_by_one.iter().for_each(|alone| mean.add(&alone.runs[number], 0.2));
            // The same sums in the same order. Rejects a run that counts once for phases that share it, and a
            // run's phases that are taken for another's.
            assert_eq!(*run, mean);
        }
        // Propagations that are kept serve each phase.
        let cached = together.cached.expect("kept");
        let model = cached.model.clone();
        let by = PassOptions { innovations: true, by: Some(&cached), ..PassOptions::default() };
        let again = pass(&records, &phases, &model, &NOISE, &[0.0; 2], &mut with_memory(terms), by);
        assert_eq!(again.innovations, together.innovations);
    }
}

/// The fit of every measurement is the first step of the one that thins.
#[test]
fn a_fit_of_every_measurement_is_thinned_to_the_bits_of_one_that_thins_from_the_start() {
    let dataset = displacement_dataset(&DISPLACEMENTS, 0.7, 3);
    let every = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    let whole = FitSettings { thin: true, thin_displacements: true, ..FitSettings::GEOMETRY_ONLY };
    let whole = whole.fit(&[dataset.session()]).expect("a fit");
    let further = every.clone().thinned_further().expect("a first step").expect("a fit");
    assert!(further.thinning != Thinning::NONE && further.thinning == whole.thinning);
    assert_eq!(further.solution.model, whole.solution.model);
    assert_eq!(further.solution.noise, whole.solution.noise);
    assert_eq!(further.solution.pass.runs, whole.solution.pass.runs);
    // Fits that have gone on are no first step.
    assert!(further.clone().thinned_further().is_none());
    assert!(every.refit_ungated().expect("a fit").thinned_further().is_none());
    assert!(every.extended(&mut [Box::new(TravelTerm)]).expect("a fit").thinned_further().is_none());
}

/// A robot that slides across by a share of its distance.
#[derive(Clone)]
struct SidewaysTerm;

impl ModelTerm for SidewaysTerm {
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "share", unit: "1", prior_sigma: 0.01 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        gradient[0].y_m = interval.increment().distance_m;
    }
}

/// What an effect does to successive measurements is no error that lasts: beside it measurements are thinned
/// no further than their errors need.
#[test]
fn measurements_are_thinned_by_what_is_left_beside_an_effect() {
    let sliding = |autocorrelation: f64| {
        let mut dataset = displacement_dataset(&DISPLACEMENTS, autocorrelation, 3);
        let displacements = dataset.runs.iter_mut().flat_map(|run| &mut run.displacements);
        displacements.for_each(|displacement| displacement.dy_m += 0.02 * displacement.dx_m);
        dataset
    };
    let terms = || -> Vec<Box<dyn ModelTerm>> { vec![Box::new(SidewaysTerm)] };
    let every_s = |fit: &ModelFit<'_>| fit.thinning.every_s;
    let dataset = sliding(0.5);
    let every = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    let with_terms = every.extended(&mut terms()).expect("a fit");
    let beside = every.thinned_beside(&with_terms, &mut terms()).expect("errors last").expect("a fit");
    let alone = every.clone().thinned_further().expect("a first step").expect("a fit");
    // Errors of which half lasts a second are white at 4 s. Rejects a spacing at which the effect is white
    // too, which it is at none.
    assert!(beside.thinning != Thinning::NONE && every_s(&beside) < every_s(&alone), "{:?}", beside.thinning);
    assert!(!beside.columns.iter().any(|column| matches!(column, Column::Term(_))), "the effect is not in the fit");
    assert!(beside.displacements_in_series);
    // Where nothing lasts beside it, nothing is thinned.
    let dataset = sliding(0.0);
    let every = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    let with_terms = every.extended(&mut terms()).expect("a fit");
    assert!(every.thinned_beside(&with_terms, &mut terms()).is_none());
    assert!(every.thinned_further().expect("a first step").expect("a fit").thinning != Thinning::NONE);
}

/// Nearly the same drive, logged several times as often, by angles that are no multiples of anything: rows
/// say their rates, and within each second the wheels turn evenly.
fn logged_finer(dataset: &Dataset, times: usize) -> Dataset {
    let mut finer = dataset.clone();
    for run in &mut finer.runs {
        let WheelLog::Angles(angles) = &run.odometry.wheels else { unreachable!("the helper logs angles") };
        let off_grid = |of: &[f64]| of.iter().map(|at| at + 1e-2 * at.sin()).collect::<Vec<_>>();
        let between = |of: &[f64]| -> Vec<f64> {
            let steps = of.windows(2).flat_map(|pair| {
                (0..times).map(|part| pair[0] + (pair[1] - pair[0]) * part as f64 / times as f64).collect::<Vec<_>>()
            });
            steps.chain(of.last().copied()).collect()
        };
        let (t_s, angles) = (between(&run.odometry.t_s), angles.as_ref().map(|of| between(&off_grid(of))));
        (run.odometry.t_s, run.odometry.wheels) = (t_s.into(), WheelLog::Angles(angles));
    }
    finer
}

/// Adds distance in proportion to the square of an interval's length.
#[derive(Clone)]
struct RowTerm;

impl ModelTerm for RowTerm {
    fn parameters(&self) -> &'static [TermParameter] {
        const MOTION: TermParameter = TermParameter { name: "distance_per_s2", unit: "m/s²", prior_sigma: 1.0 };
        &[MOTION]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        gradient[0] = Pose::new(interval.dt_s * interval.dt_s, 0.0, 0.0);
    }
}

#[test]
fn decimated_rows_of_one_speed_give_what_single_rows_give() {
    // Ten rows a second, measurements every two: five intervals make half a second.
    let finer = logged_finer(&dataset(true), 10);
    let session = [finer.session()];
    // A latency goes by rates within rows, which rows taken together do not have.
    let model = Model { latency_s: 0.0, ..MODEL };
    let mut fit = ModelFit::from_parameters(model, NOISE, &session);
    fit.solution.pass = fit.scan(&mut []);
    let coarse = fit.decimated(&mut [], 0.5).expect("a fifth of the pieces");
    let intervals =
        |fit: &ModelFit<'_>| fit.records.segments.iter().map(|segment| segment.intervals.len()).collect::<Vec<_>>();
    assert_eq!((intervals(&fit), intervals(&coarse)), (vec![120; 2], vec![24; 2]));
    let close = |a: &Pass, b: &Pass| {
        let both = a.runs.iter().zip(&b.runs);
        // Arcs put together from five of a tenth, to rounding. Rejects rows that are put together without
        // what they go across their arc.
        let off = both.map(|(a, b)| (&a.gradient - &b.gradient).norm() / a.gradient.norm()).fold(0.0, f64::max);
        off < 1e-9
    };
    assert!(close(&coarse.scan(&mut []), &fit.scan(&mut [])));
    // Rows of several speeds lead where each of them does: what they go across the arc of their sum is kept.
    assert!(fit.decimated(&mut [], 3.0).is_some());
    // Wheels that turn back, stand or begin are no part of what went before, nor is what comes after a
    // measurement: of twelve rows three go with the one before.
    let longest = Decimated::of(&fit.records, &fit.selections, 3.0).expect("fewer").records;
    assert_eq!(longest.segments.iter().map(|segment| segment.intervals.len()).collect::<Vec<_>>(), [9; 2]);
    assert!(fit.decimated(&mut [], 0.15).is_none(), "nothing to put together");
    assert!(fit.decimated(&mut [], 0.2).is_some(), "no more than half are left");
    // A fit with what goes by single rows is another one by longer ones.
    let mut by_rows: Vec<Box<dyn ModelTerm>> = vec![Box::new(RowTerm)];
    fit.solution.model.term_values = vec![0.01];
    fit.solution.pass = fit.scan(&mut by_rows);
    assert!(fit.decimated(&mut by_rows, 0.5).is_none());
}

#[test]
fn joined_rows_end_as_uncertain_within_a_row_as_the_last_of_them() {
    let mut finer = logged_finer(&dataset(true), 10);
    for run in &mut finer.runs {
        run.truth.iter_mut().for_each(|sample| sample.t_s = (sample.t_s + 0.03).min(11.97));
    }
    let session = [finer.session()];
    let fit = ModelFit::from_parameters(MODEL, NOISE, &session);
    let coarse = Decimated::of(&fit.records, &fit.selections, 0.5).expect("fewer").records;
    let at_measurements = |records: &Records<'_>| {
        let of_segment = |segment: &Segment<'_>| {
            let ends = segment.measurements.iter().map(|measurement| measurement.after).filter(|after| *after > 0);
            ends.map(|after| segment.intervals[after - 1].interpolated_rad2[1]).collect::<Vec<_>>()
        };
        records.segments.iter().map(of_segment).collect::<Vec<_>>()
    };
    let single = at_measurements(&fit.records);
    assert!(single.iter().flatten().any(|variance| variance.left > 0.0));
    assert_eq!(at_measurements(&coarse), single);
}
