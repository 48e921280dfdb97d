//! A trained atlas of networks: samples of its charts on regular grids.
//!
//! In: samples. Out: one mesh; how much the charts overlap.

use atlasfit::error::Result;
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit::run::Context;
use atlasfit::spatial::neighbours::Neighbours;
use rayon::prelude::*;

/// Neighbours of a sample that are looked at for its own chart's nearest and another's: itself and the eight
/// around it.
const AROUND: usize = 9;

/// A trained atlas: samples of its charts, in the frame of the points it was fitted to.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct NetworkAtlas {
    /// Number of charts.
    pub charts: usize,
    /// Lines and samples per line of each chart; a curve is one line.
    pub grid: [usize; 2],
    /// Chart after chart, line after line.
    pub samples: Vec<Vec3>,
}

impl NetworkAtlas {
    /// An atlas of samples that other networks made.
    ///
    /// # Panics
    /// Where there are not as many samples as the charts' grids have.
    #[must_use]
    pub fn new(charts: usize, grid: [usize; 2], samples: Vec<Vec3>) -> Self {
        assert_eq!(samples.len(), charts * grid[0] * grid[1], "samples do not fill the grids");
        Self { charts, grid, samples }
    }

    /// The charts' grids as one mesh, chart after chart. A curve's triangles have no area: two of the corners
    /// are the same vertex.
    #[must_use]
    pub fn surface(&self) -> TriMesh {
        let [lines, side] = self.grid;
        let mut triangles = Vec::new();
        for chart in 0..self.charts {
            let at = |i: usize, j: usize| (chart * lines * side + i * side + j) as u32;
            for i in 0..lines.max(2) - 1 {
                for j in 0..side - 1 {
                    if lines == 1 {
                        triangles.push([at(0, j), at(0, j + 1), at(0, j + 1)]);
                        continue;
                    }
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        TriMesh::new(vec3::plain(self.samples.clone()), triangles)
    }

    /// Share of the samples that lie nearer to a sample of another chart than to the nearest one of their
    /// own: how much charts overlap, in [0, 1].
    ///
    /// # Errors
    /// [`atlasfit::Error::EmptyInput`] without samples; cancelled or out of time.
    pub fn overlap(&self, ctx: &Context<'_>) -> Result<f64> {
        let batch = self.grid[0] * self.grid[1];
        let tree = Neighbours::build(&self.samples, ctx)?;
        let over = self
            .samples
            .par_iter()
            .enumerate()
            .filter(|(i, p)| {
                let mut found = Vec::new();
                tree.nearest(**p, AROUND, &mut found);
                let own = found.iter().filter(|f| f.index as usize / batch == i / batch).nth(1);
                let other = found.iter().find(|f| f.index as usize / batch != i / batch);
                other.is_some_and(|o| own.is_none_or(|s| o.dist2 < s.dist2))
            })
            .count();
        Ok(over as f64 / self.samples.len() as f64)
    }
}
