//! From a picture to a code: a residual network of 18 layers (He et al. 2016). In place of the maximum after
//! the first layer the first stage has a stride of 2; everything else is ResNet-18, of any width.

use crate::ops::{Window, add_relu, conv};
use crate::params::{Mode, Norm, Params};
use candle_core::{Result, Tensor};

/// Stages, each of [`BLOCKS`] blocks; the width doubles from stage to stage.
const STAGES: usize = 4;
const BLOCKS: usize = 2;

/// A convolution with batch norm.
struct Conv {
    weight: Tensor,
    norm: Norm,
    window: Window,
}

impl Conv {
    fn new(
        params: &mut Params,
        name: &str,
        [from, to]: [usize; 2],
        window: Window,
        slope: f32,
    ) -> Result<Self> {
        let inputs = window.side * window.side * from;
        Ok(Self {
            weight: params.uniform(&format!("{name}.weight"), (1, inputs, to), inputs)?,
            norm: params.norm(name, 1, to, slope)?,
            window,
        })
    }

    fn forward(&self, x: &Tensor, mode: Mode) -> Result<Tensor> {
        let (count, rows, columns, _) = x.dims4()?;
        let y = conv(x, &self.weight, self.window)?;
        let [rows, columns] = [rows, columns].map(|n| self.window.along(n));
        self.norm.forward(&y, mode)?.reshape((count, rows, columns, ()))
    }
}

/// Two convolutions, and the picture itself added to what they give.
struct Block {
    first: Conv,
    second: Conv,
    /// Where the size changes, the picture itself through this.
    shortcut: Option<Conv>,
}

pub(super) struct ResNet {
    stem: Conv,
    blocks: Vec<Block>,
    code: (Tensor, Norm),
}

impl ResNet {
    /// `width` channels in the first stage (64 in ResNet-18), `channels` of the picture.
    pub(super) fn new(params: &mut Params, channels: usize, width: usize, code: usize) -> Result<Self> {
        let stem = Conv::new(params, "image.stem", [channels, width], Window { side: 7, stride: 2 }, 0.0)?;
        let mut blocks = Vec::new();
        let mut from = width;
        for stage in 0..STAGES {
            let to = width << stage;
            for block in 0..BLOCKS {
                let name = format!("image.{stage}.{block}");
                let stride = if block == 0 { 2 } else { 1 };
                let around = Window { side: 3, stride };
                blocks.push(Block {
                    first: Conv::new(params, &format!("{name}.first"), [from, to], around, 0.0)?,
                    second: Conv::new(
                        params,
                        &format!("{name}.second"),
                        [to, to],
                        Window { side: 3, stride: 1 },
                        1.0,
                    )?,
                    shortcut: (block == 0)
                        .then(|| {
                            let through = Window { side: 1, stride };
                            Conv::new(params, &format!("{name}.shortcut"), [from, to], through, 1.0)
                        })
                        .transpose()?,
                });
                from = to;
            }
        }
        let code = (
            params.uniform("image.code.weight", (1, from, code), from)?,
            params.norm("image.code", 1, code, 0.0)?,
        );
        Ok(Self { stem, blocks, code })
    }

    /// From (pictures, side, side, channels) the codes (pictures, code).
    pub(super) fn forward(&self, pictures: &Tensor, mode: Mode) -> Result<Tensor> {
        let mut x = self.stem.forward(pictures, mode)?;
        for block in &self.blocks {
            let y = block.second.forward(&block.first.forward(&x, mode)?, mode)?;
            let own = match &block.shortcut {
                Some(conv) => conv.forward(&x, mode)?,
                None => x,
            };
            x = add_relu(&y, &own)?;
        }
        let x = x.mean(2)?.mean(1)?.unsqueeze(0)?;
        let (weight, norm) = &self.code;
        norm.forward(&x.matmul(weight)?, mode)?.squeeze(0)
    }
}
