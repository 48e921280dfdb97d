//! Where a training stands: its epochs in numbers.

use serde::{Deserialize, Serialize};
use std::fmt::Write as _;

/// One epoch in numbers; Chamfer distances are squared lengths of the normalised frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Mean Chamfer distance over the batches, while they were trained on.
    pub chamfer: f64,
    /// Mean stretch over the batches, before its weight.
    pub stretch: f64,
    /// Mean Chamfer distance of the validation shapes from their points; none without that encoder.
    pub from_points: Option<f64>,
    /// The same from one picture of each.
    pub from_image: Option<f64>,
    /// Learning rate.
    pub rate: f64,
}

impl Epoch {
    /// What the best epoch is chosen by: the mean over the encoders.
    #[must_use]
    pub fn validation(&self) -> f64 {
        let both: Vec<f64> = self.from_points.into_iter().chain(self.from_image).collect();
        both.iter().sum::<f64>() / both.len().max(1) as f64
    }
}

/// Where a training stands.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct State {
    /// All epochs so far.
    pub epochs: Vec<Epoch>,
}

impl State {
    /// The epoch with the lowest validation, from 0.
    #[must_use]
    pub fn best(&self) -> Option<usize> {
        let by = |i: &usize| self.epochs[*i].validation();
        (0..self.epochs.len()).min_by(|a, b| by(a).total_cmp(&by(b)))
    }

    /// The log: one line per epoch.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = "epoch,chamfer,stretch,validation_points,validation_image,rate\n".to_owned();
        let cell = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.6e}"));
        for (i, e) in self.epochs.iter().enumerate() {
            let _ = writeln!(
                text,
                "{},{:.6e},{:.6e},{},{},{:e}",
                i + 1,
                e.chamfer,
                e.stretch,
                cell(e.from_points),
                cell(e.from_image),
                e.rate
            );
        }
        text
    }
}
