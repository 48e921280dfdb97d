//! The losses of a training as a picture.

use crate::plot::{Axis, Figure, Legend, Mark, Panel};
use atlasfit_learn::train::State;

/// One panel: decimal logarithms of Chamfer distances over epochs; dashed, the constant answer.
pub fn figure(state: &State, constant: f64) -> Figure {
    let epochs = &state.epochs;
    let curve = |of: &dyn Fn(usize) -> Option<f64>| -> Vec<[f64; 2]> {
        let at = |i: usize| Some([(i + 1) as f64, of(i).filter(|x| *x > 0.0)?.log10()]);
        (0..epochs.len()).filter_map(at).collect()
    };
    let mut marks = vec![
        Mark::line("training", 6, curve(&|i| Some(epochs[i].chamfer))),
        Mark::line("validation, points", 0, curve(&|i| epochs[i].from_points)),
        Mark::line("validation, image", 1, curve(&|i| epochs[i].from_image)),
        Mark::dashed("constant answer", 2, curve(&|_| Some(constant))),
    ];
    marks.retain(|m| !m.shape.points().is_empty());
    let heights = || marks.iter().flat_map(|m| m.shape.points()).map(|p| p[1]);
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let axes = [
        Axis::linear("epoch", [1.0, epochs.len().max(2) as f64]),
        Axis::logarithmic("Chamfer distance", [(low - 0.05).floor(), (high + 0.05).ceil()]),
    ];
    let panel = Panel { title: String::new(), axes: Some(axes), legend: Legend::UpperRight, marks };
    Figure { title: "Losses of the training", rows: vec![vec![panel]], row: [860, 480] }
}
