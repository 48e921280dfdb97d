//! The lattice about the solid's surface, followed from the triangles on.
//!
//! In: the field. Out: the tetrahedra that the solid's surface passes through, with the vertices of the
//! lattice that they need. There is no grid: cubes are visited in rounds, from those about the triangles to
//! their neighbours across every face that the surface passes through.

use super::constants::SOLID;
use super::field::{Field, Sample};
use super::lattice::{Lattice, Site, cube_at, key, plus, site};
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::faces::Faces;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// What was visited.
#[derive(Default)]
pub(super) struct Grown {
    /// The lattice's vertices.
    pub(super) samples: Vec<Sample>,
    /// The corners of tetrahedra that are partly inside, as entries of `samples`; positively oriented.
    pub(super) tets: Vec<[u32; 4]>,
}

/// Visits all cubes that the solid's surface passes through.
///
/// # Errors
/// Cancelled or out of time; too little memory.
pub(super) fn grow(field: &Field<'_>, faces: &Faces<'_>, ctx: &Context<'_>) -> Result<Grown> {
    let lattice = Lattice::new();
    let mut grown = Grown::default();
    let mut known: FxHashMap<u64, u32> = FxHashMap::default();
    let mut visited: FxHashSet<u64> = FxHashSet::default();
    let mut round = seeds(field, faces, ctx)?;
    while !round.is_empty() {
        sort(&mut round, ctx)?;
        round.dedup();
        visited.extend(&round);
        visit(field, &lattice, &round, &mut known, &mut grown.samples, ctx)?;
        let mut next = Vec::new();
        for (i, &cube) in round.iter().enumerate() {
            ctx.check_at(16 * i)?;
            let at = site(cube);
            let corners: Vec<u32> = lattice.corners.iter().map(|&c| known[&key(plus(at, c))]).collect();
            for tet in &lattice.tets {
                let of = tet.corners.map(|c| corners[c]);
                let inside = of.map(|v| grown.samples[v as usize].inside());
                if inside == [inside[0]; 4] {
                    continue;
                }
                grown.tets.push(of);
                for (k, &across) in tet.across.iter().enumerate() {
                    let first = inside[(k + 1) % 4];
                    let crossed = (0..4).any(|j| j != k && inside[j] != first);
                    let cube = key(plus(at, across));
                    if crossed && across != [0; 3] && !visited.contains(&cube) {
                        next.push(cube);
                    }
                }
            }
        }
        round = next;
    }
    Ok(grown)
}

/// The cubes to begin with: about the vertices, and behind those where a plate stands, through it.
fn seeds(field: &Field<'_>, faces: &Faces<'_>, ctx: &Context<'_>) -> Result<Vec<u64>> {
    let mut normals = vec![Vec3::ZERO; faces.positions.len()];
    for (i, t) in faces.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let normal = faces.normal(i as u32);
        t.iter().for_each(|&v| normals[v as usize] += normal);
    }
    let deep = (field.thickness / field.side).ceil() as usize + 1;
    let mut seeds = Vec::new();
    for (i, &p) in faces.positions.iter().enumerate() {
        ctx.check_at(i)?;
        let steps = if field.level(i) < SOLID.level { deep } else { 0 };
        let step = normals[i].normalized() * field.side;
        let cubes = (0..=steps).filter_map(|k| cube_at(p - step * k as f64, field.side));
        seeds.extend(cubes.map(key));
    }
    Ok(seeds)
}

/// Computes the vertices that some cubes need and that are not known yet.
fn visit(
    field: &Field<'_>,
    lattice: &Lattice,
    cubes: &[u64],
    known: &mut FxHashMap<u64, u32>,
    samples: &mut Vec<Sample>,
    ctx: &Context<'_>,
) -> Result<()> {
    let mut needed = Vec::new();
    for (i, &cube) in cubes.iter().enumerate() {
        ctx.check_at(16 * i)?;
        let at: Site = site(cube);
        let corners = lattice.corners.iter().map(|&c| key(plus(at, c)));
        needed.extend(corners.filter(|k| !known.contains_key(k)));
    }
    sort(&mut needed, ctx)?;
    needed.dedup();
    let found = needed
        .par_chunks(SOLID.check)
        .map(|chunk| {
            ctx.check()?;
            Ok(chunk.iter().map(|&k| field.sample(site(k))).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    known.extend(needed.iter().zip(samples.len() as u32..).map(|(&k, i)| (k, i)));
    samples.extend(found.into_iter().flatten());
    Ok(())
}
