//! Runs without noise under the likelihood of the true one: what a model leaves of them.

use dataset::{Dataset, Session};
use estimation::{
    Model, NormalEquations, OutlierGate, Pass, Records, Segment, Selection, Thinning, pass_with_innovations, total,
};
use model_term::ModelTerm;

use super::true_noise::TrueNoise;

/// A pass over noise-free runs.
pub(crate) struct NoiseFreePass {
    pub(crate) total: NormalEquations,
    /// Whitened innovations, each with its run.
    pub(crate) z: Vec<((usize, usize), f64)>,
    /// χ² that start headings take up which were not measured.
    pub(crate) by_headings: f64,
}

/// Noise-free runs.
pub(crate) struct NoiseFree<'d> {
    records: Records<'d>,
    /// Start headings of segments, radians: those that fit best, where none is measured.
    headings: Vec<f64>,
}

/// Start headings are found by so many passes at the most, or until none moves by more.
const HEADING_PASSES: usize = 4;
const HEADING_TOLERANCE_RAD: f64 = 1e-9;

impl<'d> NoiseFree<'d> {
    /// Runs with headings of zero where none is measured.
    pub(crate) fn of(datasets: &'d [Dataset]) -> Self {
        let records = records(datasets);
        Self { headings: vec![0.0; records.segments.len()], records }
    }

    /// The same with one start heading, radians, where none is measured.
    pub(crate) fn starting_at(self, heading_rad: f64) -> Self {
        Self { headings: vec![heading_rad; self.headings.len()], ..self }
    }

    /// The same with the headings that fit best under a model, from those that they have on.
    pub(crate) fn with_best_headings(
        mut self,
        model: &Model,
        noise: TrueNoise,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Self {
        if !self.records.segments.iter().any(Segment::has_free_heading) {
            return self;
        }
        for _ in 0..HEADING_PASSES {
            let pass = self.pass(model, noise, terms);
            let steps: Vec<(usize, f64)> = pass.heading_steps().collect();
            steps.iter().for_each(|(segment, step_rad)| self.headings[*segment] += step_rad);
            if steps.iter().all(|(_, step_rad)| step_rad.abs() <= HEADING_TOLERANCE_RAD) {
                break;
            }
        }
        self
    }

    /// Other runs with the headings of these.
    pub(crate) fn beside<'o>(&self, datasets: &'o [Dataset]) -> Option<NoiseFree<'o>> {
        let records = records(datasets);
        (records.segments.len() == self.headings.len()).then(|| NoiseFree { records, headings: self.headings.clone() })
    }

    fn pass(&self, model: &Model, noise: TrueNoise, terms: &mut [Box<dyn ModelTerm>]) -> Pass {
        let selections = Selection::of(&self.records, Thinning::NONE, model);
        pass_with_innovations(
            &self.records,
            &selections,
            model,
            &noise.noise(),
            &self.headings,
            terms,
            OutlierGate::Off,
        )
    }

    pub(crate) fn measurement(
        &self,
        model: &Model,
        noise: TrueNoise,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Option<NoiseFreePass> {
        let pass = self.pass(model, noise, terms);
        let total = total(&pass.runs)?;
        let run = |segment: usize| self.records.segments[segment].run;
        let z = pass.innovations.iter().flatten().map(|found| (run(found.segment), found.z)).collect();
        Some(NoiseFreePass { total, z, by_headings: pass.chi_square_of_headings() })
    }
}

fn records(datasets: &[Dataset]) -> Records<'_> {
    let sessions: Vec<Session<'_>> = datasets.iter().map(Dataset::session).collect();
    Records::of(&sessions)
}
