//! Adam (Kingma and Ba 2015) with PyTorch's defaults.

use pulp::Arch;

/// Decay rates and guard against division by zero.
const BETA: [f32; 2] = [0.9, 0.999];
const EPS: f32 = 1e-8;

/// Moments of the gradient.
pub struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    steps: i32,
}

impl Adam {
    /// Before the first step.
    pub fn new(parameters: usize) -> Self {
        Self { first: vec![0.0; parameters], second: vec![0.0; parameters], steps: 0 }
    }

    /// One step downhill.
    pub fn step(&mut self, params: &mut [f32], grads: &[f32], rate: f32) {
        self.steps += 1;
        let correct = BETA.map(|b| 1.0 / (1.0 - f64::from(b).powi(self.steps)));
        let (step, second) = (rate * correct[0] as f32, correct[1].sqrt() as f32);
        Arch::new().dispatch(|| {
            for (((x, g), m), v) in params.iter_mut().zip(grads).zip(&mut self.first).zip(&mut self.second) {
                *m = BETA[0] * *m + (1.0 - BETA[0]) * g;
                *v = BETA[1] * *v + (1.0 - BETA[1]) * g * g;
                *x -= step * *m / (v.sqrt() * second + EPS);
            }
        });
    }
}
