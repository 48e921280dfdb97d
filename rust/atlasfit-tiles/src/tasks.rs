//! The tasks of a plan: which there are, what each reads and writes, which come before.
//!
//! In: a plan without them. Out: its tasks, in an order in which they may run one after the other.

use crate::folder::{Folder, ROW_BYTES};
use crate::plan::{Plan, Task};
use atlasfit::DenoiseOptions;
use std::path::{Path, PathBuf};

/// What a task does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Denoises a tile.
    Tile(usize),
    /// Decides for all tiles: how their surfaces join, which way parts face, which stay.
    Seams,
    /// A tile's surface made lighter, with UVs and texture.
    Light(usize),
    /// The denoised points of a file.
    Points(usize),
    /// The surface as one file.
    Surface,
    /// What names the tiles of the surface.
    Tileset,
}

impl Kind {
    pub fn name(self) -> String {
        match self {
            Self::Tile(k) => format!("tile-{k:06}"),
            Self::Seams => "seams".into(),
            Self::Light(k) => format!("light-{k:06}"),
            Self::Points(k) => format!("points-{k:05}"),
            Self::Surface => "surface".into(),
            Self::Tileset => "tileset".into(),
        }
    }

    pub fn of(name: &str) -> Option<Self> {
        let number = |prefix| name.strip_prefix(prefix).and_then(|n: &str| n.parse().ok());
        match name {
            "seams" => Some(Self::Seams),
            "surface" => Some(Self::Surface),
            "tileset" => Some(Self::Tileset),
            _ => (number("tile-").map(Self::Tile))
                .or_else(|| number("light-").map(Self::Light))
                .or_else(|| number("points-").map(Self::Points)),
        }
    }
}

/// Bytes of memory for a point while a tile's surface gets UVs.
const LIGHT_BYTES: u64 = 700;
/// Bytes of memory of a task that passes files through.
const STREAM_BYTES: u64 = 64 << 20;

/// Bytes of memory of a task on so many points.
fn memory(points: u64, options: &DenoiseOptions) -> u64 {
    atlasfit::pipeline::memory_needed(points as usize, &options.clone().with_uv(false), 2)
        .saturating_add(points * (ROW_BYTES + 24))
}

/// The tasks of a plan in a folder.
pub(crate) fn of(plan: &Plan, at: &Path) -> Vec<Task> {
    let folder = Folder(at);
    let options = plan.options.of_core();
    let all: u64 = plan.tiles.iter().map(|t| t.own).sum();
    let wants_surface = plan.surface.is_some() || plan.tileset.is_some();
    let task = |kind: Kind, inputs, outputs, after: Vec<Kind>, points, memory| Task {
        name: kind.name(),
        command: ["tiles", "run", &at.to_string_lossy(), "--task", &kind.name()].map(String::from).to_vec(),
        inputs,
        outputs,
        after: after.into_iter().map(Kind::name).collect(),
        points,
        memory,
    };
    let tiles = 0..plan.tiles.len();
    let mut tasks = Vec::new();
    for k in tiles.clone() {
        let points = plan.tiles[k].with_halo;
        tasks.push(task(
            Kind::Tile(k),
            vec![folder.points(k)],
            vec![folder.mesh(k), folder.seam(k), folder.moved(k)],
            vec![],
            points,
            memory(points, &options),
        ));
    }
    for (f, scan) in plan.scans.iter().enumerate() {
        let Some(denoised) = &scan.denoised else { continue };
        let of: Vec<usize> = tiles.clone().filter(|&k| plan.tiles[k].files.contains(&(f as u32))).collect();
        let mut inputs = vec![scan.file.clone()];
        inputs.extend(of.iter().map(|&k| folder.moved(k)));
        let after = of.into_iter().map(Kind::Tile).collect();
        tasks.push(task(Kind::Points(f), inputs, vec![denoised.clone()], after, scan.points, STREAM_BYTES));
    }
    if !wants_surface {
        return tasks;
    }
    let decided = tiles.clone().map(|k| folder.decided(k)).chain([folder.summary()]).collect();
    let seams = tiles.clone().map(|k| folder.seam(k)).collect();
    let tiles_done = tiles.clone().map(Kind::Tile).collect();
    // Edges of tiles grow with the root of their points.
    let edges = plan.tiles.iter().map(|t| 16 * (t.own as f64).sqrt() as u64 + 1000).sum::<u64>();
    tasks.push(task(Kind::Seams, seams, decided, tiles_done, all, STREAM_BYTES + 400 * edges));
    for k in tiles.clone() {
        let own = plan.tiles[k].own;
        let mut inputs = vec![folder.mesh(k), folder.seam(k), folder.decided(k)];
        if plan.colors {
            inputs.push(folder.points(k));
        }
        // Written after the tile's GLB files, of which there are none where it has no surface.
        let outputs = vec![folder.light(k)];
        let memory = LIGHT_BYTES * own + STREAM_BYTES;
        tasks.push(task(Kind::Light(k), inputs, outputs, vec![Kind::Seams], own, memory));
    }
    let lights: Vec<PathBuf> = tiles.clone().map(|k| folder.light(k)).collect();
    let after: Vec<Kind> = tiles.map(Kind::Light).collect();
    if let Some(surface) = &plan.surface {
        let outputs = vec![surface.clone()];
        tasks.push(task(
            Kind::Surface,
            lights.clone(),
            outputs,
            after.clone(),
            all,
            STREAM_BYTES + 100 * edges,
        ));
    }
    if let Some(tileset) = &plan.tileset {
        tasks.push(task(Kind::Tileset, lights, vec![tileset.join("tileset.json")], after, all, STREAM_BYTES));
    }
    tasks
}

impl Plan {
    /// The file of a tile of the surface at a level of detail, 0 the finest.
    pub(crate) fn glb(&self, tile: usize, level: usize) -> Option<PathBuf> {
        Some(self.tileset.as_ref()?.join("tiles").join(format!("{tile:06}-{level}.glb")))
    }
}
