//! Two builds on the same logs: how often they differ, in whose favour, and what chance does.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::measure::Measure;

/// One measure of two builds, on the logs that both scored.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Paired {
    /// The measure's key.
    pub measure: &'static str,
    /// Logs of which both builds have a score.
    pub logs: usize,
    /// Pooled, of the old and the new build.
    pub pooled: [f64; 2],
    /// Logs of which only one build has a score: only the old, only the new.
    pub unpaired: [usize; 2],
    /// Of a share: logs where it holds of the old build alone, and of the new one alone. Else: logs whose
    /// score is higher of the old build, and of the new one.
    pub discordant: [usize; 2],
    /// 95 % interval of the new build's pooled value less the old one's; Agresti and Min 2005 of a share, the
    /// bootstrap's percentiles else.
    pub difference: [f64; 2],
    /// Probability of such a difference where builds are equal: McNemar's exact test of a share (McNemar
    /// 1947), else random signs of the logs' differences.
    pub p_value: f64,
    /// What the rule of acceptance says; `None` where nothing is held to it.
    pub verdict: Option<Verdict>,
}

/// What the rule of acceptance says of a measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Better by more than chance.
    Won,
    /// No worse than the margin.
    Held,
    /// Worse than the margin.
    Lost,
}

/// Draws of random signs and of the bootstrap: a p-value of 0.01 is known to a tenth.
const DRAWS: usize = 10_000;

/// A difference counts as won, and a loss as more than chance, below this.
pub(crate) const LEVEL: f64 = 0.05;

/// Two-sided 95 % of a normal variable.
const QUANTILE: f64 = 1.96;

impl Paired {
    /// A measure of the scores of two builds, log by log; `None` where no log has both.
    #[must_use]
    pub fn of(measure: &Measure, scores: &[[Option<f64>; 2]]) -> Option<Self> {
        let both: Vec<[f64; 2]> = scores.iter().filter_map(|[old, new]| Some([(*old)?, (*new)?])).collect();
        if both.is_empty() {
            return None;
        }
        let only = |side: usize| scores.iter().filter(|one| one[side].is_some() && one[1 - side].is_none()).count();
        let count = |side: usize| both.iter().filter(|one| one[side] > one[1 - side]).count();
        let discordant = [count(0), count(1)];
        let pooled = [0, 1].map(|side| measure.pooled(mean(both.iter().map(|one| one[side]))));
        let (difference, p_value) = if measure.is_share() {
            (difference_of_shares(discordant, both.len()), mcnemar(discordant))
        } else {
            resampled(measure, &both)
        };
        let mut paired = Self {
            measure: measure.id,
            logs: both.len(),
            pooled,
            unpaired: [only(0), only(1)],
            discordant,
            difference,
            p_value,
            verdict: None,
        };
        paired.verdict = measure.margin.map(|margin| paired.verdict(measure.is_more_better, margin));
        Some(paired)
    }

    fn verdict(&self, is_more_better: bool, margin: f64) -> Verdict {
        let better = if is_more_better { 1.0 } else { -1.0 } * (self.pooled[1] - self.pooled[0]);
        match better {
            worse if worse < -margin => Verdict::Lost,
            better if better > 0.0 && self.p_value < LEVEL => Verdict::Won,
            _ => Verdict::Held,
        }
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// McNemar's exact test: each discordant log is of either build with even chance.
#[must_use]
pub fn mcnemar(discordant: [usize; 2]) -> f64 {
    let (least, all) = (discordant[0].min(discordant[1]) as u64, (discordant[0] + discordant[1]) as u64);
    Binomial::new(0.5, all).map_or(1.0, |binomial| (2.0 * binomial.cdf(least)).min(1.0))
}

/// Wald's interval of paired shares with half a log more in each of the four cells (Agresti and Min 2005).
fn difference_of_shares([old, new]: [usize; 2], logs: usize) -> [f64; 2] {
    let (n, b, c) = (logs as f64 + 2.0, old as f64 + 0.5, new as f64 + 0.5);
    let (mean, variance) = ((c - b) / n, (b + c - (c - b).powi(2) / n) / (n * n));
    let half = QUANTILE * variance.sqrt();
    [mean - half, mean + half]
}

/// The bootstrap's interval, and the p-value of random signs; the same draws for the same logs.
fn resampled(measure: &Measure, both: &[[f64; 2]]) -> ([f64; 2], f64) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(both.len() as u64);
    let observed = mean(both.iter().map(|[old, new]| new - old));
    let mut differences = Vec::with_capacity(DRAWS);
    let mut beyond = 1;
    for _ in 0..DRAWS {
        let (mut sums, mut signed) = ([0.0; 2], 0.0);
        for [old, new] in both {
            let drawn = both[random.random_range(0..both.len())];
            sums = [sums[0] + drawn[0], sums[1] + drawn[1]];
            signed += if random.random::<bool>() { new - old } else { old - new };
        }
        let pooled = sums.map(|sum| measure.pooled(sum / both.len() as f64));
        differences.push(pooled[1] - pooled[0]);
        // Equal sums of other orders differ by rounding alone.
        beyond += usize::from((signed / both.len() as f64).abs() >= observed.abs() * (1.0 - 1e-9));
    }
    differences.sort_by(f64::total_cmp);
    let percentile = |share: f64| differences[(share * (DRAWS - 1) as f64).round() as usize];
    ([percentile(0.025), percentile(0.975)], beyond as f64 / (DRAWS + 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::MEASURES;

    fn measure(id: &str) -> &'static Measure {
        MEASURES.iter().find(|measure| measure.id == id).expect("a measure")
    }

    /// McNemar's exact p of 2 against 10: 2 Σ_{k≤2} C(12,k)/2¹² = 158/4096.
    #[test]
    fn mcnemar_is_the_binomial_of_the_discordant() {
        assert!((mcnemar([2, 10]) - 158.0 / 4096.0).abs() < 1e-12);
        assert!((mcnemar([0, 0]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_build_beside_itself_differs_in_nothing() {
        for id in ["detected", "rms_z", "gain"] {
            let scores: Vec<_> = (0..40).map(|k| [Some(f64::from(k % 2)); 2]).collect();
            let paired = Paired::of(measure(id), &scores).expect("logs");
            assert_eq!((paired.discordant, paired.p_value.total_cmp(&1.0)), ([0, 0], std::cmp::Ordering::Equal));
            assert!(paired.difference[0] <= 0.0 && paired.difference[1] >= 0.0);
            assert_ne!(paired.verdict, Some(Verdict::Lost));
        }
    }

    /// Nine of a hundred plain causes are found no more: 9 points, p = 2/2⁹.
    #[test]
    fn what_is_lost_beyond_the_margin_is_said() {
        let scores: Vec<_> = (0..100).map(|k| [Some(1.0), Some(f64::from(u8::from(k >= 9)))]).collect();
        let paired = Paired::of(measure("detected"), &scores).expect("logs");
        assert_eq!((paired.discordant, paired.verdict), ([9, 0], Some(Verdict::Lost)));
        assert!((paired.p_value - 2.0 / 512.0).abs() < 1e-12);
        assert!(paired.difference[1] < 0.0, "{paired:?}");
        // One of two hundred is within the margin.
        let scores: Vec<_> = (0..200).map(|k| [Some(1.0), Some(f64::from(u8::from(k >= 1)))]).collect();
        assert_eq!(Paired::of(measure("detected"), &scores).expect("logs").verdict, Some(Verdict::Held));
    }

    /// Random signs reject a shift of all logs, and no exchange of logs.
    #[test]
    fn random_signs_tell_a_shift_from_an_exchange() {
        let shifted: Vec<_> = (0..30).map(|k| [Some(f64::from(k)), Some(f64::from(k) + 0.3)]).collect();
        assert!(Paired::of(measure("gain"), &shifted).expect("logs").p_value < 1e-3);
        let exchanged: Vec<_> = (0..30).map(|k| [Some(f64::from(k % 2)), Some(f64::from((k + 1) % 2))]).collect();
        assert!(Paired::of(measure("gain"), &exchanged).expect("logs").p_value > 0.9);
    }
}
