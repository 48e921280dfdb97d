//! Colours and attributes of the scan on the surface.
//!
//! In: the scan as it was given, the denoised points, the surface. Out: a mesh that carries the scan's
//! columns.

use super::constants::TRANSFER_K;
use super::options::DenoiseOptions;
use super::prepare::{Frame, InputMap};
use super::surface::Built;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::geometry::names::{EXTRAPOLATED, NOISE, OUTLIER_PROBABILITY, UNCERTAINTY};
use crate::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use crate::uncertainty::{self, PointUncertainty};
use rayon::prelude::*;

/// The surface as a mesh with normals and the scan's colours and attributes, in the normalised frame. Takes
/// the surface. `sure` says how sure the points are, where that is asked for; `feet` where positions lie that
/// were averaged with others.
pub(super) fn mesh(
    cloud: &PointCloud,
    built: &mut Built,
    feet: &[(u32, Vec3)],
    sure: Option<&PointUncertainty>,
    ctx: &Context<'_>,
) -> Result<TriMesh> {
    ctx.check()?;
    let surface = std::mem::take(&mut built.surface);
    let mut mesh = TriMesh::new(vec3::plain(surface.positions), surface.triangles);
    mesh.normals = Some(surface.normals.iter().map(|n| n.to_f32()).collect());
    mesh.corner_normals = built.corner_normals.take();
    let sources = sources(&built.input, &built.projected, feet);
    transfer(cloud, sources, &mut mesh, ctx)?;
    let mut extrapolated = built.extrapolated.take();
    let mut columns = Vec::new();
    if let Some(sure) = sure {
        let at = vec3::of(&mesh.positions);
        let Built { charts, projected, sampling, .. } = &*built;
        let of_vertices = uncertainty::of_vertices(at, charts, projected, &sampling.spacing, sure, ctx)?;
        let values = of_vertices.iter().map(|v| v.sd * built.frame.scale).collect();
        columns.push(column(UNCERTAINTY, ScalarKind::F32, values));
        let invented = extrapolated.get_or_insert_with(|| vec![false; of_vertices.len()]);
        invented.iter_mut().zip(&of_vertices).for_each(|(e, v)| *e |= v.extrapolated);
    }
    if let Some(extrapolated) = extrapolated {
        let values = extrapolated.into_iter().map(|e| f64::from(u8::from(e))).collect();
        columns.push(column(EXTRAPOLATED, ScalarKind::U8, values));
    }
    put(&mut mesh.attributes, columns);
    Ok(mesh)
}

/// A column of one number per point. Those of 32-bit floats are rounded to such.
fn column(name: &str, kind: ScalarKind, mut values: Vec<f64>) -> Attribute {
    if kind == ScalarKind::F32 {
        values.iter_mut().for_each(|v| *v = f64::from(*v as f32));
    }
    Attribute { name: name.to_string(), width: 1, kind, values }
}

/// Adds columns. A scan that was denoised before brings some of the same names: those columns keep their
/// places, and get "_before" added until none before them has their name.
pub(super) fn put(attributes: &mut Vec<Attribute>, columns: Vec<Attribute>) {
    let mut names: Vec<String> = columns.iter().map(|c| c.name.clone()).collect();
    for old in attributes.iter_mut() {
        while names.contains(&old.name) {
            old.name.push_str("_before");
        }
        names.push(old.name.clone());
    }
    attributes.extend(columns);
}

/// How sure the denoised points are, as columns in input order. `at` is where they are now, in the user's
/// frame.
pub(super) fn of_points(
    at: &[Vec3],
    input: &InputMap,
    projected: &[ProjectedPoint],
    sure: &PointUncertainty,
    options: &DenoiseOptions,
    frame: Frame,
    ctx: &Context<'_>,
) -> Result<Vec<Attribute>> {
    let on = |p: u32| projected.get(p as usize).is_some_and(|q| q.chart != u32::MAX);
    let far: Vec<usize> = (0..at.len()).filter(|&i| !on(input.of_input[i])).collect();
    let normed: Vec<Vec3> = far.iter().map(|&i| (at[i] - frame.origin) * (1.0 / frame.scale)).collect();
    let far_from = uncertainty::distances(&normed, projected, ctx)?;
    // A point that goes only a share of its way keeps the rest of its noise.
    let way = options.strength.min(1.0);
    let noise = |p: usize| input.noise_of_input(f64::from(sure.noise[p]));
    let sd = |p: usize| way * f64::from(sure.sd[p]) + (1.0 - way) * noise(p);
    let of = |value: &dyn Fn(usize) -> f64, other: f64| -> Vec<f64> {
        input.of_input.iter().map(|&p| if on(p) { value(p as usize) } else { other }).collect()
    };
    let mut deviation = of(&|p| frame.scale * sd(p), f64::NAN);
    far.iter().zip(far_from).for_each(|(&i, d)| deviation[i] = frame.scale * d);
    let mut stray = of(&|p| f64::from(sure.stray[p]), 1.0);
    for i in (0..at.len()).filter(|&i| !at[i].iter().all(|x| x.is_finite())) {
        (deviation[i], stray[i]) = (f64::NAN, f64::NAN);
    }
    Ok(vec![
        column(UNCERTAINTY, ScalarKind::F32, deviation),
        column(NOISE, ScalarKind::F32, of(&|p| frame.scale * noise(p), 0.0)),
        column(OUTLIER_PROBABILITY, ScalarKind::F32, stray),
    ])
}

/// Where the input points lie whose colours and attributes the surface gets: of those that are one point the
/// first, but all of those that were averaged (`feet`).
fn sources(input: &InputMap, projected: &[ProjectedPoint], feet: &[(u32, Vec3)]) -> Vec<(u32, Vec3)> {
    let mut first = vec![u32::MAX; projected.len()];
    for (i, &p) in input.of_input.iter().enumerate().rev() {
        if p != u32::MAX {
            first[p as usize] = i as u32;
        }
    }
    for &i in &input.averaged {
        if let Some(first) = first.get_mut(input.of_input[i as usize] as usize) {
            *first = u32::MAX;
        }
    }
    let on = |(p, first): &(&ProjectedPoint, u32)| p.chart != u32::MAX && *first != u32::MAX;
    let own = projected.iter().zip(first).filter(on).map(|(p, first)| (first, p.position));
    own.chain(feet.iter().copied()).collect()
}

/// Carries colours and attributes from the denoised points to the mesh's vertices: averages over the nearest
/// points by inverse squared distance; whole numbers are labels and come from the nearest point alone.
fn transfer(
    cloud: &PointCloud,
    sources: Vec<(u32, Vec3)>,
    mesh: &mut TriMesh,
    ctx: &Context<'_>,
) -> Result<()> {
    if cloud.colors.is_none() && cloud.attributes.is_empty() {
        return Ok(());
    }
    if mesh.positions.is_empty() {
        mesh.colors = cloud.colors.as_ref().map(|_| Vec::new());
        let empty = |a: &Attribute| Attribute {
            name: a.name.clone(),
            width: a.width,
            kind: a.kind,
            values: Vec::new(),
        };
        mesh.attributes = cloud.attributes.iter().map(empty).collect();
        return Ok(());
    }
    ctx.check()?;
    let (from, at): (Vec<u32>, Vec<Vec3>) = sources.into_iter().unzip();
    let tree = Neighbours::build(&at, ctx)?;
    let weights: Vec<[(u32, f32); TRANSFER_K]> = mesh
        .positions
        .par_chunks(1024)
        .map(|chunk| {
            ctx.check()?;
            let mut found: Vec<Neighbour> = Vec::new();
            Ok(chunk
                .iter()
                .map(|p| {
                    tree.nearest(Vec3(*p), TRANSFER_K, &mut found);
                    let soft = found.first().map_or(0.0, |f| f.dist2) * 0.1 + 1e-18;
                    let total: f64 = found.iter().map(|f| 1.0 / (f.dist2 + soft)).sum();
                    let mut w = [(u32::MAX, 0f32); TRANSFER_K];
                    for (w, f) in w.iter_mut().zip(&found) {
                        *w = (from[f.index as usize], (1.0 / (f.dist2 + soft) / total) as f32);
                    }
                    w
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    ctx.check()?;
    debug_assert!(weights.iter().all(|w| w[0].0 != u32::MAX));
    let blend = |w: &[(u32, f32); TRANSFER_K], value: &dyn Fn(usize) -> f64| {
        w.iter().filter(|w| w.0 != u32::MAX).map(|&(i, w)| f64::from(w) * value(i as usize)).sum::<f64>()
    };
    if let Some(colors) = &cloud.colors {
        let mut blended = Vec::with_capacity(weights.len());
        for (i, w) in weights.iter().enumerate() {
            ctx.check_at(i)?;
            blended.push([0, 1, 2, 3].map(|k| blend(w, &|i| f64::from(colors[i][k])) as f32));
        }
        mesh.colors = Some(blended);
    }
    for a in &cloud.attributes {
        let mut values = Vec::with_capacity(weights.len() * a.width);
        for (i, w) in weights.iter().enumerate() {
            ctx.check_at(i)?;
            values.extend((0..a.width).map(|k| {
                if a.kind.is_integer() {
                    a.values[w[0].0 as usize * a.width + k]
                } else {
                    blend(w, &|i| a.values[i * a.width + k])
                }
            }));
        }
        mesh.attributes.push(Attribute { values, ..a.clone() });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_that_was_denoised_twice_keeps_all_its_columns_under_names_of_their_own() {
        let named = |names: &[&str]| -> Vec<Attribute> {
            names.iter().map(|n| column(n, ScalarKind::F64, vec![0.0])).collect()
        };
        let mut given = named(&["uncertainty", "intensity", "uncertainty_before"]);
        put(&mut given, named(&["uncertainty"]));
        let names: Vec<&str> = given.iter().map(|a| a.name.as_str()).collect();
        assert_eq!(names, ["uncertainty_before", "intensity", "uncertainty_before_before", "uncertainty"]);
    }
}
