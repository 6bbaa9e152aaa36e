//! The statistics of table 1: what a statistics package prints of a sample.

use serde::Serialize;

/// A sample in nine numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SampleShape {
    /// How many values ("frecuencia").
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Variance (n−1).
    pub variance: f64,
    /// Standard deviation.
    pub std: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Largest minus smallest.
    pub range: f64,
    /// Standardized skewness: G₁/√(6/n).
    pub skewness_z: f64,
    /// Standardized kurtosis: G₂/√(24/n), 0 for a normal sample.
    pub kurtosis_z: f64,
}

/// A row of table 1: its name and how it is read off a shape.
pub type StatisticRow = (&'static str, fn(&SampleShape) -> f64);

/// The rows of table 1, in its order.
pub const ROWS: [StatisticRow; 9] = [
    ("count", |shape| shape.count as f64),
    ("mean", |shape| shape.mean),
    ("variance", |shape| shape.variance),
    ("std", |shape| shape.std),
    ("min", |shape| shape.min),
    ("max", |shape| shape.max),
    ("range", |shape| shape.range),
    ("standardized skewness", |shape| shape.skewness_z),
    ("standardized kurtosis", |shape| shape.kurtosis_z),
];

impl SampleShape {
    /// The shape of a sample of at least four values; `None` for fewer, or when all are equal.
    ///
    /// Skewness and kurtosis are the bias-corrected G₁ and G₂ (Joanes & Gill 1998) that statistics packages
    /// print, divided by the standard errors √(6/n) and √(24/n) of a large normal sample.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len();
        if count < 4 {
            return None;
        }
        let n = count as f64;
        let mean = values.iter().sum::<f64>() / n;
        let central = |power: i32| values.iter().map(|value| (value - mean).powi(power)).sum::<f64>() / n;
        let (m2, m3, m4) = (central(2), central(3), central(4));
        if m2 <= 0.0 {
            return None;
        }
        let (g1, g2) = (m3 / m2.powf(1.5), m4 / (m2 * m2) - 3.0);
        let skewness = g1 * (n * (n - 1.0)).sqrt() / (n - 2.0);
        let kurtosis = (n - 1.0) / ((n - 2.0) * (n - 3.0)) * ((n + 1.0) * g2 + 6.0);
        let variance = m2 * n / (n - 1.0);
        let min = values.iter().copied().fold(f64::INFINITY, f64::min);
        let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some(Self {
            count,
            mean,
            variance,
            std: variance.sqrt(),
            min,
            max,
            range: max - min,
            skewness_z: skewness / (6.0 / n).sqrt(),
            kurtosis_z: kurtosis / (24.0 / n).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_sample_has_its_textbook_shape() {
        // 1..5: mean 3, variance 2.5, G1 = 0, G2 = −1.2 (the uniform's).
        let shape = SampleShape::of(&[1.0, 2.0, 3.0, 4.0, 5.0]).expect("five values");
        assert_eq!((shape.mean, shape.variance, shape.min, shape.max, shape.range), (3.0, 2.5, 1.0, 5.0, 4.0));
        assert!(shape.skewness_z.abs() < 1e-12);
        assert!((shape.kurtosis_z + 1.2 / (24.0_f64 / 5.0).sqrt()).abs() < 1e-12);
        assert_eq!(SampleShape::of(&[1.0, 2.0, 3.0]), None);
        assert_eq!(SampleShape::of(&[2.0; 9]), None);
    }

    #[test]
    fn paper_table_1_agrees_with_itself() {
        for shape in [super::super::published::TABLE_1.left, super::super::published::TABLE_1.right] {
            // Printed to three digits.
            assert!((shape.std * shape.std / shape.variance - 1.0).abs() < 5e-3);
            assert!((shape.max - shape.min - shape.range).abs() < 1e-12);
        }
    }
}
