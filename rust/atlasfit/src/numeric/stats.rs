//! Order statistics.

/// The median of positive values; 0 for none.
///
/// ```
/// assert_eq!(atlasfit::numeric::stats::median(&mut [3.0, 1.0, 2.0]), 2.0);
/// ```
#[must_use]
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let mid = values.len() / 2;
    *values.select_nth_unstable_by(mid, f64::total_cmp).1
}

/// The value at which half of the weights is reached, of (value, weight); 0 for none. Sorts them.
#[must_use]
pub(crate) fn weighted_median(values: &mut [(f64, f64)]) -> f64 {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|v| v.1).sum::<f64>();
    let mut sum = 0.0;
    let reached = values.iter().find(|v| {
        sum += v.1;
        sum >= half
    });
    reached.map_or(0.0, |v| v.0)
}
