//! Record faults that an instrument does not tell from a hidden one: what undoes these leaves no more.

use dataset::Dataset;
use effects::{CATALOGUE, Hypothesis, hypothesis};
use estimation::Model;
use kinematics::DriveGeometry;

use crate::oracle::misfit_either_way;
use crate::power::DISCRIMINATION_LEVEL;
use crate::true_noise::TrueNoise;

/// The other record faults whose correction of noise-free runs with a hidden one leaves so little more than
/// its own that the test of two candidates does not discriminate them. To an instrument without headings a
/// robot whose counters are swapped is one that drives backward with both reversed.
pub(crate) fn fault_aliases(
    hidden: &str,
    datasets: &[Dataset],
    truth: &DriveGeometry,
    noise: TrueNoise,
) -> Vec<String> {
    let model = Model::of(truth, 0);
    let left_by = |id: &str| -> Option<f64> {
        let Hypothesis::Records(corrections) = hypothesis(id)? else { return None };
        let left_of = |dataset: &Dataset| {
            let each = corrections(dataset).into_iter();
            let left = each.map(|correction| 2.0 * misfit_either_way(&[correction.records], &model, noise));
            left.fold(f64::INFINITY, f64::min)
        };
        Some(datasets.iter().map(left_of).sum())
    };
    let Some(own) = left_by(hidden) else { return Vec::new() };
    let undoes = |id: &&str| left_by(id).is_some_and(|left| left - own < DISCRIMINATION_LEVEL);
    CATALOGUE.iter().copied().filter(|id| *id != hidden).filter(undoes).map(str::to_owned).collect()
}
