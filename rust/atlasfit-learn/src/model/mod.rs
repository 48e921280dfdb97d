//! Models: an encoder of points, of pictures or of both, and a decoder into charts.
//!
//! In: points (shapes, points, 3) in the normalised frame (box centred at 0, longest side 1), pictures
//! (shapes, side, side, 2) of brightness and cover in [0, 1]. Out: samples of charts on regular grids,
//! (shapes, charts side side, 3), within (-1, 1).

mod atlasnet;
mod conv_atlas;
mod image;
mod pointnet;
#[cfg(test)]
mod tests;

use crate::params::{Mode, Params};
use crate::recipe::{Decoder, ModelRecipe};
use atlasnet::AtlasNet;
use candle_core::{Device, Result, Tensor};
use conv_atlas::ConvAtlas;
use image::ResNet;
use pointnet::PointNet;

/// Numbers per pixel: brightness, and how much of it is covered.
pub const CHANNELS: usize = 2;

/// A model with all its numbers.
pub struct Model {
    /// How it was made.
    pub recipe: ModelRecipe,
    /// Its numbers.
    pub params: Params,
    points: Option<PointNet>,
    image: Option<ResNet>,
    decoder: AnyDecoder,
    device: Device,
}

enum AnyDecoder {
    Dense(AtlasNet),
    Conv(ConvAtlas),
}

/// How many numbers of a model are trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Counts {
    /// Of the encoder of points.
    pub points: usize,
    /// Of the encoder of pictures.
    pub image: usize,
    /// Of the decoder.
    pub decoder: usize,
}

impl Model {
    /// A random model.
    ///
    /// # Errors
    /// Those of candle.
    pub fn new(recipe: &ModelRecipe, seed: u64, device: &Device) -> Result<Self> {
        let mut params = Params::new(seed, device);
        let points = match recipe.encoder.points() {
            true => Some(PointNet::new(&mut params, &recipe.point_units, recipe.code)?),
            false => None,
        };
        let image = match recipe.encoder.image() {
            true => Some(ResNet::new(&mut params, CHANNELS, recipe.image_width, recipe.code)?),
            false => None,
        };
        let decoder = match recipe.decoder {
            Decoder::AtlasNet => {
                AnyDecoder::Dense(AtlasNet::new(&mut params, recipe.charts, recipe.code, &recipe.hidden)?)
            }
            Decoder::ConvAtlas => {
                AnyDecoder::Conv(ConvAtlas::new(&mut params, recipe.charts, recipe.code, recipe.channels)?)
            }
        };
        Ok(Self { recipe: recipe.clone(), params, points, image, decoder, device: device.clone() })
    }

    /// Where the numbers lie.
    #[must_use]
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Codes (shapes, code) of points; `None` without that encoder.
    ///
    /// # Errors
    /// Those of candle.
    pub fn encode_points(&self, points: &Tensor, mode: Mode) -> Result<Option<Tensor>> {
        self.points.as_ref().map(|net| net.forward(points, mode)).transpose()
    }

    /// Codes (shapes, code) of pictures; `None` without that encoder.
    ///
    /// # Errors
    /// Those of candle.
    pub fn encode_pictures(&self, pictures: &Tensor, mode: Mode) -> Result<Option<Tensor>> {
        self.image.as_ref().map(|net| net.forward(pictures, mode)).transpose()
    }

    /// Samples along a side of a chart: those of training; [`Self::decode_at`] takes another number where the
    /// decoder is one of functions.
    #[must_use]
    pub fn side(&self) -> usize {
        match self.decoder {
            AnyDecoder::Dense(_) => self.recipe.side,
            AnyDecoder::Conv(_) => conv_atlas::SIDE,
        }
    }

    /// Samples (shapes, charts, side side, 3) from codes.
    ///
    /// # Errors
    /// Those of candle.
    pub fn decode(&self, codes: &Tensor, mode: Mode) -> Result<Tensor> {
        Ok(self.decode_at(codes, self.recipe.side, mode)?.0)
    }

    /// [`Self::decode`] with `side` samples along a side of each chart; convolutions always give 32. Also
    /// says how many there are.
    ///
    /// # Errors
    /// Those of candle.
    pub fn decode_at(&self, codes: &Tensor, side: usize, mode: Mode) -> Result<(Tensor, usize)> {
        let (samples, side) = match &self.decoder {
            AnyDecoder::Dense(net) => (net.forward(codes, side, mode)?, side),
            AnyDecoder::Conv(net) => (net.forward(codes, mode)?, conv_atlas::SIDE),
        };
        Ok((samples.transpose(0, 1)?.contiguous()?, side))
    }

    /// How many numbers are trained.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let of = |part| self.params.count_of(part);
        Counts { points: of("points."), image: of("image."), decoder: of("decoder.") }
    }
}
