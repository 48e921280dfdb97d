//! A tile's surface made ready: turned, joined to its neighbours, lighter, with UVs and texture.
//!
//! In: the tile's own triangles, what was decided for it. Out: the lighter surface on a grid of lengths that
//! all tiles share, so that vertices at which tiles meet are equal in every file; GLB files, a level of
//! detail each. Vertices where the tile ends stay on every level.

use crate::error::{Error, Result};
use crate::folder::Folder;
use crate::job::{self, Key, Seam, compact, cross, dot, key, sub};
use crate::plan::Plan;
use crate::seams::Decided;
use crate::store;
use atlasfit::bake::{BakeOptions, Colors, Image, bake, side_for};
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::pipeline::tile::{TileSurface, simplify_tile};
use atlasfit::pipeline::uv_options;
use atlasfit::unwrap::unwrap;
use atlasfit::{DenoiseOptions, Run, Stop};
use atlasfit_io::{SaveMesh, Texture, discard_begun, save_mesh};
use rustc_hash::{FxHashMap, FxHashSet};
use std::path::Path;

/// How far coarser levels may move and how long their edges get, as multiples of the finest level's.
pub(crate) const LEVELS: [f32; 3] = [1.0, 4.0, 16.0];
/// Steps of the grid of lengths in a spacing, at the least.
const STEPS: f64 = 1024.0;
/// Points from which a vertex has its colour.
const NEAREST: usize = 4;

/// A tile's surface as it is written.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Light {
    /// In the user's frame.
    pub positions: Vec<[f64; 3]>,
    pub normals: Vec<[f32; 3]>,
    /// Red, green and blue; none of a scan without.
    pub colors: Vec<[u8; 3]>,
    /// Whether other tiles have the vertex too.
    pub shared: Vec<u8>,
    pub triangles: Vec<[u32; 3]>,
    /// How far the surface of each level may be from the finest as it is contoured.
    pub errors: [f64; LEVELS.len()],
}

/// Makes a tile's surface ready.
pub(crate) fn run(
    plan: &Plan,
    folder: Folder<'_>,
    tile: usize,
    run: &mut Run<'_>,
    stop: &Stop,
) -> Result<()> {
    let mesh = job::read_mesh(folder, tile)?;
    let seam = Seam::read(folder, tile)?;
    let (surface, ends) = joined(plan, mesh, &seam, &Decided::read(folder, tile)?);
    let pinned = pinned(&surface, &ends);
    let cloud = if plan.colors { Some(colored(folder, tile)?) } else { None };
    let mut finest = Light::default();
    // That of the finest level, for all.
    let mut origin = None;
    let last = if plan.tileset.is_some() { LEVELS.len() } else { 1 };
    for (level, share) in LEVELS.into_iter().enumerate().take(last) {
        let light = run.execute(|ctx| simplify_tile(&surface, &pinned, share, ctx))?;
        let mesh = placed(plan, &light);
        let error = share * surface.error.iter().copied().fold(0.0, f32::max);
        finest.errors[level] = f64::from(error) * plan.known.scale;
        let origin = *origin.get_or_insert_with(|| middle(&mesh.positions, step(plan)));
        if let Some(path) = plan.glb(tile, level) {
            write_glb(plan, &path, origin, mesh.clone(), cloud.as_ref(), run, stop)?;
        }
        if level == 0 {
            let shared: FxHashSet<_> =
                (0..ends.len()).filter(|&v| ends[v]).map(|v| key(surface.positions[v])).collect();
            let of = |p: &[f64; 3]| u8::from(shared.contains(&key(*p)));
            finest.shared = light.positions.iter().map(of).collect();
            if let Some(cloud) = &cloud {
                finest.colors = colors(&mesh, cloud, run)?;
            }
            finest.positions = mesh.positions;
            finest.normals = mesh.normals.unwrap_or_default();
            finest.triangles = mesh.triangles;
        }
    }
    finest.write(folder, tile)
}

/// Which vertices stay when the surface gets lighter: those where it `ends` at other tiles, and their
/// neighbours: else both sides could get an edge between the same two ends, which would have four triangles.
fn pinned(s: &TileSurface, ends: &[bool]) -> Vec<bool> {
    let mut pinned = ends.to_vec();
    for t in s.triangles.iter().filter(|t| t.iter().any(|&v| ends[v as usize])) {
        t.iter().for_each(|&v| pinned[v as usize] = true);
    }
    pinned
}

/// The tile's surface with what was decided for it, and at which of its vertices it ends at other tiles.
/// Those that come to one place of the grid are one, as they are for the tiles beside it: triangles between
/// them have no area, and go.
fn joined(plan: &Plan, mut s: TileSurface, seam: &Seam, decided: &Decided) -> (TileSurface, Vec<bool>) {
    let of = |part: u32| decided.parts.get(part as usize).copied().unwrap_or(2);
    let ends = seam.cut.iter().flat_map(|e| e.at).map(key).collect::<FxHashSet<_>>();
    // The vertex at each place where the tile ends.
    let mut at: FxHashMap<Key, u32> = FxHashMap::default();
    let mut joined: Vec<u32> = (0..s.positions.len() as u32).collect();
    for (v, p) in s.positions.iter().enumerate().filter(|(_, p)| ends.contains(&key(**p))) {
        joined[v] = *at.entry(key(on_grid(plan, *p))).or_insert(v as u32);
    }
    s.triangles.iter_mut().flatten().for_each(|v| *v = joined[*v as usize]);
    for (places, part) in &decided.closing {
        let n = cross(sub(places[1], places[0]), sub(places[2], places[0]));
        let length = dot(n, n).sqrt().max(f64::MIN_POSITIVE);
        let (error, longest) = (s.error.first().copied(), s.longest.first().copied());
        let triangle = places.map(|p| {
            *at.entry(key(on_grid(plan, p))).or_insert_with(|| {
                s.positions.push(p);
                s.normals.push(n.map(|x| (x / length) as f32));
                s.part.push(*part);
                s.error.push(error.unwrap_or(0.0));
                s.longest.push(longest.unwrap_or(0.0));
                s.positions.len() as u32 - 1
            })
        });
        s.triangles.push(triangle);
    }
    s.triangles.retain(|&[a, b, c]| of(s.part[a as usize]) != 2 && a != b && b != c && c != a);
    for t in &mut s.triangles {
        if of(s.part[t[0] as usize]) == 1 {
            t.swap(1, 2);
        }
    }
    for (n, &part) in s.normals.iter_mut().zip(&s.part) {
        if of(part) == 1 {
            *n = n.map(|x| -x);
        }
    }
    let ends: FxHashSet<Key> = at.values().map(|&v| key(s.positions[v as usize])).collect();
    let s = compact(s);
    let ends = s.positions.iter().map(|p| ends.contains(&key(*p))).collect();
    (s, ends)
}

/// The tile's coloured points and those about it.
fn colored(folder: Folder<'_>, tile: usize) -> Result<PointCloud> {
    let rows = folder.rows(tile)?;
    let mut cloud = PointCloud::from_positions(rows.iter().map(|r| r.position).collect());
    let full = |c: u16| f32::from(c) / 65535.0;
    cloud.colors =
        Some(rows.iter().map(|r| [full(r.color[0]), full(r.color[1]), full(r.color[2]), 1.0]).collect());
    Ok(cloud)
}

/// The surface in the user's frame, on the grid of lengths.
fn placed(plan: &Plan, s: &TileSurface) -> TriMesh {
    let mut mesh = TriMesh::new(s.positions.iter().map(|p| on_grid(plan, *p)).collect(), s.triangles.clone());
    mesh.normals = Some(s.normals.clone());
    mesh
}

/// A place of the normalised frame in the user's, on the grid of lengths.
fn on_grid(plan: &Plan, p: [f64; 3]) -> [f64; 3] {
    let step = step(plan);
    plan.known.to_user(p).map(|x| (x / step).round() * step)
}

/// The step of the grid of lengths that vertices lie on, in the user's unit: a power of two.
pub(crate) fn step(plan: &Plan) -> f64 {
    (plan.known.spacing * plan.known.scale / STEPS).log2().floor().exp2()
}

/// Colours of the vertices, each of the points next to it.
fn colors(mesh: &TriMesh, cloud: &PointCloud, run: &mut Run<'_>) -> Result<Vec<[u8; 3]>> {
    let Some(colors) = &cloud.colors else { return Ok(Vec::new()) };
    if mesh.positions.is_empty() || cloud.positions.is_empty() {
        return Ok(vec![[0; 3]; mesh.positions.len()]);
    }
    let found = run.execute(|ctx| {
        let tree = atlasfit::spatial::Neighbours::build(atlasfit::numeric::vec3::of(&cloud.positions), ctx)?;
        let mut found = Vec::new();
        let mut out = Vec::with_capacity(mesh.positions.len());
        for (i, &p) in mesh.positions.iter().enumerate() {
            if i % 256 == 0 {
                ctx.check()?;
            }
            tree.nearest(atlasfit::Vec3(p), NEAREST, &mut found);
            let mean = |k: usize| {
                let sum: f32 = found.iter().map(|f| colors[f.index as usize][k]).sum();
                (255.0 * sum / found.len() as f32).round() as u8
            };
            out.push([mean(0), mean(1), mean(2)]);
        }
        Ok(out)
    })?;
    Ok(found)
}

/// Writes a level of detail as GLB, with UVs and texture where they are wanted. Tiles of the format have y
/// up within a file and z up among each other; positions are small, from `origin`.
fn write_glb(
    plan: &Plan,
    path: &Path,
    origin: [f64; 3],
    mut mesh: TriMesh,
    cloud: Option<&PointCloud>,
    run: &mut Run<'_>,
    stop: &Stop,
) -> Result<()> {
    if mesh.triangles.is_empty() {
        return Ok(());
    }
    let mut png = None;
    if plan.options.uv {
        let side = side_for(mesh.positions.len()).min(4096);
        let options = uv_options(&DenoiseOptions::default().with_texture_size(side));
        let layout = run.execute(|ctx| unwrap(&mesh, &options, ctx))?;
        mesh.corner_uv = Some(layout.corner_uv);
        if let Some(cloud) = cloud {
            let how = BakeOptions::default().with_size([side; 2]);
            png = Some(encoded(&run.execute(|ctx| bake(&mesh, Colors::Points(cloud), &how, ctx))?)?);
        }
    }
    for p in &mut mesh.positions {
        let [x, y, z] = sub(*p, origin);
        *p = [x, z, -y];
    }
    for n in mesh.normals.iter_mut().flatten() {
        *n = [n[0], n[2], -n[1]];
    }
    store::make_folder_of(path)?;
    let mut how = SaveMesh::default().with_texture(png.as_deref().map(Texture::Png));
    how.stop = stop.clone();
    save_mesh(path, &mesh, &how)?;
    discard_begun(path);
    Ok(())
}

/// The middle of positions, on the grid of lengths.
pub(crate) fn middle(positions: &[[f64; 3]], step: f64) -> [f64; 3] {
    let [low, high] = extent(positions);
    std::array::from_fn(|k| ((low[k] + high[k]) * 0.5 / step).round() * step)
}

/// The least and the greatest coordinates.
pub(crate) fn extent(positions: &[[f64; 3]]) -> [[f64; 3]; 2] {
    positions.iter().fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
        [std::array::from_fn(|k| f64::min(low[k], p[k])), std::array::from_fn(|k| f64::max(high[k], p[k]))]
    })
}

/// An image as the bytes of a PNG file.
fn encoded(image: &Image) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let rgb: Vec<u8> = image.rgba.iter().flat_map(|c| [c[0], c[1], c[2]]).collect();
    let wrong =
        |e: png::EncodingError| Error::refused(format!("cannot encode the texture: {e}"), "Report this");
    let mut writer = encoder.write_header().map_err(wrong)?;
    writer.write_image_data(&rgb).map_err(wrong)?;
    writer.finish().map_err(wrong)?;
    Ok(bytes)
}

impl Light {
    fn write(&self, folder: Folder<'_>, tile: usize) -> Result<()> {
        store::whole(&folder.light(tile), |out| {
            out.column(&self.positions)?;
            out.column(&self.normals)?;
            out.column(&self.colors)?;
            out.list(&self.shared)?;
            out.column(&self.triangles)?;
            out.list(&self.errors)
        })
    }
    pub fn read(folder: Folder<'_>, tile: usize) -> Result<Self> {
        let path = folder.light(tile);
        let mut from = store::Reader::open(&path)?;
        Ok(Self {
            positions: from.column()?,
            normals: from.column()?,
            colors: from.column()?,
            shared: from.list()?,
            triangles: from.column()?,
            errors: from.list()?.try_into().map_err(|_| Error::damaged(&path))?,
        })
    }
}
