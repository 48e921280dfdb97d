//! Near-duplicate points: a scan that was stored twice with different rounding, corners of triangles apart.
//!
//! In: distinct points. Out: one point for each place, with search tree and spacing. Copies carry nothing
//! new; left in, they hide the noise (a copy repeats its original's error) and the spacing.

use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::sets::Sets;
use crate::spatial::spacing::{NAMED, around};

/// Rounds of joining. The first joins up to 31 copies of a place, a second what that has brought to light.
const ROUNDS: usize = 3;

/// Points of which none is a copy of another.
pub(super) struct Places {
    /// The points.
    pub points: Vec<Vec3>,
    /// Their search tree.
    pub tree: Neighbours,
    /// Spacing at each.
    pub spacing: Vec<f32>,
    /// The nearest others of each, see [`around`].
    pub nearest: Vec<[u32; NAMED]>,
    /// For each given point its place among them.
    pub of_given: Vec<u32>,
}

impl Places {
    /// Lets positions that were named by given points name the places.
    pub fn rename(&self, of_input: &mut [u32]) {
        rename(of_input, &self.of_given);
    }
}

/// Gives things that were named by `place`'s numbers the names there; what had none still has none.
pub(super) fn rename(names: &mut [u32], place: &[u32]) {
    for name in names {
        *name = place.get(*name as usize).copied().unwrap_or(u32::MAX);
    }
}

/// Joins copies: of each set the first point stays. `whole` says that the points are all of a scan.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn join(mut points: Vec<Vec3>, whole: bool, ctx: &Context<'_>) -> Result<Places> {
    let mut of_given: Vec<u32> = (0..points.len() as u32).collect();
    let mut tree = Neighbours::build(&points, ctx)?;
    let mut near = around(&points, &tree, ctx)?;
    for _ in 0..ROUNDS {
        let copies = near.copies(whole);
        if copies.is_empty() {
            break;
        }
        let place = first_of_each(&mut points, &copies);
        of_given.iter_mut().for_each(|p| *p = place[*p as usize]);
        tree = Neighbours::build(&points, ctx)?;
        near = around(&points, &tree, ctx)?;
    }
    Ok(Places { points, tree, spacing: near.spacing, nearest: near.nearest, of_given })
}

/// Points as they are, with their tree and spacing.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn placed(points: Vec<Vec3>, of_given: Vec<u32>, ctx: &Context<'_>) -> Result<Places> {
    let tree = Neighbours::build(&points, ctx)?;
    let near = around(&points, &tree, ctx)?;
    Ok(Places { points, tree, spacing: near.spacing, nearest: near.nearest, of_given })
}

/// Leaves the first point of each set of copies; returns for each point before its place after.
fn first_of_each(points: &mut Vec<Vec3>, copies: &[[u32; 2]]) -> Vec<u32> {
    let n = points.len();
    let mut sets = Sets::new(n);
    for [a, b] in copies {
        sets.join(*a, *b);
    }
    let mut place = vec![u32::MAX; n];
    let mut kept = Vec::new();
    let mut of_set = vec![u32::MAX; n];
    for i in 0..n {
        let set = sets.find(i as u32) as usize;
        if of_set[set] == u32::MAX {
            of_set[set] = kept.len() as u32;
            kept.push(points[i]);
        }
        place[i] = of_set[set];
    }
    *points = kept;
    place
}
