//! What the benchmarks share: how their pictures are drawn, a median, what a cancel looks like.

use crate::render::camera::{Up, View};
use crate::render::{Mode, Style};

/// How the benchmarks' pictures are drawn.
pub const STYLE: Style = Style {
    mode: Mode::Shaded,
    view: View { azimuth: 20.0, elevation: 15.0 },
    up: Up::Y,
    size: [512; 2],
    flat: false,
    boundary: false,
    colors: true,
    point_size: None,
};

/// The middle of some numbers, or the mean of the two in the middle; not a number where there is none.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

/// Whether the error is Ctrl-C: the others cost one cell only.
pub fn cancelled(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(atlasfit::Error::Cancelled))
}
