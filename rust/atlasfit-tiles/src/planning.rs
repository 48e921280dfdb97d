//! The plan is made.
//!
//! In: a scan in files, where the result goes. Out: the points in tiles on disk, each with those about it,
//! and `plan.json`, which says all that the tasks need.

use crate::cut::{Cells, Tree};
use crate::error::{Error, Result};
use crate::folder::{Folder, ROW_BYTES, Row};
use crate::plan::{Options, Plan, Scan, Tile, VERSION, absolute};
use crate::{store, tasks};
use atlasfit::pipeline::survey::{Survey, survey};
use atlasfit::{DenoiseOptions, Run, Stop};
use atlasfit_io::{RowBlock, Rows};
use std::path::{Path, PathBuf};

/// Points that are read at once.
const BLOCK: usize = 1 << 15;
/// Points of the sample that spacing and noise are taken from. A smaller scan is its own sample.
const SAMPLE: u64 = 200_000;
/// Windows of the sample.
const WINDOWS: u64 = 16;
/// Positions that the extent is taken from, at the most.
const SPREAD: usize = 1 << 20;
/// Bytes on disk for one point while the tasks run: where it goes, four triangles with two vertices, the
/// lighter surface. Measured, docs/scale.md.
const WORK_BYTES: u64 = 330;

/// What the plan is made from.
#[derive(Debug, Clone)]
pub struct Request {
    /// The scan's files.
    pub scans: Vec<PathBuf>,
    /// Folder of the work; made where it is not there.
    pub folder: PathBuf,
    /// The surface as one PLY file.
    pub surface: Option<PathBuf>,
    /// Folder of the denoised points, a file for each of the scan's.
    pub points: Option<PathBuf>,
    /// Folder of the surface in tiles (3D Tiles 1.1).
    pub tileset: Option<PathBuf>,
    /// Points of a tile at the most, without those about it.
    pub tile_points: u64,
    /// Whether the tiles of the surface get UVs and, of a coloured scan, a texture.
    pub uv: bool,
    /// How to denoise.
    pub options: DenoiseOptions,
}

/// What was found in one pass over the files.
struct Pass {
    scans: Vec<Scan>,
    cells: Cells,
    spread: Vec<[f64; 3]>,
    points: u64,
    not_finite: u64,
    colors: bool,
    notes: Vec<String>,
}

/// Makes the plan, and puts the points into tiles on disk. A plan that is there for the same request is
/// kept.
///
/// # Errors
/// [`Error`]: files that cannot be read, or that do not fit together; too little room on the disk; points
/// that are no surface; and where `run` is stopped.
pub fn plan(request: &Request, run: &mut Run<'_>, stop: &Stop) -> Result<Plan> {
    let request = &request.absolute()?;
    let folder = Folder(&request.folder);
    request.check_outputs()?;
    if let Ok(plan) = Plan::read(&request.folder)
        && plan.is_of(request, run.seed)
        && plan.check_scans().is_ok()
    {
        return Ok(plan);
    }
    let _lock = folder.take()?;
    folder.clear()?;
    let pass = pass(request, folder, stop)?;
    let known = known(request, folder, &pass, run, stop)?;
    let halo = known.halo();
    let tree = Tree::new(&mut pass.cells.sorted(), pass.cells.side(), request.tile_points.max(1))?;
    let tiles = distribute(folder, &tree, halo, stop)?;
    let _ = std::fs::remove_file(folder.raw());
    let mut plan = Plan {
        version: VERSION,
        options: request.options(run.seed),
        known,
        halo,
        not_finite: pass.not_finite,
        colors: pass.colors,
        tree,
        tiles,
        tile_points: request.tile_points,
        points: request.points.clone(),
        surface: request.surface.clone(),
        tileset: request.tileset.clone(),
        scans: pass.scans,
        notes: pass.notes,
        tasks: Vec::new(),
    };
    plan.tasks = tasks::of(&plan, &request.folder);
    let text =
        serde_json::to_string_pretty(&plan).map_err(|e| Error::refused(e.to_string(), "Report this"))?;
    store::text(&folder.plan(), &text)?;
    Ok(plan)
}

impl Request {
    /// The same with paths that mean the same from every folder.
    fn absolute(&self) -> Result<Self> {
        let whole = |path: &Option<PathBuf>| path.as_deref().map(absolute).transpose();
        Ok(Self {
            scans: self.scans.iter().map(|s| absolute(s)).collect::<Result<_>>()?,
            folder: absolute(&self.folder)?,
            surface: whole(&self.surface)?,
            points: whole(&self.points)?,
            tileset: whole(&self.tileset)?,
            ..self.clone()
        })
    }

    /// Fails where a result could not be written: the work before it may take days. Makes the folders.
    fn check_outputs(&self) -> Result<()> {
        // Any name tells whether a folder takes files.
        let folders = [&self.points, &self.tileset].into_iter().flatten().map(|f| f.join("tileset.json"));
        for output in self.surface.iter().cloned().chain(folders) {
            if output.starts_with(&self.folder) {
                return Err(Error::refused(
                    format!("{} lies in the work folder {}", output.display(), self.folder.display()),
                    "Give the results another folder, or the work (--work)",
                ));
            }
            store::make_folder_of(&output)?;
            atlasfit_io::check_output(&output)?;
        }
        Ok(())
    }

    fn options(&self, seed: u64) -> Options {
        let o = &self.options;
        Options {
            noise: o.noise,
            strength: o.strength,
            detail: o.detail,
            fill_holes: o.fill_holes,
            min_part: o.min_part,
            largest: o.largest,
            max_error: o.max_error,
            viewpoint: o.viewpoint,
            uv: self.uv,
            seed,
        }
    }
}

impl Plan {
    /// Whether this plan is what the request asks for.
    fn is_of(&self, request: &Request, seed: u64) -> bool {
        self.options == request.options(seed)
            && self.scans.iter().map(|s| &s.file).eq(&request.scans)
            && self.surface == request.surface
            && self.tileset == request.tileset
            && self.points == request.points
            && self.tile_points == request.tile_points
    }
}

/// Reads all files once: their points go to the disk as they are, and are counted where they lie.
fn pass(request: &Request, folder: Folder<'_>, stop: &Stop) -> Result<Pass> {
    let mut found = Pass {
        scans: Vec::new(),
        cells: Cells::default(),
        spread: Vec::new(),
        points: 0,
        not_finite: 0,
        colors: true,
        notes: Vec::new(),
    };
    let announced = announced(request, stop)?;
    let (all, with_halo) = (announced.iter().sum::<u64>(), 7 * announced.iter().sum::<u64>() / 5);
    folder.check_room(ROW_BYTES * (all + with_halo) + WORK_BYTES * all)?;
    let mut every = 1;
    store::whole(&folder.raw(), |out| {
        for (k, file) in request.scans.iter().enumerate() {
            let mut scan = Scan::of(file, 0)?;
            let mut rows = Rows::open(file, stop)?;
            if rows.is_held() {
                found.notes.push(format!(
                    "{}: files of this format are held in memory as a whole while they are read, and their \
                     denoised points are written as PLY",
                    file.display()
                ));
            }
            if let Some(points) = &request.points {
                scan.denoised = Some(points.join(name(file, k, rows.extension())));
            }
            let mut block = RowBlock::default();
            let mut bytes = Vec::new();
            while rows.next(BLOCK, &mut block, stop)? {
                found.cells.add(&block.positions);
                found.colors &= !block.colors.is_empty();
                bytes.clear();
                for (i, &position) in block.positions.iter().enumerate() {
                    let row = Row {
                        row: found.points + i as u64,
                        position,
                        color: block.colors.get(i).copied().unwrap_or_default(),
                        file: k as u16,
                    };
                    row.put(&mut bytes);
                    if !position.iter().all(|x| x.is_finite()) {
                        found.not_finite += 1;
                    } else if row.row.is_multiple_of(every) {
                        found.spread.push(position);
                        if found.spread.len() > SPREAD {
                            every *= 2;
                            let mut keep = [false, true].into_iter().cycle();
                            found.spread.retain(|_| keep.next().unwrap_or(true));
                        }
                    }
                }
                found.points += block.positions.len() as u64;
                scan.points += block.positions.len() as u64;
                out.bytes(&bytes)?;
            }
            scan.check()?;
            found.scans.push(scan);
        }
        Ok(())
    })?;
    Ok(found)
}

/// The name of a file's denoised points: that of the file, and its number where another has the same.
fn name(file: &Path, number: usize, extension: &str) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    format!("{number:04}-{stem}.{extension}")
}

/// How many points each file announces. Fails on files that do not fit together.
fn announced(request: &Request, stop: &Stop) -> Result<Vec<u64>> {
    if request.scans.len() > usize::from(u16::MAX) {
        return Err(Error::refused(format!("{} files", request.scans.len()), "Give 65535 at the most"));
    }
    let mut crs: Option<(PathBuf, Vec<u8>)> = None;
    let mut counts = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for file in &request.scans {
        let real = std::fs::canonicalize(file).map_err(|e| Error::io(file, "open it", e))?;
        if !seen.insert(real) {
            return Err(Error::refused(format!("{}: named twice", file.display()), "Name each file once"));
        }
        let rows = Rows::open(file, stop)?;
        counts.push(rows.count());
        match (&crs, rows.crs()) {
            (Some((other, known)), Some(own)) if known != own => {
                return Err(Error::refused(
                    format!("{} and {} are in different coordinate systems", other.display(), file.display()),
                    "Bring them into one first, for example with `pdal translate` and filters.reprojection",
                ));
            }
            (None, Some(own)) => crs = Some((file.clone(), own.to_vec())),
            _ => {}
        }
    }
    if counts.iter().sum::<u64>() == 0 {
        return Err(Error::refused("the scan has no points", "Give files with points on a surface"));
    }
    Ok(counts)
}

/// What is known of the whole, from windows of it.
fn known(
    request: &Request,
    folder: Folder<'_>,
    pass: &Pass,
    run: &mut Run<'_>,
    stop: &Stop,
) -> Result<Survey> {
    let points = pass.points;
    let windows = if points <= SAMPLE { Vec::new() } else { windows(pass) };
    let within = |p: &[f64; 3]| {
        windows.is_empty() || windows.iter().any(|w| (0..3).all(|k| (p[k] - w.middle[k]).abs() <= w.reach))
    };
    let mut sample = Vec::new();
    folder.each_raw(|rows| {
        stop.check("reading")?;
        sample.extend(rows.iter().map(|r| r.position).filter(|p| within(p)));
        Ok(())
    })?;
    Ok(survey(&sample, &pass.spread, points as usize, &request.options, run)?)
}

/// A cube of space.
struct Window {
    middle: [f64; 3],
    /// Half its side.
    reach: f64,
}

/// Windows of the scan that hold about as many points as the sample needs, where points are, evenly.
fn windows(pass: &Pass) -> Vec<Window> {
    let cells = pass.cells.sorted();
    let side = pass.cells.side();
    let all: u64 = cells.iter().map(|c| c.1).sum();
    let mut next = 0;
    let mut before = 0;
    let mut found = Vec::new();
    for (cell, n) in &cells {
        before += n;
        if before * WINDOWS < all * next + all / 2 {
            continue;
        }
        next += 1;
        let around = |reach: u64| -> u64 {
            let near = |c: &&([i64; 3], u64)| (0..3).all(|k| c.0[k].abs_diff(cell[k]) <= reach);
            cells.iter().filter(near).map(|c| c.1).sum()
        };
        let mut reach = 0u64;
        while around(reach) < SAMPLE / WINDOWS {
            reach = reach.saturating_mul(2).max(1);
        }
        // Between the last two: too many points take long, too few say little.
        let mut low = reach / 2;
        while reach - low > 1 {
            let middle = low + (reach - low) / 2;
            if around(middle) < SAMPLE / WINDOWS { low = middle } else { reach = middle }
        }
        let middle = cell.map(|c| (c as f64 + 0.5) * side);
        found.push(Window { middle, reach: (reach as f64 + 0.5) * side });
    }
    found
}

/// Writes each point to the tiles that are computed with it.
fn distribute(folder: Folder<'_>, tree: &Tree, halo: f64, stop: &Stop) -> Result<Vec<Tile>> {
    let n = tree.tiles();
    let mut tiles = vec![Tile { own: 0, with_halo: 0, files: Vec::new() }; n];
    let mut buffers: Vec<Vec<u8>> = vec![Vec::new(); n];
    // All buffers together stay within this.
    let each = (BUFFERS / n).clamp(4 * ROW_BYTES as usize, 1 << 20);
    folder.make_tiles(n)?;
    folder.each_raw(|rows| {
        stop.check("writing")?;
        for row in rows.iter().filter(|r| r.position.iter().all(|x| x.is_finite())) {
            let own = tree.of(row.position) as usize;
            tiles[own].own += 1;
            if tiles[own].files.last() != Some(&u32::from(row.file)) {
                tiles[own].files.push(u32::from(row.file));
            }
            let mut full = Vec::new();
            tree.near(row.position, halo, |t| {
                tiles[t as usize].with_halo += 1;
                row.put(&mut buffers[t as usize]);
                if buffers[t as usize].len() >= each {
                    full.push(t as usize);
                }
            });
            for t in full {
                folder.append_tile(t, &buffers[t])?;
                buffers[t].clear();
            }
        }
        Ok(())
    })?;
    for (t, buffer) in buffers.iter().enumerate() {
        folder.append_tile(t, buffer)?;
    }
    Ok(tiles)
}

/// Bytes of all buffers.
const BUFFERS: usize = 256 << 20;
