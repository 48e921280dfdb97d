//! Recipes: what data, which model, how it is trained; a TOML file whose keys are those of the structs here.
//!
//! Keys that are left out have the defaults of the recipe `quick`; unknown ones are errors.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A recipe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Recipe {
    /// The made-up shapes.
    pub data: DataRecipe,
    /// The model.
    pub model: ModelRecipe,
    /// The training.
    pub train: TrainRecipe,
}

/// Which shapes are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DataRecipe {
    /// Shapes of each family, 10 or more: 8 of 10 to train, 1 to validate, 1 to test.
    pub shapes: usize,
    /// Pictures of each shape, from random views.
    pub views: usize,
    /// Side of the pictures in pixels, 16 to 512.
    pub image_side: usize,
    /// Points of each shape, 64 or more.
    pub points: usize,
    /// Decides all shapes, views and points.
    pub seed: u64,
}

/// What is encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoder {
    /// Points: the paper's autoencoder.
    Points,
    /// One picture: the paper's single-view reconstruction.
    Image,
    /// Either, into the same codes.
    Both,
}

impl Encoder {
    /// Whether points are encoded.
    #[must_use]
    pub const fn points(self) -> bool {
        matches!(self, Self::Points | Self::Both)
    }
    /// Whether pictures are encoded.
    #[must_use]
    pub const fn image(self) -> bool {
        matches!(self, Self::Image | Self::Both)
    }
}

/// What makes charts of a code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Decoder {
    /// A fully connected network for each chart.
    AtlasNet,
    /// A convolutional network for each chart.
    ConvAtlas,
}

/// The model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ModelRecipe {
    /// What is encoded.
    pub encoder: Encoder,
    /// What makes charts of a code.
    pub decoder: Decoder,
    /// Charts, 1 or more.
    pub charts: usize,
    /// Numbers of a code.
    pub code: usize,
    /// Units of the layers on each point (points).
    pub point_units: Vec<usize>,
    /// Side of the pictures in pixels (image).
    pub image_side: usize,
    /// Channels of the first stage (image); ResNet-18 has 64.
    pub image_width: usize,
    /// Units of the hidden layers (atlasnet).
    pub hidden: Vec<usize>,
    /// Samples along a side of a chart in training (atlasnet); convolutions have 32.
    pub side: usize,
    /// Channels of the first picture (convatlas), a multiple of 4.
    pub channels: usize,
}

/// The training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrainRecipe {
    /// Times that all shapes are seen.
    pub epochs: usize,
    /// Shapes per step, 2 or more.
    pub batch: usize,
    /// Points of each shape per step.
    pub points: usize,
    /// Adam's learning rate at first.
    pub rate: f64,
    /// Epochs after which the rate is halved, again and again.
    pub halve_every: usize,
    /// Weight of the stretch.
    pub stretch: f64,
    /// Epochs without a better validation after which training ends; 0: never.
    pub patience: usize,
    /// Decides the first weights and the order of the shapes.
    pub seed: u64,
}

impl Default for DataRecipe {
    fn default() -> Self {
        Self { shapes: 400, views: 6, image_side: 64, points: 2048, seed: 1 }
    }
}

impl Default for ModelRecipe {
    fn default() -> Self {
        Self {
            encoder: Encoder::Both,
            decoder: Decoder::AtlasNet,
            charts: 8,
            code: 128,
            point_units: vec![32, 64, 192],
            image_side: 64,
            image_width: 8,
            hidden: vec![96, 64],
            side: 9,
            channels: 48,
        }
    }
}

impl Default for TrainRecipe {
    fn default() -> Self {
        Self {
            epochs: 12,
            batch: 32,
            points: 640,
            rate: 2e-3,
            halve_every: 3,
            stretch: 0.01,
            patience: 6,
            seed: 1,
        }
    }
}

/// The recipes that the program knows, by name: their texts.
pub const BUILT_IN: [(&str, &str); 4] = [
    ("quick", include_str!("../recipes/quick.toml")),
    ("quick-conv", include_str!("../recipes/quick-conv.toml")),
    ("atlasnet", include_str!("../recipes/atlasnet.toml")),
    ("convatlas", include_str!("../recipes/convatlas.toml")),
];

impl Recipe {
    /// Reads a recipe.
    ///
    /// # Errors
    /// [`Error::Recipe`] for text that is no TOML, unknown keys, and numbers out of range.
    ///
    /// ```
    /// use atlasfit_learn::recipe::Recipe;
    /// let recipe = Recipe::read("[train]\nepochs = 3\n")?;
    /// assert_eq!((recipe.train.epochs, recipe.model.charts), (3, 8));
    /// assert!(Recipe::read("[train]\nepoch = 3\n").is_err());
    /// # Ok::<(), atlasfit_learn::Error>(())
    /// ```
    pub fn read(text: &str) -> Result<Self> {
        let recipe: Self = toml::from_str(text).map_err(|e| {
            Error::recipe(e.to_string().trim().to_owned(), "See docs/learning.md for its keys")
        })?;
        recipe.validate()?;
        Ok(recipe)
    }

    /// The text of the recipe, with all keys.
    ///
    /// # Errors
    /// [`Error::Recipe`] where it cannot be written.
    pub fn text(&self) -> Result<String> {
        toml::to_string(self).map_err(|e| Error::recipe(e.to_string(), "Report this"))
    }

    /// Fails on numbers out of range.
    ///
    /// # Errors
    /// [`Error::Recipe`].
    pub fn validate(&self) -> Result<()> {
        let (d, m, t) = (&self.data, &self.model, &self.train);
        let counts = [
            ("data.shapes", d.shapes, 10, 1_000_000),
            ("data.views", d.views, 1, 100),
            ("data.image_side", d.image_side, 16, 512),
            ("data.points", d.points, 64, 100_000),
            ("model.charts", m.charts, 1, 1000),
            ("model.code", m.code, 1, 100_000),
            ("model.image_side", m.image_side, 16, 512),
            ("model.image_width", m.image_width, 1, 512),
            ("model.side", m.side, 2, 256),
            ("model.channels", m.channels, 4, 4096),
            ("train.epochs", t.epochs, 1, 1_000_000),
            ("train.batch", t.batch, 2, 4096),
            ("train.points", t.points, 16, 100_000),
            ("train.halve_every", t.halve_every, 1, 1_000_000),
        ];
        for (key, value, least, most) in counts {
            if !(least..=most).contains(&value) {
                return Err(Error::recipe(format!("{key} is {value}"), format!("Give {least} to {most}")));
            }
        }
        for (key, list) in [("model.point_units", &m.point_units), ("model.hidden", &m.hidden)] {
            if list.is_empty() || list.contains(&0) {
                return Err(Error::recipe(format!("{key} is {list:?}"), "Give one or more numbers from 1"));
            }
        }
        if !m.channels.is_multiple_of(4) {
            return Err(Error::recipe(
                format!("model.channels is {}", m.channels),
                "Give a multiple of 4: each block halves them",
            ));
        }
        for (key, value) in [("train.rate", t.rate), ("train.stretch", t.stretch)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::recipe(format!("{key} is {value}"), "Give a number of 0 or more"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recipes_that_come_along_are_sound_and_quick_is_the_default() {
        for (name, text) in BUILT_IN {
            let recipe = Recipe::read(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(name != "quick" || recipe == Recipe::default());
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_range() {
        let said = |text: &str| Recipe::read(text).unwrap_err().to_string();
        assert!(said("[model]\nchannels = 6").contains("multiple of 4"));
        assert!(said("[train]\nbatch = 1").contains("Give 2 to 4096"));
        assert!(said("[train]\nrate = -1.0").contains("train.rate"));
        assert!(said("[model]\ndecoder = \"x\"").contains("convatlas"));
        assert!(said("epochs = 3").contains("unknown field"));
    }
}
