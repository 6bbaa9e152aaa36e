//! Datasets too large for memory: a fit of subsamples that are spread over them, then one scoring step over
//! all, part by part.
//!
//! With the normal equation Σ I, Σ g of everything at the subsamples' estimate θ₀, θ₁ = θ₀ − (Σ I)⁻¹ Σ g is
//! asymptotically as good as the fit of everything, as θ₀ is within O(1/√n): what it misses is of the order
//! of (θ₀ − θ)², and that is watched (Le Cam 1956; van der Vaart 1998, §5.7). The noise, the thinning, and
//! whether the instrument has the extrinsics or a latency are those of the subsamples.

use std::sync::Arc;

use dataset::{Blocks, Dataset, DatasetError, NominalRobot, Session, Warning};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::error::{EstimationError, refuse_wrapped_counters};
use crate::maximum_likelihood::FitSettings;
use crate::model::{Column, Grouping, Instrument, Model};
use crate::model_fit::{ModelFit, unobservable};
use crate::normal_equations::{NormalEquations, total};
use crate::optimizer::{ConvergenceCriterion, pass_settled};
use crate::parts::{Part, over_parts};
use crate::records::Records;
use crate::settings::{COMMON, LARGE_ROWS};
use crate::thinning::Selection;

/// How large datasets were calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct OneStep {
    /// Measurements of all runs.
    #[serde(rename = "looks")]
    pub measurements: usize,
    /// Measurements of the subsamples that were fitted first.
    #[serde(rename = "first_looks")]
    pub first_measurements: usize,
    /// Scoring steps over all measurements: one, unless the first fit was far off.
    pub passes: usize,
}

/// Why large datasets are not calibrated.
#[derive(Debug, thiserror::Error)]
pub enum OneStepError {
    /// They cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// There is no fit.
    #[error(transparent)]
    Estimation(#[from] EstimationError),
}

/// Whether datasets are too large for [`FitSettings::fit`]: they have [`many_rows`], and no map whose
/// distortion is stated.
#[must_use]
pub fn is_large(datasets: &[Blocks]) -> bool {
    // What a map's distortion adds takes all measurements at once.
    datasets.iter().all(|blocks| blocks.header().truth_noise.map.is_none()) && many_rows(datasets)
}

/// Whether datasets have more than [`LARGE_ROWS`], and a measurement in 500 rows at least, so that parts of
/// them say what all do.
#[must_use]
pub fn many_rows(datasets: &[Blocks]) -> bool {
    let (rows, measurements) = rows_and_measurements(datasets);
    rows + measurements > LARGE_ROWS && measurements.saturating_mul(COMMON.max_rows_per_measurement) >= rows
}

/// Rows of the odometry of all runs, and of all that saw them.
#[must_use]
pub fn rows_and_measurements(datasets: &[Blocks]) -> (usize, usize) {
    let of = |blocks: &Blocks, count: fn(&Blocks, usize) -> usize| -> usize {
        (0..blocks.infos().len()).map(|run| count(blocks, run)).sum()
    };
    datasets.iter().fold((0, 0), |(rows, measurements), blocks| {
        (rows + of(blocks, Blocks::rows), measurements + of(blocks, Blocks::seen_rows))
    })
}

/// The normal equation of a part, and what else it gives.
struct PartEquations {
    run: (usize, usize),
    equations: Option<NormalEquations>,
    own: Option<Instrument>,
    measurements: usize,
}

/// The normal equations of all parts at the values of a fit.
struct GatheredParts {
    parts: Vec<NormalEquations>,
    measurements: usize,
}

/// The fit of datasets of any size; its records have the runs' ids and no measurements.
#[derive(Debug, Clone)]
pub struct LargeFit {
    /// The fit.
    pub fit: ModelFit<'static>,
    /// How it was made.
    pub one_step: OneStep,
    /// The robot of the first dataset.
    pub robot: NominalRobot,
    /// The datasets' names.
    pub names: Vec<String>,
}

/// Fits datasets of any size in the memory of a part of them; `notice` gets each dataset's index and
/// warnings. Where [`is_large`] is false, [`FitSettings::fit`] is better: it bases every choice on all
/// measurements.
///
/// # Errors
/// [`OneStepError`] when the datasets cannot be read, hold no measurements, or the fit of the subsamples
/// diverges.
pub fn fit_large(
    settings: FitSettings,
    datasets: &mut [Blocks],
    mut notice: impl FnMut(usize, &Warning),
) -> Result<LargeFit, OneStepError> {
    let subsamples = subsamples(datasets)?;
    let sessions: Vec<Session<'_>> = subsamples.iter().map(Dataset::session).collect();
    let mut first =
        settings.fit_until(ConvergenceCriterion::NoiseShare(COMMON.preliminary_noise_tolerance), &sessions)?;
    first.ends = ConvergenceCriterion::NoiseShare(COMMON.subsample_noise_tolerance);
    first.refit(Some(first.current_values()), &mut [])?;
    let first_measurements = first.records.measurements();
    let part_blocks = part_blocks(&first, datasets);
    let robot = *sessions.first().ok_or(EstimationError::NoSession)?.robot;
    let names: Vec<String> = sessions.iter().map(|session| session.name.to_owned()).collect();
    let ids = datasets.iter().map(|blocks| blocks.infos().iter().map(|info| info.id.clone()).collect()).collect();
    first.by_systematic_errors = first.covariance_by_systematic_errors();
    // The subsamples are needed no more.
    let clocks = first.records.clocks.clone();
    let mut found = first.with_records(Records { ids, clocks, ..Records::nothing() });
    let mut passes = 0;
    loop {
        passes += 1;
        let GatheredParts { parts, measurements } = found.gather(datasets, part_blocks, &mut notice)?;
        let is_near = found.step_over(parts)?;
        if is_near || passes == COMMON.max_scoring_steps {
            found.solution.converged &= is_near;
            return Ok(LargeFit {
                fit: found,
                one_step: OneStep { measurements, first_measurements, passes },
                robot,
                names,
            });
        }
    }
}

/// The subsamples: a dataset of them from each dataset.
fn subsamples(datasets: &mut [Blocks]) -> Result<Vec<Dataset>, DatasetError> {
    let (rows, measurements) = rows_and_measurements(datasets);
    let wanted =
        (COMMON.subsample_measurements.saturating_mul(rows) / measurements.max(1)).min(COMMON.max_subsample_rows);
    // A subsample is in the middle of each stride of rows.
    let stride = (rows / COMMON.subsamples).max(1);
    let within = stride.saturating_sub(wanted / COMMON.subsamples) / 2..(stride + wanted / COMMON.subsamples) / 2;
    let mut before = 0;
    let mut subsamples = Vec::with_capacity(datasets.len());
    for blocks in datasets {
        let mut subsample = blocks.header().clone();
        for run in 0..blocks.infos().len() {
            let count = blocks.blocks(run);
            let start = before;
            before += blocks.rows(run);
            let is_taken = |block: usize| within.contains(&((start + block * Blocks::ROWS) % stride));
            let mut block = 0;
            while block < count {
                let end = block + (block..count).take_while(|block| is_taken(*block)).count();
                if end > block {
                    subsample.runs.extend(blocks.read(run, block..end)?.dataset.runs);
                }
                block = end + 1;
            }
        }
        subsamples.push(subsample);
    }
    Ok(subsamples)
}

/// How many blocks of a run are held at a time.
fn part_blocks(first: &ModelFit<'_>, datasets: &[Blocks]) -> usize {
    let (rows, measurements) = rows_and_measurements(datasets);
    let propagations: usize =
        first.selections.first().map_or(0, |selection| selection.propagations.iter().map(Vec::len).sum::<usize>());
    let measurements_per_propagation = first.records.measurements().div_ceil(propagations.max(1));
    let wanted_measurements =
        COMMON.min_part_measurements.max(COMMON.min_part_propagations * measurements_per_propagation);
    COMMON
        .min_part_blocks
        .max(wanted_measurements.saturating_mul(rows.div_ceil(measurements.max(1))).div_ceil(Blocks::ROWS))
}

impl ModelFit<'_> {
    /// The normal equations of all parts at the values in force. This thread reads, others compute; sums are
    /// taken in the order of the parts.
    fn gather(
        &mut self,
        datasets: &mut [Blocks],
        part_blocks: usize,
        notice: &mut impl FnMut(usize, &Warning),
    ) -> Result<GatheredParts, OneStepError> {
        let is_grouped_by_run = self.solution.model.own.as_ref().is_some_and(|own| own.grouping == Grouping::Run);
        let parts: Vec<Part> = datasets
            .iter()
            .enumerate()
            .flat_map(|(dataset, blocks)| {
                (0..blocks.infos().len()).map(move |run| ((dataset, run), blocks.blocks(run)))
            })
            .flat_map(|(run, count)| {
                // The instrument of a run is found from all of it.
                let part_blocks = if is_grouped_by_run { count } else { part_blocks };
                Part::of_run(run, count, part_blocks)
            })
            .collect();
        let this = &*self;
        let part_equations: Vec<PartEquations> = over_parts(
            datasets,
            &parts,
            |part, dataset| Ok::<_, OneStepError>(this.part_equations(part.run, &dataset)?),
            notice,
        )?;
        let measurements = part_equations.iter().map(|part| part.measurements).sum();
        let mut unused = Vec::new();
        for of_run in part_equations.chunk_by(|a, b| a.run == b.run) {
            if of_run.iter().all(|part| part.equations.is_none()) {
                unused.push(of_run[0].run);
            }
        }
        Arc::make_mut(&mut self.records).unused = unused;
        if let Some(own) = &mut self.solution.model.own {
            let found = part_equations.iter().filter_map(|part| Some((own.grouping.group(part.run), part.own?)));
            own.of.extend(found);
        }
        Ok(GatheredParts {
            parts: part_equations.into_iter().filter_map(|part| part.equations).collect(),
            measurements,
        })
    }

    /// The normal equation of a part at the values in force.
    fn part_equations(&self, run: (usize, usize), part: &Dataset) -> Result<PartEquations, EstimationError> {
        let sessions = [part.session()];
        refuse_wrapped_counters(&sessions)?;
        let clock = self.records.clocks.get(run.0).cloned().unwrap_or_default();
        let records = Records::relative_to(&sessions, self.prior.measurement_sigma(), &[clock], Some(&self.start))
            .belonging_to(run);
        if records.segments.is_empty() && !records.has_partial() {
            return Ok(PartEquations { run, equations: None, own: None, measurements: 0 });
        }
        let selections = Selection::of(&records, self.thinning, &self.start);
        let (mut model, noise) = (self.solution.model.clone(), &self.solution.noise);
        let is_grouped_by_run = model.own.as_ref().is_some_and(|own| own.grouping == Grouping::Run);
        if is_grouped_by_run {
            model = pass_settled(&records, &selections, model, noise)?.0;
        }
        let instrument = model.instrument(run);
        let Instrument { body_from_sensor, latency_s } = instrument;
        // The groups' own columns are still in the normal equation: they are eliminated from a group's sum.
        let model = Model { body_from_sensor, latency_s, own: None, ..model };
        let (_, pass) = pass_settled(&records, &selections, model, noise)?;
        let own = is_grouped_by_run.then_some(instrument);
        Ok(PartEquations { run, equations: total(&pass.runs), own, measurements: records.measurements() })
    }

    /// Takes the scoring step of the parts' sum. Returns whether it was small enough for one step to be
    /// efficient.
    pub(crate) fn step_over(&mut self, mut parts: Vec<NormalEquations>) -> Result<bool, EstimationError> {
        let own = self.solution.model.own.clone();
        let responses = own.map_or_else(Vec::new, |own| own.eliminate(&mut parts, &self.solution.model));
        let Some(sum) = total(&parts) else { return Err(EstimationError::NoMeasurements) };
        let information = sum.of(&self.columns);
        self.unobservable = unobservable(&information.matrix);
        let free = self.free_basis();
        let (step, covariance) = information.along(&free).solve().ok_or(EstimationError::Diverges)?;
        let (step, covariance) = (&free * step, &free * covariance * free.transpose());
        let mut moved = DVector::zeros(sum.gradient.len());
        let mut is_near = true;
        for (row, column) in self.columns.iter().enumerate() {
            moved[column.index()] = step[row];
            self.solution.model.advance(*column, step[row]);
            let is_nonlinear = Column::GEOMETRY.contains(column) || *column == Column::SensorTheta;
            is_near &= !is_nonlinear || step[row].powi(2) <= COMMON.one_step_tolerance * covariance[(row, row)].sqrt();
        }
        responses
            .iter()
            .for_each(|response| self.solution.model.advance_own(response.group, &response.step(&self.columns, &step)));
        // To first order the scores are those at the new values.
        for part in &mut parts {
            let by = &part.information * &moved;
            part.chi_square += 2.0 * part.gradient.dot(&moved) + by.dot(&moved);
            part.gradient += by;
        }
        self.solution.pass.runs = parts.chunk_by(|a, b| a.run == b.run).filter_map(total).collect();
        self.solution.pass.own = responses;
        self.parts = parts;
        Ok(is_near)
    }
}

#[cfg(test)]
mod tests {
    use dataset::{Existing, write};
    use kinematics::{Pose, Wheels};

    use super::*;
    use crate::GroupExtrinsics;
    use crate::tests::{BODY_FROM_SENSOR, MODEL, NOISE, dataset_of};

    fn gathered(test: &str, dataset: &Dataset, fit: &mut ModelFit<'_>, part_blocks: usize) -> GatheredParts {
        let folder = std::env::temp_dir().join(format!("yair-{test}-{}", std::process::id()));
        write(dataset, &folder, Existing::ReplaceDataset).expect("written");
        let mut blocks = [Blocks::open(&folder).expect("readable").expect("runs stand together")];
        let found = fit.gather(&mut blocks, part_blocks, &mut |_, _| {}).expect("readable");
        std::fs::remove_dir_all(folder).expect("removed");
        found
    }

    #[test]
    fn parts_say_what_runs_say_and_runs_without_measurements_are_unused() {
        let mut dataset = dataset_of(4, true);
        dataset.runs[1].truth.truncate(1);
        dataset.runs[3].truth.truncate(1);
        let mut fit = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
        let whole = fit.scan(&mut []).runs;
        let GatheredParts { parts, measurements } = gathered("unused", &dataset, &mut fit, 1);
        // Seven of each run that has two. Rejects runs of which some part is unused, and runs that are used.
        assert_eq!((measurements, &fit.records.unused), (14, &vec![(0, 1), (0, 3)]));
        assert_eq!(parts.iter().map(|part| part.run).collect::<Vec<_>>(), [(0, 0), (0, 2)]);
        for (part, whole) in parts.iter().zip(&whole) {
            assert_eq!((part.run, part.count), (whole.run, whole.count));
            // Files have all digits; sums are taken in one order.
            assert!((&part.gradient - &whole.gradient).amax() < 1e-9 * whole.gradient.amax(), "{part:?} {whole:?}");
        }
    }

    #[test]
    fn a_run_with_an_instrument_of_its_own_is_one_part_however_many_blocks_it_has() {
        // A block of 1024 rows, and one of the others.
        let mut dataset = dataset_of(1, true);
        let run = &mut dataset.runs[0];
        let turned = |row: u32| f64::from(row) + 0.3 * (0.11 * f64::from(row)).sin();
        let angles = |by: f64| (0..2100).map(|row| by * turned(row)).collect::<Vec<f64>>();
        run.odometry.t_s = (0..2100).map(|row| 0.1 * f64::from(row)).collect();
        run.odometry.wheels = dataset::WheelLog::Angles(Wheels { left: angles(0.1), right: angles(0.11) });
        let sample = |row: u32| dataset::TruthSample::new(0.1 * f64::from(row), 0.0, 0.0, Some(0.0));
        run.truth = (0..2100).step_by(50).map(sample).collect();
        let own = GroupExtrinsics::new(Grouping::Run, vec![Column::SensorX]);
        let by_session = GroupExtrinsics::new(Grouping::Session, vec![Column::SensorX]);
        let parts = |own: Option<GroupExtrinsics>| {
            let mut fit = ModelFit::from_parameters(Model { own, ..MODEL }, NOISE, &[dataset.session()]);
            fit.ungated = true;
            gathered("blocks", &dataset, &mut fit, 1).parts.len()
        };
        assert_eq!([parts(None), parts(Some(by_session)), parts(Some(own))], [2, 2, 1]);
    }

    #[test]
    fn runs_with_instruments_of_their_own_have_them_from_all_of_their_blocks() {
        let dataset = dataset_of(2, true);
        let own = GroupExtrinsics::new(Grouping::Run, vec![Column::SensorX, Column::SensorY]);
        let common =
            Model { body_from_sensor: Pose { x_m: 0.0, y_m: 0.0, ..BODY_FROM_SENSOR }, own: Some(own), ..MODEL };
        let mut fit = ModelFit::from_parameters(common, NOISE, &[dataset.session()]);
        let parts = gathered("own", &dataset, &mut fit, 1).parts;
        assert_eq!(parts.len(), 2);
        let found = fit.solution.model.own.expect("own").of;
        assert_eq!(found.keys().copied().collect::<Vec<_>>(), [(0, 0), (0, 1)]);
        for instrument in found.values() {
            let Pose { x_m, y_m, .. } = instrument.body_from_sensor;
            // Measurements of 3 mm over turns of a radian. Rejects the common instrument, 32 and 19 mm off.
            assert!(
                (x_m - BODY_FROM_SENSOR.x_m).abs() < 0.01 && (y_m - BODY_FROM_SENSOR.y_m).abs() < 0.01,
                "{x_m} {y_m}"
            );
        }
    }
}
