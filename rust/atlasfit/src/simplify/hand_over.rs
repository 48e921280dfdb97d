//! Which triangle each point of the first mesh belongs to, when triangles change.
//!
//! In: triangles that go or change, and what comes instead. Out: whether the surface stays near enough; then
//! the points handed over.

use super::block::Block;
use super::constants::SIMPLIFY;
use crate::numeric::vec3::Vec3;
use crate::spatial::triangle::closest_on_triangle;

/// What is to change, and buffers.
#[derive(Default)]
pub(super) struct Change {
    /// The triangles that change or go.
    pub(super) old: Vec<u32>,
    /// Those that stay, as they are to be.
    pub(super) new: Vec<NewTriangle>,
    /// Where the points go.
    moved: Vec<Handed>,
    /// Of these the one nearest to the place that was asked for.
    pub(super) nearest: Option<u32>,
}

/// A triangle as it is to be.
pub(super) struct NewTriangle {
    pub(super) triangle: u32,
    pub(super) vertices: [u32; 3],
    pub(super) corners: [Vec3; 3],
}

struct Handed {
    /// Its place among the block's points.
    point: u32,
    triangle: u32,
}

impl Change {
    pub(super) fn clear(&mut self) {
        self.old.clear();
        self.new.clear();
    }
}

impl Block<'_> {
    /// The place and the number of each point that belongs to a triangle.
    pub(super) fn points_of(&self, triangle: u32) -> impl Iterator<Item = (u32, u32)> {
        let mut k = self.head[triangle as usize];
        std::iter::from_fn(move || {
            let at = self.points.get(k as usize)?;
            let found = (k, *at);
            k = self.next[k as usize];
            Some(found)
        })
    }

    /// Whether all points of the triangles that change stay near enough to those that come, and a place of
    /// the new surface is near enough to the first mesh: to the plane of the nearest point.
    pub(super) fn fits(&self, change: &mut Change, place: Vec3) -> bool {
        let Change { old, new, moved, nearest: found } = change;
        moved.clear();
        *found = None;
        // Where the cheapest edges come first a point goes to any triangle that is near enough.
        let near = if self.ranked { 1.0 } else { SIMPLIFY.near };
        let places = self.first.points;
        let mut nearest = (f64::INFINITY, 0);
        for &f in old.iter() {
            let own = new.iter().position(|n| n.triangle == f).unwrap_or(0);
            for (k, point) in self.points_of(f) {
                let p = places.positions[point as usize];
                let most = (self.share * f64::from(places.error[point as usize])).powi(2);
                let enough = near * near * most;
                let mut best = (f64::INFINITY, 0);
                for n in new[own..].iter().chain(&new[..own]) {
                    let d = p.dist2(closest_on_triangle(p, &n.corners));
                    if d < best.0 {
                        best = (d, n.triangle);
                    }
                    if d <= enough {
                        break;
                    }
                }
                if best.0 > most {
                    return false;
                }
                moved.push(Handed { point: k, triangle: best.1 });
                let d = p.dist2(place);
                if d < nearest.0 {
                    nearest = (d, point);
                }
            }
        }
        if nearest.0.is_infinite() {
            return true;
        }
        *found = Some(nearest.1);
        let n = nearest.1 as usize;
        places.normals[n].dot(place - places.positions[n]).abs() <= self.share * f64::from(places.error[n])
    }

    /// Whether the middles of the triangles that come are near enough: to the plane of the nearest point of
    /// the first mesh, or, at a crease, by a share of that to a triangle that goes.
    pub(super) fn middles_fit(&self, change: &Change) -> bool {
        let places = self.first.points;
        change.new.iter().all(|n| {
            let middle = (n.corners[0] + n.corners[1] + n.corners[2]) * (1.0 / 3.0);
            let points = change.old.iter().flat_map(|&f| self.points_of(f)).map(|x| x.1 as usize);
            let dist2 = |p: &usize| places.positions[*p].dist2(middle);
            points.min_by(|x, y| dist2(x).total_cmp(&dist2(y))).is_none_or(|p| {
                let most = self.share * f64::from(places.error[p]);
                let off = places.normals[p].dot(middle - places.positions[p]).abs();
                let to_old = |&f: &u32| {
                    let corners = self.corners(&self.triangles[f as usize]);
                    middle.dist2(closest_on_triangle(middle, &corners)) <= (SIMPLIFY.aside * most).powi(2)
                };
                off <= most || change.old.iter().any(to_old)
            })
        })
    }

    /// Changes the triangles; those that go get equal corners.
    pub(super) fn make(&mut self, change: &Change) {
        for &f in &change.old {
            self.head[f as usize] = u32::MAX;
            self.triangles[f as usize] = [0; 3];
        }
        change.new.iter().for_each(|n| self.triangles[n.triangle as usize] = n.vertices);
        for m in &change.moved {
            self.next[m.point as usize] = std::mem::replace(&mut self.head[m.triangle as usize], m.point);
        }
    }
}
