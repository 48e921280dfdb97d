//! How much of a place on a surface the outside sees.
//!
//! In: triangles, a place. Out: the share of the directions from there that lead outside: rays in evenly
//! spread directions that meet no triangle.

use super::bvh::{Aabb, Bvh};
use super::triangle::meets_ray;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use std::f64::consts::PI;
use std::ops::ControlFlow;

/// Rays from a place: what they find is off by 0.5 / sqrt(64) = 6 % of the directions at most, in the mean.
const RAYS: usize = 64;
/// Nearer than this nothing hides a place, in lengths of its edge: faces that meet at the edge are met there
/// by rounding. Chosen, far more than rounding and far less than any gap that one looks through.
const TOUCH: f64 = 1e-6;
/// The same, in the size of coordinates, 2e-16 of which is rounded away in each operation.
const ROUNDED: f64 = 1e-12;

/// A surface, and from where it is looked at.
pub(crate) struct Outside {
    faces: Vec<[Vec3; 3]>,
    tree: Bvh,
    directions: Vec<Vec3>,
}

impl Outside {
    /// Prepares to look. With `up`, of any length, nobody looks from below.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn new(faces: Vec<[Vec3; 3]>, up: Option<Vec3>, ctx: &Context<'_>) -> Result<Self> {
        let boxes: Vec<Aabb> = faces.iter().map(|f| Aabb::of(f)).collect();
        let tree = Bvh::build(&boxes, ctx)?;
        let directions = match up {
            None => (0..RAYS).map(|i| direction(i, RAYS)).collect(),
            Some(up) => (0..2 * RAYS).map(|i| direction(i, 2 * RAYS)).filter(|d| d.dot(up) >= 0.0).collect(),
        };
        Ok(Self { faces, tree, directions })
    }

    /// How much of a place between two points of an edge is seen, in [0, 1]. One from which half of the
    /// directions, or more, lead outside is seen in full, as on a convex body. Of the directions one in `few`
    /// is looked along, from the `first` on.
    pub(crate) fn sees(&self, [a, b]: [Vec3; 2], along: f64, first: usize, few: usize) -> f64 {
        let at = a + (b - a) * along;
        let far = a.0.iter().chain(&b.0).fold(0.0f64, |far, x| far.max(x.abs()));
        let near = TOUCH * a.dist2(b).sqrt() + ROUNDED * far;
        let leads_outside = |d: &&Vec3| {
            self.tree
                .along(at, **d, |f| {
                    let hides = meets_ray(&self.faces[f as usize], at, **d).is_some_and(|t| t > near);
                    if hides { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
                .is_continue()
        };
        let some = || self.directions.iter().skip(first).step_by(few);
        let free = some().filter(leads_outside).count();
        (2.0 * free as f64 / some().count() as f64).min(1.0)
    }
}

/// A direction of a spiral that covers the sphere evenly (Swinbank and Purser 2006).
fn direction(i: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2 * i + 1) as f64 / count as f64;
    let turn = PI * (3.0 - 5f64.sqrt()) * i as f64;
    let r = (1.0 - z * z).sqrt();
    Vec3([r * turn.cos(), r * turn.sin(), z])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn from_below_nothing_is_seen_where_nobody_looks_from_there() {
        let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let at = |[x, y]: [f64; 2], z: f64| Vec3([x, y, z]);
        // A floor, and edges above and below it.
        let floor = vec![[at(a, 0.0), at(b, 0.0), at(c, 0.0)], [at(a, 0.0), at(c, 0.0), at(d, 0.0)]];
        let middle = |z: f64| [Vec3([0.4, 0.5, z]), Vec3([0.6, 0.5, z])];
        let seen = |up: Option<Vec3>, z: f64| {
            let outside = Run::default().execute(|ctx| Outside::new(floor.clone(), up, ctx)).unwrap();
            outside.sees(middle(z), 0.5, 0, 1)
        };
        let up = Some(Vec3([0.0, 0.0, 2.0]));
        assert_eq!([seen(up, 1e-3), seen(None, 1e-3), seen(None, -1e-3)], [1.0; 3]);
        assert!(seen(up, -1e-3) < 0.05, "{}", seen(up, -1e-3));
    }
}
