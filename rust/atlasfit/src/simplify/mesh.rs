//! Any mesh of the user's with fewer triangles: its frame, its columns and its UVs.
//!
//! In: a [`TriMesh`], how many triangles or how far off. Out: another, with the columns of the nearest
//! vertices.

use super::cut_seams::{Cut, cut};
use super::{Dense, Goal, bound, simplify};
use crate::error::{Error, Result};
use crate::geometry::{Attribute, TriMesh};
use crate::numeric::vec3::{self, Vec3};
use crate::run::{Context, Stage, total_bytes, with_threads};
use crate::setters::setters;
use crate::spatial::triangle::area_vector;

/// How far to simplify a mesh: `faces`, `max_error` or both must be given.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct SimplifyOptions {
    /// Triangles that are few enough, at least 1; `None` = as few as `max_error` allows.
    pub faces: Option<usize>,
    /// How far any vertex of the mesh, and the middle of any edge, may be from the new one, in the mesh's unit,
    /// more than 0; `None` = as far as `faces` asks for.
    pub max_error: Option<f64>,
}

setters! {
    SimplifyOptions {
        with_faces: faces: Option<usize>,
        with_max_error: max_error: Option<f64>,
    }
}

/// A mesh with fewer triangles.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct SimplifiedMesh {
    /// The mesh. Vertices at one place are one.
    pub mesh: TriMesh,
    /// For each vertex one of the given mesh that is near: its columns are of that one.
    pub source: Vec<u32>,
    /// What the user should hear.
    pub warnings: Vec<String>,
}

/// Bytes for one vertex, and for one triangle, at the peak of one thread. Source: upper bounds of the peaks
/// that `tests/memory.py PROGRAM --only simplify --measure` prints: 340 and 60, by loose triangles, grids, and
/// a dragon with the UVs of `unwrap`.
const BYTES: [u64; 2] = [450, 100];
/// More of them for one triangle where the middles of edges are held too: 130 by the same grid.
const BYTES_BETWEEN: u64 = 200;

/// Makes a mesh of fewer triangles: larger where it is flat. Its boundary, and the seams of its UVs, stay
/// where they are within the error; both sides of a seam stay together, and no triangle turns over in UV
/// space. What is no surface (edges of three triangles, vertices that hold two sheets together) stays as it
/// is. UVs are those of the same places on the given mesh; colours and attributes are those of a vertex near
/// by; normals are made anew.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, simplify::{SimplifyOptions, simplify_mesh}};
/// // A flat sheet of 2 x 20 x 20 triangles.
/// let at = (0..441).map(|i| [f64::from(i % 21), f64::from(i / 21), 0.0]).collect();
/// let corners = (0..400).map(|i| i / 20 * 21 + i % 20);
/// let triangles = corners.flat_map(|a| [[a, a + 1, a + 22], [a, a + 22, a + 21]]).collect();
/// let options = SimplifyOptions::default().with_max_error(Some(0.01));
/// let light = Run::default()
///     .execute(|ctx| simplify_mesh(&TriMesh::new(at, triangles), &options, ctx))?;
/// assert!(light.mesh.triangles.len() < 100);
/// # Ok::<(), atlasfit::Error>(())
/// ```
///
/// # Errors
/// [`Error::InvalidArgument`] for options out of range, [`Error::IndexOutOfRange`] for a bad triangle,
/// [`Error::Degenerate`] for a mesh without a triangle of three places, and those of [`Context::check`].
pub fn simplify_mesh(mesh: &TriMesh, options: &SimplifyOptions, ctx: &Context<'_>) -> Result<SimplifiedMesh> {
    validate(options)?;
    mesh.validate()?;
    let between = options.max_error.is_some();
    let of_triangle = BYTES[1] + if between { BYTES_BETWEEN } else { 0 };
    let needed = [(mesh.positions.len(), BYTES[0]), (mesh.triangles.len(), of_triangle), (1, mesh.bytes())];
    ctx.reserve(
        with_threads(total_bytes(&needed), ctx.threads()),
        "Raise the limit, or give a smaller mesh",
    )?;
    ctx.stage(Stage::Simplify, 1);
    let frame = Frame::of(mesh)?;
    let positions: Vec<Vec3> = mesh.positions.iter().map(|&p| frame.normal(p)).collect();
    let cut = cut(&positions, &mesh.triangles, mesh.corner_uv.as_deref(), ctx)?;
    if cut.triangles.is_empty() {
        return Err(Error::degenerate("no triangle has three places", "Give a mesh with an area"));
    }
    // No mesh is larger than its frame.
    let error = bound(options.max_error.map_or(1.0, |e| (e / frame.scale).min(1.0)));
    let n = cut.positions.len();
    let goal = Goal {
        faces: options.faces.unwrap_or(0),
        error: ctx.filled(error, n)?,
        longest: ctx.filled(f32::INFINITY, n)?,
        between,
    };
    let normals = normals(&cut);
    let dense = Dense {
        positions: &cut.positions,
        normals: &normals,
        triangles: &cut.triangles,
        seams: Some(&cut.seams),
    };
    let light = simplify(&dense, &goal, ctx)?;
    let mut out = whole(mesh, &cut, light, &frame);
    let left_out = mesh.triangles.len() - cut.triangles.len();
    if left_out > 0 {
        out.warnings.push(format!("{left_out} triangles without an area were left out"));
    }
    let left = out.mesh.triangles.len();
    if let Some(wanted) = options.faces.filter(|&wanted| left > wanted) {
        out.warnings.push(format!(
            "{left} triangles are left, not {wanted}: with fewer the mesh would be farther off than \
             max_error, fold, or turn over in UV space"
        ));
    }
    Ok(out)
}

fn validate(o: &SimplifyOptions) -> Result<()> {
    if o.faces.is_none() && o.max_error.is_none() {
        return Err(Error::invalid("neither faces nor max_error is given", "Give one of them, or both"));
    }
    if o.faces == Some(0) {
        return Err(Error::invalid("faces is 0", "Give at least 1"));
    }
    if let Some(e) = o.max_error
        && !(e > 0.0 && e.is_finite())
    {
        return Err(Error::invalid(format!("max_error is {e}"), "Give a positive length"));
    }
    Ok(())
}

/// The frame in which a mesh is of size 1 about the origin.
struct Frame {
    origin: Vec3,
    scale: f64,
}

impl Frame {
    fn of(mesh: &TriMesh) -> Result<Self> {
        let finite = mesh.positions.iter().filter(|p| p.iter().all(|x| x.is_finite()));
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in finite {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let scale = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Error::degenerate("the mesh has no extent", "Give a mesh with an area"));
        }
        Ok(Self { origin: Vec3(std::array::from_fn(|k| 0.5 * (low[k] + high[k]))), scale })
    }
    fn normal(&self, p: [f64; 3]) -> Vec3 {
        (Vec3(p) - self.origin).map(|x| x / self.scale)
    }
    fn user(&self, p: Vec3) -> Vec3 {
        p * self.scale + self.origin
    }
}

/// Unit normals: of all triangles at the vertex's place.
fn normals(cut: &Cut) -> Vec<Vec3> {
    let place = &cut.seams.place;
    let mut sum = vec![Vec3::ZERO; place.iter().max().map_or(0, |&p| p as usize + 1)];
    for t in &cut.triangles {
        let n = area_vector(t.map(|v| cut.positions[v as usize]));
        t.iter().for_each(|&v| sum[place[v as usize] as usize] += n);
    }
    place.iter().map(|&p| sum[p as usize].normalized()).collect()
}

/// The light mesh, whole again, in the user's frame and with the given one's columns.
fn whole(mesh: &TriMesh, cut: &Cut, light: super::Simplified, frame: &Frame) -> SimplifiedMesh {
    let mut number = vec![u32::MAX; mesh.positions.len()];
    let (mut kept, mut vertex) = (Vec::new(), Vec::with_capacity(light.place.len()));
    for (v, &place) in light.place.iter().enumerate() {
        let at = &mut number[place as usize];
        if *at == u32::MAX {
            *at = kept.len() as u32;
            kept.push(v);
        }
        vertex.push(*at);
    }
    let source: Vec<u32> = kept.iter().map(|&v| cut.source[light.from[v] as usize]).collect();
    let take = |v: &u32| *v as usize;
    // What is not moved keeps its place to the last bit.
    let position = |&v: &usize| {
        let from = light.from[v] as usize;
        if light.positions[v] == cut.positions[from] {
            Vec3(mesh.positions[cut.source[from] as usize])
        } else {
            frame.user(light.positions[v])
        }
    };
    let corner_uv = mesh
        .corner_uv
        .as_ref()
        .map(|_| light.triangles.iter().map(|t| t.map(|v| light.uv[v as usize].map(|x| x as f32))).collect());
    let charts = mesh.face_chart.as_ref().map(|of| {
        let mut of_vertex = vec![u32::MAX; cut.positions.len()];
        for (t, &given) in cut.triangles.iter().zip(&cut.triangle_of) {
            t.iter().for_each(|&v| of_vertex[v as usize] = of[given as usize]);
        }
        light.triangles.iter().map(|t| of_vertex[light.from[t[0] as usize] as usize]).collect()
    });
    SimplifiedMesh {
        mesh: TriMesh {
            positions: vec3::plain(kept.iter().map(position).collect()),
            triangles: light.triangles.iter().map(|t| t.map(|v| vertex[v as usize])).collect(),
            normals: mesh.normals.as_ref().map(|_| kept.iter().map(|&v| light.normals[v].to_f32()).collect()),
            colors: mesh.colors.as_ref().map(|c| source.iter().map(|v| c[take(v)]).collect()),
            attributes: (mesh.attributes.iter())
                .map(|a| Attribute {
                    name: a.name.clone(),
                    width: a.width,
                    kind: a.kind,
                    values: (source.iter())
                        .flat_map(|v| &a.values[take(v) * a.width..(take(v) + 1) * a.width])
                        .copied()
                        .collect(),
                })
                .collect(),
            corner_uv,
            corner_normals: None,
            face_chart: charts,
        },
        source,
        warnings: Vec::new(),
    }
}
