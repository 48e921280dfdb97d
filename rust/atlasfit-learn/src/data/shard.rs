//! Shapes in memory and in one file.

use crate::error::{Error, Result};
use crate::model::CHANNELS;
use crate::recipe::DataRecipe;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::path::Path;

/// Some shapes, one after the other.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Shard {
    /// Points per shape, views per shape, side of a picture in pixels.
    pub size: [usize; 3],
    /// Coordinates: shapes x points x 3.
    pub points: Vec<f32>,
    /// Pixels: shapes x views x side x side x 2, brightness and cover.
    pub pictures: Vec<u8>,
    /// Number of the family.
    pub family: Vec<u8>,
    /// The generator's seed of the shape, or its place in a list.
    pub id: Vec<u64>,
}

impl Shard {
    /// Without shapes.
    #[must_use]
    pub fn new(recipe: &DataRecipe) -> Self {
        Self { size: [recipe.points, recipe.views, recipe.image_side], ..Self::default() }
    }

    /// Number of shapes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// The coordinates of one shape.
    #[must_use]
    pub fn points_of(&self, shape: usize) -> &[f32] {
        let n = 3 * self.size[0];
        &self.points[shape * n..][..n]
    }

    /// One picture of one shape.
    #[must_use]
    pub fn picture_of(&self, shape: usize, view: usize) -> &[u8] {
        let [_, views, side] = self.size;
        let n = CHANNELS * side * side;
        &self.pictures[(shape * views + view) * n..][..n]
    }

    /// Adds the shapes of another one of the same size.
    pub fn append(&mut self, mut other: Self) {
        self.points.append(&mut other.points);
        self.pictures.append(&mut other.pictures);
        self.family.append(&mut other.family);
        self.id.append(&mut other.id);
    }

    /// Writes the file whole, or not at all.
    pub(super) fn write(&self, path: &Path, stop: &atlasfit::Stop) -> Result<()> {
        let [points, views, side] = self.size;
        let n = self.len();
        let coordinates: Vec<u8> = self.points.iter().flat_map(|x| x.to_le_bytes()).collect();
        let ids: Vec<u8> = self.id.iter().flat_map(|x| x.to_le_bytes()).collect();
        let failed = |e| Error::bad_file(path, format!("the shapes cannot be written ({e})"), "Report this");
        let views: [(&str, TensorView<'_>); 4] = [
            ("points", TensorView::new(Dtype::F32, vec![n, points, 3], &coordinates).map_err(failed)?),
            (
                "pictures",
                TensorView::new(Dtype::U8, vec![n, views, side, side, CHANNELS], &self.pictures)
                    .map_err(failed)?,
            ),
            ("family", TensorView::new(Dtype::U8, vec![n], &self.family).map_err(failed)?),
            ("id", TensorView::new(Dtype::U64, vec![n], &ids).map_err(failed)?),
        ];
        let bytes = safetensors::serialize(views, None).map_err(failed)?;
        Ok(atlasfit_io::write_file(path, &bytes, stop)?)
    }

    /// Reads the file of a collection made by `recipe`.
    pub(super) fn read(path: &Path, recipe: &DataRecipe) -> Result<Self> {
        let bad = |what: String| Error::bad_file(path, what, "Make the data anew");
        let bytes = std::fs::read(path).map_err(|e| bad(format!("it cannot be read ({e})")))?;
        let file = SafeTensors::deserialize(&bytes)
            .map_err(|e| bad(format!("it is damaged or only half written ({e})")))?;
        let mut shard = Self::new(recipe);
        let [points, views, side] = shard.size;
        let get = |name: &str| file.tensor(name).map_err(|e| bad(e.to_string()));
        let n = get("id")?.shape().first().copied().unwrap_or(0);
        let checked = |name: &str, kind: Dtype, shape: &[usize]| {
            let view = get(name)?;
            if view.dtype() != kind || view.shape() != shape {
                let (found, wanted) = (view.shape(), shape);
                return Err(bad(format!("{name} has the shape {found:?}, not {wanted:?}")));
            }
            Ok(view.data().to_vec())
        };
        let coordinates = checked("points", Dtype::F32, &[n, points, 3])?;
        shard.points = coordinates.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        shard.pictures = checked("pictures", Dtype::U8, &[n, views, side, side, CHANNELS])?;
        shard.family = checked("family", Dtype::U8, &[n])?;
        shard.id = checked("id", Dtype::U64, &[n])?
            .as_chunks::<8>()
            .0
            .iter()
            .map(|b| u64::from_le_bytes(*b))
            .collect();
        if shard.points.iter().any(|x| !x.is_finite()) {
            return Err(bad("a coordinate is not finite".into()));
        }
        Ok(shard)
    }
}
