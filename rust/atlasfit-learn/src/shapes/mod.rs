//! Made-up shapes of five families, of varied size and topology, with known correspondences.
//!
//! In: a family and a seed. Out: a shape of parts, y up, front +z, its box centred at 0 with a longest side
//! of
//! 1. A part's slot says what it is, the same for all shapes of the family.

mod build;
mod furniture;
mod loft;
mod others;
#[cfg(test)]
mod tests;

pub use build::Part;
pub use loft::Loft;

use build::Build;

use atlasfit::geometry::TriMesh;
use atlasfit::measure::sample::uniform;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;

/// A family of shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Family {
    /// Seats with backs, arms, legs or a pedestal.
    Chair,
    /// Tops on legs, a pedestal or trestles.
    Table,
    /// Shades on poles, with or without an arm.
    Lamp,
    /// Pots with handles, spouts, lids.
    Vessel,
    /// Bodies with wings, tails, engines.
    Aircraft,
}

impl Family {
    /// All of them, in the order of their numbers in files.
    pub const ALL: [Self; 5] = [Self::Chair, Self::Table, Self::Lamp, Self::Vessel, Self::Aircraft];

    /// Its name in files and tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Chair => "chair",
            Self::Table => "table",
            Self::Lamp => "lamp",
            Self::Vessel => "vessel",
            Self::Aircraft => "aircraft",
        }
    }
}

/// A shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Its parts; no two have the same slot.
    pub parts: Vec<Part>,
}

/// A place on a part: what names the same place on another shape of the family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// The part's slot.
    pub slot: u8,
    /// Along the part and around it, each in [0, 1].
    pub at: [f64; 2],
}

impl Shape {
    /// The shape of a seed.
    #[must_use]
    pub fn new(family: Family, seed: u64) -> Self {
        let mut rng = Rng::stream(seed, family as u64);
        let mut build = Build { parts: Vec::new() };
        match family {
            Family::Chair => furniture::chair(&mut build, &mut rng),
            Family::Table => furniture::table(&mut build, &mut rng),
            Family::Lamp => furniture::lamp(&mut build, &mut rng),
            Family::Vessel => others::vessel(&mut build, &mut rng),
            Family::Aircraft => others::aircraft(&mut build, &mut rng),
        }
        let mut shape = Self { parts: build.parts };
        let all = || shape.parts.iter().flat_map(|p| p.loft.extent());
        let low = all().fold(Vec3([f64::INFINITY; 3]), |a, b| Vec3::from_fn(|k| a[k].min(b[k])));
        let high = all().fold(Vec3([f64::NEG_INFINITY; 3]), |a, b| Vec3::from_fn(|k| a[k].max(b[k])));
        let longest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        let shift = (low + high) * (-0.5 / longest);
        shape.parts.iter_mut().for_each(|p| p.loft.moved(1.0 / longest, shift));
        shape
    }

    /// Its surface, and for each vertex its place; the second coordinate is NaN where a part ends in a point.
    #[must_use]
    pub fn mesh(&self) -> (TriMesh, Vec<Place>) {
        let (mut positions, mut places, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for part in &self.parts {
            let first = positions.len() as u32;
            let (points, uv, faces) = part.loft.mesh();
            positions.extend(points.into_iter().map(|p| p.0));
            places.extend(uv.into_iter().map(|at| Place { slot: part.slot, at }));
            triangles.extend(faces.into_iter().map(|t| t.map(|v| first + v)));
        }
        (TriMesh::new(positions, triangles), places)
    }

    /// Points uniform by area, with their places.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn sample(&self, count: usize, seed: u64, ctx: &Context<'_>) -> atlasfit::Result<Vec<(Vec3, Place)>> {
        let (mesh, places) = self.mesh();
        let samples = uniform(&mesh, count, seed, ctx)?;
        Ok(samples
            .into_iter()
            .map(|s| {
                let t = mesh.triangles[s.triangle as usize].map(|v| v as usize);
                let corners = t.map(|v| Vec3(mesh.positions[v]));
                let weights = barycentric(s.point, corners);
                let mean = |k: usize| {
                    let known = (0..3).filter(|&c| !places[t[c]].at[k].is_nan());
                    let (sum, all) = known.fold((0.0, 0.0), |(sum, all), c| {
                        (sum + weights[c] * places[t[c]].at[k], all + weights[c])
                    });
                    if all > 0.0 { sum / all } else { 0.0 }
                };
                (s.point, Place { slot: places[t[0]].slot, at: [mean(0), mean(1)] })
            })
            .collect())
    }

    /// Where a place lies on this shape; `None` where it has no such part.
    #[must_use]
    pub fn find(&self, place: Place) -> Option<Vec3> {
        self.parts.iter().find(|p| p.slot == place.slot).map(|p| p.loft.place(place.at))
    }
}

/// Weights of a triangle's corners at a point of it.
fn barycentric(p: Vec3, [a, b, c]: [Vec3; 3]) -> [f64; 3] {
    let n = (b - a).cross(c - a);
    let area = n.dot(n);
    if area == 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let v = (c - b).cross(p - b).dot(n) / area;
    let w = (a - c).cross(p - c).dot(n) / area;
    [v, w, 1.0 - v - w]
}
