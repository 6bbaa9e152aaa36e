//! Values in the order of their size.

/// The value at ⌊share · n⌋ in order, counted from 0: a share of the others lies below it. `None` of none.
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let at = (share * values.len() as f64) as usize;
    (at < values.len()).then(|| *values.select_nth_unstable_by(at, f64::total_cmp).1)
}

/// The middle one, the upper of an even number. `None` of none.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_the_value_below_which_its_share_lies() {
        let values: Vec<f64> = (0..10).rev().map(f64::from).collect();
        assert_eq!(
            [0.0, 0.25, 0.9, 1.0].map(|share| quantile(values.clone(), share)),
            [Some(0.0), Some(2.0), Some(9.0), None]
        );
        assert_eq!((median(values), median([2.0, 1.0]), median([])), (Some(5.0), Some(2.0), None));
    }
}
