//! The results: denoised points, the surface as one file and as tiles.
//!
//! In: what the tiles gave. Out: a file of points for each of the scan's, row by row as there; one PLY of the
//! surface, each vertex once; `tileset.json`. All pass through, block by block.

use crate::error::{Error, Result};
use crate::folder::Folder;
use crate::job::{Key, key};
use crate::light::{LEVELS, Light, extent, middle, step};
use crate::plan::Plan;
use crate::store::{self, Number};
use atlasfit::Stop;
use atlasfit_io::{RowBlock, Rows, RowsWriter};
use rustc_hash::FxHashMap;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;

/// Points that are read and written at once.
const BLOCK: usize = 1 << 15;

/// Where the points of a tile go, in the order of their rows.
struct Moved {
    rows: File,
    places: File,
    path: PathBuf,
    left: u64,
    /// The next ones, the first last.
    next: Vec<(u64, [f64; 3])>,
}

impl Moved {
    fn open(folder: Folder<'_>, tile: usize) -> Result<Self> {
        let path = folder.moved(tile);
        let io = |e| Error::io(&path, "read it", e);
        let (mut rows, mut places) = (File::open(&path).map_err(io)?, File::open(&path).map_err(io)?);
        let mut count = [0; 8];
        rows.read_exact(&mut count).map_err(io)?;
        let left = u64::from_le_bytes(count);
        places.seek(SeekFrom::Start(8 + 8 * left + 8)).map_err(io)?;
        let mut moved = Self { rows, places, left, next: Vec::new(), path };
        moved.fill()?;
        Ok(moved)
    }
    fn fill(&mut self) -> Result<()> {
        const MOST: u64 = 4096;
        if !self.next.is_empty() || self.left == 0 {
            return Ok(());
        }
        let n = self.left.min(MOST) as usize;
        let io = |e| Error::io(&self.path, "read it", e);
        let (mut rows, mut places) = (vec![0; 8 * n], vec![0; 24 * n]);
        self.rows.read_exact(&mut rows).map_err(io)?;
        self.places.read_exact(&mut places).map_err(io)?;
        let place = |p: &[u8]| [0, 8, 16].map(|at| f64::get(&p[at..]));
        self.next = rows.chunks_exact(8).map(u64::get).zip(places.chunks_exact(24).map(place)).collect();
        self.next.reverse();
        self.left -= n as u64;
        Ok(())
    }
    /// The next row.
    fn row(&self) -> Option<u64> {
        self.next.last().map(|n| n.0)
    }
    fn take(&mut self) -> Result<Option<[f64; 3]>> {
        let taken = self.next.pop().map(|n| n.1);
        self.fill()?;
        Ok(taken)
    }
}

/// Writes the denoised points of a file.
pub(crate) fn points(plan: &Plan, folder: Folder<'_>, number: usize, stop: &Stop) -> Result<()> {
    let scan = &plan.scans[number];
    let Some(path) = &scan.denoised else { return Ok(()) };
    scan.check()?;
    let before: u64 = plan.scans[..number].iter().map(|s| s.points).sum();
    let of_file = plan.tiles.iter().enumerate().filter(|(_, t)| t.files.contains(&(number as u32)));
    let mut tiles = of_file.map(|(k, _)| Moved::open(folder, k)).collect::<Result<Vec<_>>>()?;
    let mut heap = std::collections::BinaryHeap::new();
    for (k, tile) in tiles.iter_mut().enumerate() {
        // Points of the files before.
        while tile.row().is_some_and(|r| r < before) {
            tile.take()?;
        }
        heap.extend(tile.row().map(|r| std::cmp::Reverse((r, k))));
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make it", e))?;
    }
    let mut rows = Rows::open(&scan.file, stop)?;
    let mut writer = RowsWriter::create(&rows, path)?;
    let mut block = RowBlock::default();
    let mut row = before;
    while rows.next(BLOCK, &mut block, stop)? {
        let mut places = block.positions.clone();
        for place in &mut places {
            // Points that are not finite are in no tile.
            if let Some(&std::cmp::Reverse((next, k))) = heap.peek()
                && next == row
            {
                heap.pop();
                if let Some(to) = tiles[k].take()? {
                    *place = to;
                }
                heap.extend(tiles[k].row().map(|r| std::cmp::Reverse((r, k))));
            }
            row += 1;
        }
        writer.put(&rows, &mut block, &places, stop)?;
    }
    scan.check()?;
    writer.finish(rows, stop)?;
    Ok(())
}

/// Writes the surface as one PLY file: vertices that tiles share are there once.
pub(crate) fn surface(plan: &Plan, folder: Folder<'_>, stop: &Stop) -> Result<()> {
    let Some(path) = &plan.surface else { return Ok(()) };
    // The number of each shared vertex.
    let mut shared: FxHashMap<Key, u32> = FxHashMap::default();
    let (mut vertices, mut faces) = (0u64, 0u64);
    for tile in 0..plan.tiles.len() {
        let light = Light::read(folder, tile)?;
        faces += light.triangles.len() as u64;
        for (p, s) in light.positions.iter().zip(&light.shared) {
            if *s == 0 {
                vertices += 1;
            } else if let std::collections::hash_map::Entry::Vacant(new) = shared.entry(key(*p)) {
                new.insert(u32::MAX);
                vertices += 1;
            }
        }
    }
    if vertices >= u64::from(u32::MAX) {
        return Err(Error::refused(
            format!("the surface has {vertices} vertices, and one PLY file holds 4 thousand million"),
            "Ask for tiles (--tileset) instead",
        ));
    }
    let colored = plan.colors;
    store::whole(path, |out| {
        let colors =
            if colored { "property uchar red\nproperty uchar green\nproperty uchar blue\n" } else { "" };
        let head = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty double x\nproperty \
             double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float \
             nz\n{colors}element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        );
        out.bytes(head.as_bytes())?;
        let mut next = 0u32;
        let mut bytes = Vec::new();
        for tile in 0..plan.tiles.len() {
            stop.check("writing")?;
            let light = Light::read(folder, tile)?;
            for v in 0..light.positions.len() {
                if light.shared[v] == 1 {
                    let number = shared.entry(key(light.positions[v])).or_insert(u32::MAX);
                    if *number != u32::MAX {
                        continue;
                    }
                    *number = next;
                }
                next += 1;
                light.positions[v].iter().for_each(|x| x.put(&mut bytes));
                light.normals[v].iter().for_each(|x| x.put(&mut bytes));
                if colored {
                    bytes.extend(light.colors[v]);
                }
            }
            out.bytes(&bytes)?;
            bytes.clear();
        }
        let mut next = 0u32;
        let mut written: rustc_hash::FxHashSet<Key> = rustc_hash::FxHashSet::default();
        for tile in 0..plan.tiles.len() {
            stop.check("writing")?;
            let light = Light::read(folder, tile)?;
            let mut number = Vec::with_capacity(light.positions.len());
            for (p, s) in light.positions.iter().zip(&light.shared) {
                if *s == 1 {
                    number.push(shared[&key(*p)]);
                    if !written.insert(key(*p)) {
                        continue;
                    }
                } else {
                    number.push(next);
                }
                next += 1;
            }
            for t in &light.triangles {
                bytes.push(3);
                t.iter().for_each(|&v| number[v as usize].put(&mut bytes));
            }
            out.bytes(&bytes)?;
            bytes.clear();
        }
        Ok(())
    })
}

/// Writes what names the tiles of the surface: 3D Tiles 1.1, each tile with its levels of detail. Tiles are
/// where the scan's coordinates say, z up.
pub(crate) fn tileset(plan: &Plan, folder: Folder<'_>) -> Result<()> {
    let Some(path) = &plan.tileset else { return Ok(()) };
    let step = step(plan);
    let mut children = Vec::new();
    let mut whole = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let mut coarsest = 0.0f64;
    let mut lights = Vec::new();
    for tile in 0..plan.tiles.len() {
        let light = Light::read(folder, tile)?;
        if light.triangles.is_empty() {
            continue;
        }
        let own = extent(&light.positions);
        for k in 0..3 {
            whole[0][k] = whole[0][k].min(own[0][k]);
            whole[1][k] = whole[1][k].max(own[1][k]);
        }
        lights.push((tile, middle(&light.positions, step), own, light.errors));
    }
    if lights.is_empty() {
        return Err(Error::refused(
            "the scan makes no surface",
            "Give a denser scan, or set the noise by hand",
        ));
    }
    let origin: [f64; 3] = std::array::from_fn(|k| ((whole[0][k] + whole[1][k]) * 0.5 / step).round() * step);
    for (tile, middle, own, errors) in lights {
        coarsest = coarsest.max(errors[LEVELS.len() - 1]);
        // Levels lie in each other, the coarsest outside.
        let mut node: Option<Value> = None;
        for (level, error) in errors.into_iter().enumerate() {
            let error = if level == 0 { 0.0 } else { error };
            let mut of_level = json!({
                "boundingVolume": { "box": bounds(own, middle) },
                "geometricError": error,
                "refine": "REPLACE",
                "content": { "uri": format!("tiles/{tile:06}-{level}.glb") },
            });
            if let Some(finer) = node {
                of_level["children"] = json!([finer]);
            }
            node = Some(of_level);
        }
        if let Some(mut node) = node {
            let [x, y, z] = std::array::from_fn(|k| middle[k] - origin[k]);
            node["transform"] =
                json!([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0]);
            children.push(node);
        }
    }
    let [x, y, z] = origin;
    let tileset = json!({
        "asset": { "version": "1.1", "generator": concat!("atlasfit ", env!("CARGO_PKG_VERSION")) },
        "geometricError": 4.0 * coarsest,
        "root": {
            "transform": [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0],
            "boundingVolume": { "box": bounds(whole, origin) },
            "geometricError": 4.0 * coarsest,
            "refine": "ADD",
            "children": children,
        },
    });
    store::text(&path.join("tileset.json"), &format!("{tileset:#}\n"))
}

/// The box of an extent as the format has it: middle and half axes, from `origin`.
fn bounds([low, high]: [[f64; 3]; 2], origin: [f64; 3]) -> [f64; 12] {
    let mut out = [0.0; 12];
    for k in 0..3 {
        out[k] = (low[k] + high[k]) * 0.5 - origin[k];
        // A flat box would not be seen.
        out[3 + 4 * k] = ((high[k] - low[k]) * 0.5).max(1e-6);
    }
    out
}
