//! From points to a code: a small network on each point, the largest of each unit over all points, one more
//! layer. Source: PointNet (Qi et al. 2017) without its input transforms, as AtlasNet uses it.

use crate::params::{Mode, Norm, Params};
use candle_core::{D, Result, Tensor};

pub(super) struct PointNet {
    layers: Vec<(Tensor, Norm)>,
    /// To the code.
    last: (Tensor, Norm),
}

impl PointNet {
    /// `units` of the layers on each point, then a code of `code` numbers.
    pub(super) fn new(params: &mut Params, units: &[usize], code: usize) -> Result<Self> {
        let mut inputs = 3;
        let mut layers = Vec::new();
        for (l, &n) in units.iter().enumerate() {
            // The last one before the maximum keeps negative values, as in AtlasNet.
            let slope = if l + 1 < units.len() { 0.0 } else { 1.0 };
            let name = format!("points.{l}");
            layers.push((
                params.uniform(&format!("{name}.weight"), (1, inputs, n), inputs)?,
                params.norm(&name, 1, n, slope)?,
            ));
            inputs = n;
        }
        let last = (
            params.uniform("points.code.weight", (1, inputs, code), inputs)?,
            params.norm("points.code", 1, code, 0.0)?,
        );
        Ok(Self { layers, last })
    }

    /// From (shapes, points, 3) the codes (shapes, code).
    pub(super) fn forward(&self, points: &Tensor, mode: Mode) -> Result<Tensor> {
        let (shapes, count, _) = points.dims3()?;
        let mut x = points.reshape((1, shapes * count, 3))?;
        for (weight, norm) in &self.layers {
            x = norm.forward(&x.matmul(weight)?, mode)?;
        }
        let x = x.reshape((shapes, count, x.dim(D::Minus1)?))?;
        let at = x.detach().argmax_keepdim(1)?;
        let x = x.gather(&at, 1)?.squeeze(1)?.unsqueeze(0)?;
        let (weight, norm) = &self.last;
        norm.forward(&x.matmul(weight)?, mode)?.squeeze(0)
    }
}
