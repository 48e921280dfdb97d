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
