//! Adds one primitive of a mesh to the scene: its vertices, moved by the node's transform, and its triangles.

use super::accessor::{self, Rows, announced};
use super::color::to_srgb;
use super::document::{Document, number};
use super::matrix::{Matrix, NormalTransform};
use super::scene::Scene;
use crate::error::Result;
use crate::faces::index;
use crate::input::Input;
use atlasfit::Vec3;
use atlasfit::geometry::{Attribute, ScalarKind};
use serde_json::Value;

/// Vertices, and corners of triangles, that instances of one mesh may multiply to.
const MOST: usize = 1 << 27;

/// The modes of a primitive.
const POINTS: u64 = 0;
const TRIANGLES: u64 = 4;
const STRIP: u64 = 5;
const FAN: u64 = 6;

/// What the JSON says of a primitive.
pub(super) struct Primitive<'a> {
    attributes: &'a Value,
    /// The accessor of the positions.
    position: usize,
    /// The accessor of the corners of triangles.
    indices: Option<usize>,
    mode: u64,
}

impl<'a> Primitive<'a> {
    /// `None` without positions.
    pub fn of(json: &'a Value) -> Option<Self> {
        let attributes = &json["attributes"];
        Some(Self {
            attributes,
            position: number(&attributes["POSITION"])?,
            indices: number(&json["indices"]),
            mode: json["mode"].as_u64().unwrap_or(TRIANGLES),
        })
    }

    pub fn is_points_or_triangles(&self) -> bool {
        matches!(self.mode, POINTS) || self.is_triangles()
    }

    pub fn is_triangles(&self) -> bool {
        matches!(self.mode, TRIANGLES | STRIP | FAN)
    }

    /// Whether the corners are those of one triangle after the other.
    pub fn is_list(&self) -> bool {
        self.mode == TRIANGLES
    }

    /// The vertices of the corners, numbered from `first` on: the primitive has `count` of them. One that is
    /// not there is [`NO_VERTEX`](crate::faces::NO_VERTEX).
    pub fn corners(
        &self,
        input: &mut Input<'_>,
        file: &Document<'_>,
        first: usize,
        count: usize,
    ) -> Result<Vec<u32>> {
        Ok(match self.indices {
            Some(id) => {
                // Wrong indices must stay wrong after the shift.
                let shift = |v: f64| if v < count as f64 { first as u32 + v as u32 } else { index(-1) };
                accessor::read(input, file, id)?.values.into_iter().map(shift).collect()
            }
            None => (first as u32..(first + count) as u32).collect(),
        })
    }

    /// The triangles of the corners, onto `out`.
    pub fn cut(&self, corners: &[u32], out: &mut Vec<[u32; 3]>) {
        match self.mode {
            TRIANGLES => out.extend_from_slice(corners.as_chunks::<3>().0),
            STRIP => out.extend(
                corners
                    .windows(3)
                    .enumerate()
                    .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }),
            ),
            FAN => out.extend(corners.windows(2).skip(1).map(|t| [corners[0], t[0], t[1]])),
            _ => {}
        }
    }
}

/// Adds a primitive.
pub(super) fn add(
    input: &mut Input<'_>,
    file: &Document<'_>,
    scene: &mut Scene,
    primitive: &Primitive<'_>,
    world: &Matrix,
) -> Result<()> {
    let first = scene.positions.len();
    // What is claimed is checked again when it is read; here it only stops multiplication.
    let corners = primitive.indices.and_then(|id| announced(file, id)).unwrap_or(0);
    let claimed = announced(file, primitive.position).unwrap_or(0);
    if first.saturating_add(claimed) > MOST || (3 * scene.triangles.len()).saturating_add(corners) > MOST {
        return Err(input.unsupported(
            format!("instances of its meshes make more than {MOST} vertices or corners"),
            "Give the meshes without instances",
        ));
    }
    let Rows { values, width } = accessor::read(input, file, primitive.position)?;
    let n = if width == 3 { values.len() / 3 } else { 0 };
    input.reserve(n, 72)?;
    scene.positions.extend(values.chunks_exact(3).map(|p| {
        [0, 1, 2].map(|r| world[r][0] * p[0] + world[r][1] * p[1] + world[r][2] * p[2] + world[r][3])
    }));
    drop(values);
    let transform = NormalTransform::of(world);
    let mut column = |name: &str| -> Result<Option<Rows>> {
        let id = number(&primitive.attributes[name]).filter(|&id| announced(file, id) == Some(n));
        let Some(id) = id else { return Ok(None) };
        accessor::read(input, file, id).map(|r| (r.values.len() / r.width == n).then_some(r))
    };
    match column("NORMAL")? {
        Some(Rows { values, width: 3 }) => add_normals(scene, first, &values, &transform),
        _ => scene.normalless |= n > 0,
    }
    if let Some(Rows { values, width: width @ 3..=4 }) = column("COLOR_0")? {
        scene.colors.resize(first, [1.0; 4]);
        scene.colors.extend(values.chunks_exact(width).map(|c| {
            let [r, g, b] = [0, 1, 2].map(|k| to_srgb(c[k] as f32));
            [r, g, b, if width == 4 { c[3] as f32 } else { 1.0 }]
        }));
    }
    if let Some(Rows { values, width: 2 }) = column("TEXCOORD_0")? {
        scene.uv.resize(first, [0.0; 2]);
        // v is down in glTF.
        scene.uv.extend(values.chunks_exact(2).map(|t| [t[0] as f32, 1.0 - t[1] as f32]));
    }
    // Names of a program's own begin with an underscore.
    let names = primitive.attributes.as_object().into_iter().flatten().map(|(k, _)| k.as_str());
    for name in names.filter(|k| k.starts_with('_')) {
        if let Some(rows) = column(name)? {
            add_attribute(scene, first, name, rows);
        }
    }
    scene.pad();
    add_triangles(input, file, scene, primitive, Added { first, count: n, mirrored: transform.mirrored })
}

fn add_normals(scene: &mut Scene, first: usize, values: &[f64], transform: &NormalTransform) {
    scene.normals.resize(first, [0.0; 3]);
    scene.normals.extend(values.chunks_exact(3).map(|v| {
        if !transform.moved {
            return [v[0] as f32, v[1] as f32, v[2] as f32];
        }
        let sign = if transform.mirrored { -1.0 } else { 1.0 };
        let t = transform.cofactor.map(|r| sign * (r[0] * v[0] + r[1] * v[1] + r[2] * v[2]));
        Vec3(t).normalized().to_f32()
    }));
}

/// Adds to the attribute of this name; rows of another width than it has are left out.
fn add_attribute(scene: &mut Scene, first: usize, name: &str, rows: Rows) {
    let Rows { values, width } = rows;
    let name = name.trim_start_matches('_').to_lowercase();
    let at = scene.attributes.iter().position(|a| a.name == name).unwrap_or_else(|| {
        scene.attributes.push(Attribute { name, width, kind: ScalarKind::F32, values: Vec::new() });
        scene.attributes.len() - 1
    });
    let column = &mut scene.attributes[at];
    if column.width == width {
        column.values.resize(first * width, 0.0);
        column.values.extend(values);
    }
}

/// The vertices that a primitive added.
struct Added {
    first: usize,
    count: usize,
    /// Whether they were mirrored, so that triangles must be turned over.
    mirrored: bool,
}

fn add_triangles(
    input: &mut Input<'_>,
    file: &Document<'_>,
    scene: &mut Scene,
    primitive: &Primitive<'_>,
    added: Added,
) -> Result<()> {
    if !primitive.is_triangles() {
        return Ok(());
    }
    let Added { first, count, mirrored } = added;
    let corners = primitive.corners(input, file, first, count)?;
    input.reserve(corners.len(), 16)?;
    scene.skipped += u64::from(primitive.is_list() && !corners.len().is_multiple_of(3));
    let from = scene.triangles.len();
    primitive.cut(&corners, &mut scene.triangles);
    if mirrored {
        scene.triangles[from..].iter_mut().for_each(|t| t.swap(1, 2));
    }
    Ok(())
}
