//! Robust weights: how much a residual counts when some of the data belong to something else.

/// Redescending weights reach zero at this many standard deviations (Tukey's biweight; 4.7 gives 95 %
/// efficiency for Gaussian noise, less would tell near sheets apart better but waste data).
pub const TUKEY: f64 = 4.0;

/// What a point costs, in nats, at so many standard deviations: no more than a stray.
///
/// ```
/// use atlasfit::numeric::robust::cost;
/// assert_eq!([1.0, -2.0, 4.0, 9.0].map(cost), [0.5, 2.0, 8.0, 8.0]);
/// ```
#[must_use]
pub fn cost(off: f64) -> f64 {
    0.5 * (off * off).min(TUKEY * TUKEY)
}

/// Tukey's biweight of a residual.
///
/// ```
/// use atlasfit::numeric::robust::tukey;
/// assert_eq!([0.0, 1.0, 2.0].map(|r| tukey(r, 2.0)), [1.0, 0.5625, 0.0]);
/// ```
#[inline]
#[must_use]
pub fn tukey(residual: f64, limit: f64) -> f64 {
    let t = residual / limit;
    let t = 1.0 - t * t;
    if t > 0.0 { t * t } else { 0.0 }
}
