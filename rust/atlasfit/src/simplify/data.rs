//! What the files of this step share, as data: the mesh before, between and after, and how far to go.

use crate::numeric::vec3::Vec3;
use std::borrow::Cow;

/// The mesh that is simplified. Every vertex is named by a triangle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Dense<'a> {
    /// Vertex positions.
    pub positions: &'a [Vec3],
    /// Unit normals of the surface there; their sign does not matter.
    pub normals: &'a [Vec3],
    /// Triangles.
    pub triangles: &'a [[u32; 3]],
    /// Its UVs and seams; none of a bare surface.
    pub seams: Option<&'a Seams>,
}

/// What a mesh with UVs has besides. It is cut along its seams: a place on one has several vertices, which
/// are copies of each other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Seams {
    /// The UV of each vertex; none where there are only other seams.
    pub uv: Vec<[f64; 2]>,
    /// The place of each vertex: copies have the same.
    pub place: Vec<u32>,
    /// How each vertex may move.
    pub role: Vec<Role>,
}

/// How a vertex may move.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Role {
    /// As the surface allows.
    #[default]
    Free,
    /// It may go, together with its one copy, along the seam that runs through both.
    Seam(u32),
    /// It stays, as seams meet or end there; with how many vertices its place has.
    Corner(u32),
    /// Nothing about it changes: the surface is no surface there.
    Pinned,
}

/// How far a mesh is to be simplified. Lengths are in the mesh's unit.
#[derive(Debug, Clone, Default)]
pub(crate) struct Goal {
    /// Triangles that are few enough.
    pub faces: usize,
    /// Greatest distance of each vertex of the first mesh from the new one.
    pub error: Vec<f32>,
    /// Edges about each vertex of the first mesh do not get longer.
    pub longest: Vec<f32>,
    /// Whether the middles of the first mesh's edges stay as near as its vertices, for who counts on the
    /// error: between vertices that do the surface may be twice as far.
    pub between: bool,
}

/// A length as a bound: what is kept in single precision is never more.
pub(crate) fn bound(length: f64) -> f32 {
    let nearest = length as f32;
    if f64::from(nearest) > length { nearest.next_down() } else { nearest }
}

/// A simplified mesh.
#[derive(Debug)]
pub(crate) struct Simplified {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit normals, from those of the first mesh near by.
    pub normals: Vec<Vec3>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex one of the first mesh that is near.
    pub from: Vec<u32>,
    /// The UV of each vertex; none where the first mesh had none.
    pub uv: Vec<[f64; 2]>,
    /// The place of each vertex: what the first mesh's seams joined still is.
    pub place: Vec<u32>,
}

/// What the mesh is judged by all the time.
#[derive(Debug, Clone, Copy)]
pub(super) struct First<'a> {
    pub(super) dense: &'a Dense<'a>,
    pub(super) goal: &'a Goal,
    pub(super) points: &'a Points<'a>,
}

/// Places of the first mesh that stay near: its vertices, and perhaps the middles of its edges.
#[derive(Debug)]
pub(super) struct Points<'a> {
    pub(super) positions: Cow<'a, [Vec3]>,
    pub(super) normals: Cow<'a, [Vec3]>,
    /// Greatest distance of each from the new mesh.
    pub(super) error: Cow<'a, [f32]>,
    /// A vertex of the first mesh that each is at or next to.
    pub(super) vertex: Vec<u32>,
    /// A triangle of the first mesh that each belongs to.
    pub(super) owner: Vec<[u32; 1]>,
}

/// Which edges are collapsed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    /// Those that move the surface by at most this share of the error.
    pub(super) error: f64,
    /// Those that have at most this share of the greatest length.
    pub(super) length: f64,
}

/// A mesh that is being simplified. Vertices keep their numbers until all is done.
pub(super) struct Mesh {
    /// Vertex positions.
    pub(super) positions: Vec<Vec3>,
    /// Unit normals there.
    pub(super) normals: Vec<Vec3>,
    /// UVs there, if there are any.
    pub(super) uv: Vec<[f64; 2]>,
    /// For each vertex one of the first mesh that is near.
    pub(super) from: Vec<u32>,
    /// Whether something may be left to do about each vertex.
    pub(super) open: Vec<bool>,
    /// Triangles.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The triangle that each of the points belongs to.
    pub(super) owner: Vec<[u32; 1]>,
    /// Side of the grid's cells.
    pub(super) side: f64,
}

/// What is to be done in a round.
pub(super) struct Work<'a> {
    /// Which edges are collapsed, one level after another.
    pub(super) levels: &'a [Level],
    /// Triangles that may go, cheapest edges first; all where nothing is said, in the order in which they
    /// lie.
    pub(super) surplus: Option<usize>,
    /// Share of the error within which the points stay.
    pub(super) share: f64,
    /// Whether triangles are to be shaped.
    pub(super) shape: bool,
}

/// A triangle and the cell of the grid that it is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    pub(super) cell: u64,
    pub(super) triangle: u32,
}

/// Where a triangle is: its block, and its number there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spot {
    pub(super) block: u32,
    pub(super) local: u32,
}

/// What all blocks are cut from.
pub(super) struct Whole<'a> {
    pub(super) mesh: &'a Mesh,
    /// Triangles about each vertex.
    pub(super) valence: &'a [u32],
    /// Where each triangle is.
    pub(super) at: &'a [Spot],
}

/// What a block is made of.
pub(super) struct Piece<'a> {
    pub(super) places: &'a [Place],
    /// The points that belong to its triangles.
    pub(super) points: &'a [u32],
}

impl Role {
    /// The same within a block, where `number` has each vertex's number there; a copy elsewhere cannot go
    /// along.
    pub(super) fn within(self, number: &[u32]) -> Self {
        match self {
            Self::Seam(copy) => match number[copy as usize] {
                u32::MAX => Self::Corner(u32::MAX),
                here => Self::Seam(here),
            },
            other => other,
        }
    }
}
