//! What rounding to multiples of a quantum errs by: q²/12 (Widrow & Kollár 2008).

/// Variance of what is rounded to multiples of a quantum: it errs by up to half of it, alike everywhere.
pub(crate) const fn variance_of_rounding(quantum: f64) -> f64 {
    quantum * quantum / 12.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A thousand angles within a count, each as likely: what rounding takes from them has this mean square.
    #[test]
    fn rounding_errs_by_the_mean_square_of_what_it_takes() {
        let (quantum, count) = (0.02_f64, 1000);
        let errors = (0..count).map(|k| {
            let angle = quantum * (f64::from(k) + 0.5) / f64::from(count);
            angle - quantum * (angle / quantum).round()
        });
        let mean_square = errors.map(|error| error * error).sum::<f64>() / f64::from(count);
        // The sum over thousand places is short of the integral by a millionth.
        assert!((variance_of_rounding(quantum) / mean_square - 1.0).abs() < 2e-6, "{mean_square}");
    }
}
