//! Colours and attributes of the scan on the surface.
//!
//! In: the scan as it was given, the denoised points, the surface. Out: a mesh that carries the scan's
//! columns.

use super::constants::TRANSFER_K;
use super::surface::Built;
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
use crate::numeric::vec3::{self, Vec3};
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use rayon::prelude::*;

/// The attribute of a watertight surface's vertices, after the scan's own, that is 1 where they were
/// invented, 0 where data are.
pub const EXTRAPOLATED: &str = "extrapolated";

/// The surface as a mesh with normals and the scan's colours and attributes, in the normalised frame. Takes
/// the surface.
pub(super) fn mesh(cloud: &PointCloud, built: &mut Built, ctx: &Context<'_>) -> Result<TriMesh> {
    ctx.check()?;
    let surface = std::mem::take(&mut built.surface);
    let mut mesh = TriMesh::new(vec3::plain(surface.positions), surface.triangles);
    mesh.normals = Some(surface.normals.iter().map(|n| n.to_f32()).collect());
    let sources = first_inputs(&built.input.of_input, built.projected.len());
    transfer(cloud, &built.projected, &sources, &mut mesh, ctx)?;
    if let Some(extrapolated) = built.extrapolated.take() {
        // A scan that was made watertight before brings a column of that name: it keeps its place.
        for old in mesh.attributes.iter_mut().filter(|a| a.name == EXTRAPOLATED) {
            old.name.push_str("_before");
        }
        let values = extrapolated.into_iter().map(|e| f64::from(u8::from(e))).collect();
        let name = EXTRAPOLATED.to_string();
        mesh.attributes.push(Attribute { name, width: 1, kind: ScalarKind::U8, values });
    }
    Ok(mesh)
}

/// For each distinct point the first input point at its place.
fn first_inputs(of_input: &[u32], points: usize) -> Vec<u32> {
    let mut first = vec![u32::MAX; points];
    for (input, &p) in of_input.iter().enumerate().rev() {
        if p != u32::MAX {
            first[p as usize] = input as u32;
        }
    }
    first
}

/// Carries colours and attributes from the denoised points to the mesh's vertices: averages over the nearest
/// points by inverse squared distance; whole numbers are labels and come from the nearest point alone.
fn transfer(
    cloud: &PointCloud,
    projected: &[ProjectedPoint],
    sources: &[u32],
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
    let (at, from): (Vec<Vec3>, Vec<u32>) = projected
        .iter()
        .zip(sources)
        .filter(|(p, _)| p.chart != u32::MAX)
        .map(|(p, &s)| (p.position, s))
        .unzip();
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
