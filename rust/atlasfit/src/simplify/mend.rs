//! Bad triangles of a block that flips and moves cannot better: most are needles with one short edge.
//!
//! In: a block. Out: the same, with short edges of bad triangles collapsed whatever the planes say of them:
//! the distance to the first mesh alone bounds what changes.

use super::block::{Around, Block, is_bad, plane, shape2};
use super::collapse::{CHECK, Scratch};
use super::data::Role;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::quadric::Quadric;
use crate::spatial::triangle::area_vector;

impl Block<'_> {
    /// Collapses the shortest edges of bad triangles where nothing speaks against it.
    pub(super) fn mend(&mut self, ctx: &Context<'_>) -> Result<()> {
        let mut around = self.around(ctx)?;
        let mut scratch = Scratch::default();
        for f in 0..self.triangles.len() {
            if f.is_multiple_of(CHECK) {
                ctx.check()?;
            }
            let Some(ends) = self.short_edge(self.triangles[f]) else { continue };
            let can = |v: &u32| {
                let v = *v as usize;
                self.free[v] && self.role[v] == Role::Free && !around.stale[v]
            };
            if ends.iter().all(can) {
                let places = self.places(ends, &around);
                let mut gone =
                    |&to: &Vec3| self.collapse_to(to, ends, [false, true], &mut around, &mut scratch) > 0;
                let _ = places.iter().any(&mut gone);
            }
        }
        self.renumber();
        self.open.iter_mut().zip(&around.changed).for_each(|(open, changed)| *open |= changed);
        ctx.check()
    }

    /// The shortest edge of a triangle that is bad.
    fn short_edge(&self, t: [u32; 3]) -> Option<[u32; 2]> {
        let corners = self.corners(&t);
        if t[0] == t[1] || !is_bad(shape2(&corners, area_vector(corners))) {
            return None;
        }
        let length2 = |k: usize| corners[k].dist2(corners[(k + 1) % 3]);
        let k = (0..3).min_by(|&x, &y| length2(x).total_cmp(&length2(y)))?;
        Some([t[k], t[(k + 1) % 3]])
    }

    /// Where the vertex of an edge may go: where the planes about it want it; within the surface to either
    /// end as well.
    fn places(&self, ends: [u32; 2], around: &Around) -> Vec<Vec3> {
        let about = ends.into_iter().flat_map(|v| self.star(v, around));
        let planes = about
            .map(|f| plane(self.corners(&self.triangles[f as usize])))
            .fold(Quadric::default(), |sum, p| sum + p);
        let mut places = vec![self.place_of(ends, false, &planes)];
        if ends.iter().all(|&v| !self.rim[v as usize]) {
            places.extend(ends.map(|v| self.positions[v as usize]));
        }
        places
    }
}
