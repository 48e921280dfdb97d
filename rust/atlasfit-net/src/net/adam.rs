//! Adam's steps of gradient descent.
//!
//! In: parameters, their gradients, the learning rate. Out: updated parameters. Source: Kingma and Ba 2015,
//! "Adam: a method for stochastic optimization", algorithm 1, with its defaults; *Deep Manifold Prior*,
//! section 5.1, names the learning rate only.

use atlasfit::error::Result;
use atlasfit::run::Context;
use pulp::Arch;

/// Decay rates of the moments.
const BETA: [f32; 2] = [0.9, 0.999];
/// Guard against division by zero.
const EPS: f32 = 1e-8;
/// Parameters between two looks at the run: below a millisecond.
const PIECE: usize = 1 << 17;

/// Running moments of the gradient.
pub struct Adam {
    /// Of the gradient.
    first: Vec<f32>,
    /// Of its square.
    second: Vec<f32>,
    steps: i32,
}

impl Adam {
    /// The state before the first step of so many parameters.
    pub fn new(parameters: usize) -> Self {
        Self { first: vec![0.0; parameters], second: vec![0.0; parameters], steps: 0 }
    }

    /// One step downhill with the learning rate `rate`.
    ///
    /// # Errors
    /// Cancelled or out of time; some of the parameters have then moved.
    pub fn step(&mut self, params: &mut [f32], grads: &[f32], rate: f32, ctx: &Context<'_>) -> Result<()> {
        self.steps += 1;
        let correct = BETA.map(|b| 1.0 / (1.0 - f64::from(b).powi(self.steps)));
        let (step, second) = (rate * correct[0] as f32, correct[1].sqrt() as f32);
        let moments = self.first.chunks_mut(PIECE).zip(self.second.chunks_mut(PIECE));
        for ((params, grads), (first, squares)) in
            params.chunks_mut(PIECE).zip(grads.chunks(PIECE)).zip(moments)
        {
            ctx.check()?;
            Arch::new().dispatch(|| {
                for (((x, g), m), v) in params.iter_mut().zip(grads).zip(first).zip(squares) {
                    *m = BETA[0] * *m + (1.0 - BETA[0]) * g;
                    *v = BETA[1] * *v + (1.0 - BETA[1]) * g * g;
                    *x -= step * *m / (v.sqrt() * second + EPS);
                }
            });
        }
        Ok(())
    }
}
