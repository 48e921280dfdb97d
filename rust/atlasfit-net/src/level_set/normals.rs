//! Normals of points that agree with each other.
//!
//! In: points. Out: a normal for each, outward where there is an outside. Normals are those of the planes
//! through the nearest neighbours; they are turned to agree along a minimum spanning tree.
//! Source: Hoppe et al. 1992, "Surface reconstruction from unorganized points".

use atlasfit::error::Result;
use atlasfit::numeric::dense::eigen3;
use atlasfit::numeric::sort::sort_by;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit::spatial::neighbours::Neighbours;
use atlasfit::spatial::sets::SignedSets;
use rayon::prelude::*;

/// Points per task.
const BLOCK: usize = 512;

/// A point's plane.
#[derive(Clone)]
struct Plane {
    normal: Vec3,
    /// The points that it goes through: the nearest ones, the point itself among them.
    of: Vec<u32>,
}

/// Normals of the planes through each point's nearest `neighbours`, outward where there is an outside.
pub(super) fn oriented_normals(points: &[Vec3], neighbours: usize, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let planes = planes(points, neighbours, ctx)?;
    let mut sets = agreeing(&planes, ctx)?;
    // The highest point of each part faces up.
    let roots: Vec<(u32, bool)> = (0..points.len() as u32).map(|i| sets.find(i)).collect();
    ctx.check()?;
    let mut highest = vec![u32::MAX; points.len()];
    for (i, (r, _)) in roots.iter().enumerate() {
        let h = &mut highest[*r as usize];
        if *h == u32::MAX || points[i][2] > points[*h as usize][2] {
            *h = i as u32;
        }
    }
    Ok((0..points.len())
        .map(|i| {
            let top = highest[roots[i].0 as usize] as usize;
            let down = (planes[top].normal[2] < 0.0) ^ roots[top].1 ^ roots[i].1;
            planes[i].normal.map(|x| if down { -x } else { x })
        })
        .collect())
}

/// The plane of least squares through each point's nearest `neighbours` and the point itself.
fn planes(points: &[Vec3], neighbours: usize, ctx: &Context<'_>) -> Result<Vec<Plane>> {
    let tree = Neighbours::build(points, ctx)?;
    let blocks = points
        .par_chunks(BLOCK)
        .map(|block| {
            ctx.check()?;
            let mut found = Vec::new();
            Ok(block
                .iter()
                .map(|p| {
                    tree.nearest(*p, neighbours + 1, &mut found);
                    let n = found.len() as f64;
                    let mean =
                        Vec3::from_fn(|k| found.iter().map(|f| points[f.index as usize][k]).sum::<f64>() / n);
                    let mut m = [0.0; 6];
                    for f in &found {
                        let d = points[f.index as usize] - mean;
                        for (m, (i, j)) in m.iter_mut().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)])
                        {
                            *m += d[i] * d[j];
                        }
                    }
                    Plane { normal: eigen3(m).1[0], of: found.iter().map(|f| f.index).collect() }
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    let mut planes = Vec::with_capacity(points.len());
    for block in blocks {
        ctx.check()?;
        planes.extend(block);
    }
    Ok(planes)
}

/// The points in sets that hang together, each point alike or opposite to its set's root: along Kruskal's
/// minimum spanning tree of the neighbourhood graph, the most parallel normals first.
fn agreeing(planes: &[Plane], ctx: &Context<'_>) -> Result<SignedSets> {
    let blocks = (planes.par_chunks(BLOCK).enumerate())
        .map(|(block, own)| {
            ctx.check()?;
            Ok((block * BLOCK..)
                .zip(own)
                .flat_map(|(i, plane)| {
                    (plane.of.iter().filter(move |j| **j as usize != i))
                        .map(move |&j| (1.0 - plane.normal.dot(planes[j as usize].normal).abs(), i as u32, j))
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    let mut edges: Vec<(f64, u32, u32)> = Vec::with_capacity(blocks.iter().map(Vec::len).sum());
    for block in blocks {
        ctx.check()?;
        edges.extend(block);
    }
    sort_by(&mut edges, |a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))), ctx)?;
    let mut sets = SignedSets::new(planes.len());
    for (k, &(_, i, j)) in edges.iter().enumerate() {
        ctx.check_at(k)?;
        sets.join(i, j, planes[i as usize].normal.dot(planes[j as usize].normal) < 0.0);
    }
    Ok(sets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::level_set::shapes::sphere;
    use atlasfit::run::Run;

    #[test]
    fn normals_of_a_sphere_point_outward() {
        let points = sphere(2000, 0.003);
        let normals = Run::default().execute(|ctx| oriented_normals(&points, 20, ctx)).unwrap();
        assert!(points.iter().zip(&normals).all(|(p, n)| (*p).dot(*n) > 0.45 * (*n).norm()));
    }
}
