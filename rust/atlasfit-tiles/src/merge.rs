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
/// Rows of all tiles together that are held until it is their turn.
const ROWS: u64 = 1 << 20;

/// Where the points of a tile go, in the order of their rows. The file is opened anew for each piece: a
/// process may have a thousand files open, and a scan many more tiles.
struct Moved {
    path: PathBuf,
    /// Rows of the file, and those that were read.
    rows: u64,
    read: u64,
    /// Rows that are read at once.
    most: u64,
    /// The next ones, the first last.
    next: Vec<(u64, [f64; 3])>,
}

impl Moved {
    fn open(folder: Folder<'_>, tile: usize, most: u64) -> Result<Self> {
        let path = folder.moved(tile);
        let io = |e| Error::io(&path, "read it", e);
        let mut count = [0; 8];
        File::open(&path).and_then(|mut file| file.read_exact(&mut count)).map_err(io)?;
        let mut moved = Self { rows: u64::from_le_bytes(count), read: 0, most, next: Vec::new(), path };
        moved.fill()?;
        Ok(moved)
    }
    fn fill(&mut self) -> Result<()> {
        if !self.next.is_empty() || self.read == self.rows {
            return Ok(());
        }
        let n = (self.rows - self.read).min(self.most);
        let io = |e| Error::io(&self.path, "read it", e);
        let mut file = File::open(&self.path).map_err(io)?;
        let mut bytes = |at: u64, length: u64| {
            let mut bytes = vec![0; length as usize];
            file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut bytes)).map_err(io)?;
            Ok::<_, Error>(bytes)
        };
        // Each list has its length before it.
        let rows = bytes(8 + 8 * self.read, 8 * n)?;
        let places = bytes(8 + 8 * self.rows + 8 + 24 * self.read, 24 * n)?;
        let place = |p: &[u8]| [0, 8, 16].map(|at| f64::get(&p[at..]));
        self.next = rows.chunks_exact(8).map(u64::get).zip(places.chunks_exact(24).map(place)).collect();
        self.next.reverse();
        self.read += n;
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
    let of_file: Vec<usize> = of_file.map(|(k, _)| k).collect();
    let most = (ROWS / of_file.len().max(1) as u64).clamp(64, 4096);
    let mut tiles = of_file.iter().map(|&k| Moved::open(folder, k, most)).collect::<Result<Vec<_>>>()?;
    let mut heap = std::collections::BinaryHeap::new();
    for (k, tile) in tiles.iter_mut().enumerate() {
        // Points of the files before.
        while tile.row().is_some_and(|r| r < before) {
            tile.take()?;
        }
        heap.extend(tile.row().map(|r| std::cmp::Reverse((r, k))));
    }
    store::make_folder_of(path)?;
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

/// Numbers of the vertices of all tiles, one tile after the other: those that tiles share have one.
#[derive(Default)]
struct Numbers {
    shared: FxHashMap<Key, u64>,
    next: u64,
}

impl Numbers {
    /// For each vertex of the next tile its number, and whether no tile before has it. Counted anew from 0,
    /// the tiles get the same numbers again.
    fn of(&mut self, tile: &Light) -> Vec<(u64, bool)> {
        let number = |(p, shared): (&[f64; 3], &u8)| {
            let number =
                if *shared == 1 { *self.shared.entry(key(*p)).or_insert(self.next) } else { self.next };
            let is_new = number == self.next;
            self.next += u64::from(is_new);
            (number, is_new)
        };
        tile.positions.iter().zip(&tile.shared).map(number).collect()
    }
}

/// Writes the surface as one PLY file: vertices that tiles share are there once.
pub(crate) fn surface(plan: &Plan, folder: Folder<'_>, stop: &Stop) -> Result<()> {
    let Some(path) = &plan.surface else { return Ok(()) };
    let tile = |tile| {
        stop.check("writing")?;
        Light::read(folder, tile)
    };
    let tiles = 0..plan.tiles.len();
    let (mut numbers, mut faces) = (Numbers::default(), 0);
    for k in tiles.clone() {
        let light = tile(k)?;
        faces += light.triangles.len();
        numbers.of(&light);
    }
    let vertices = numbers.next;
    // Many programs read them with a sign.
    if vertices > i32::MAX as u64 {
        return Err(Error::refused(
            format!("the surface has {vertices} vertices, and one PLY file names 2147483647"),
            "Ask for tiles (--tileset) instead",
        ));
    }
    store::whole(path, |out| {
        let colors =
            if plan.colors { "property uchar red\nproperty uchar green\nproperty uchar blue\n" } else { "" };
        let head = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty double x\nproperty \
             double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float \
             nz\n{colors}element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        );
        out.bytes(head.as_bytes())?;
        let mut bytes = Vec::new();
        numbers.next = 0;
        for k in tiles.clone() {
            let light = tile(k)?;
            for (v, (_, is_new)) in numbers.of(&light).into_iter().enumerate() {
                if !is_new {
                    continue;
                }
                light.positions[v].iter().for_each(|x| x.put(&mut bytes));
                light.normals[v].iter().for_each(|x| x.put(&mut bytes));
                if plan.colors {
                    bytes.extend(light.colors[v]);
                }
            }
            out.bytes(&bytes)?;
            bytes.clear();
        }
        numbers.next = 0;
        for k in tiles {
            let light = tile(k)?;
            let number = numbers.of(&light);
            for t in &light.triangles {
                bytes.push(3);
                t.iter().for_each(|&v| (number[v as usize].0 as u32).put(&mut bytes));
            }
            out.bytes(&bytes)?;
            bytes.clear();
        }
        Ok(())
    })
}

/// Writes what names the tiles of the surface: 3D Tiles 1.1, each tile with its levels of detail. Tiles are
/// where the scan's coordinates say, z up.
pub(crate) fn tileset(plan: &Plan, folder: Folder<'_>, stop: &Stop) -> Result<()> {
    let Some(path) = &plan.tileset else { return Ok(()) };
    let step = step(plan);
    let mut children = Vec::new();
    let mut whole = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let mut coarsest = 0.0f64;
    let mut lights = Vec::new();
    for tile in 0..plan.tiles.len() {
        stop.check("writing")?;
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
