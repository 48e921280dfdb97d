//! `atlasfit unwrap`: UVs for a mesh; its geometry and the order of its vertices and faces stay as they are.

mod args;
mod constraints;
mod page;
mod report;
mod textures;

use crate::console::{Console, Usage};
use crate::files::{self, Kept};
use crate::output::{self, Writer, Written};
use anyhow::Result;
pub use args::{Args, packing};
use args::{Packer, Stack, Straighten};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::{Pages, uv_on};
use atlasfit::measure::{self, UvQuality};
use atlasfit::unwrap::{self, PagePacker, UnwrapOptions, UvLayout};
use atlasfit_io::{Asset, Format, Polygons};
use page::Unwrapped;
use report::Done;
use std::path::Path;
use std::time::Instant;

/// The external packer, if one is asked for.
fn external_packer(packer: Packer) -> Result<Option<&'static dyn PagePacker>> {
    if packer != Packer::Xatlas {
        return Ok(None);
    }
    let xatlas = atlasfit_native::xatlas().ok_or_else(|| {
        Usage(
            "this program was built without xatlas. Build it with \
             `cargo build --release -p atlasfit-cli --features xatlas` \
             (needs a C++ compiler and libclang), or use --packer shapes"
                .into(),
        )
    })?;
    Ok(Some(xatlas))
}

/// Shares of the command's time, for the bar: until the files are read, until the mesh is unwrapped, until
/// the UVs are measured, until the texture is baked. Measured on a mesh of 45,000 faces.
const UNTIL: [f64; 4] = [0.03, 0.85, 0.93, 0.97];

/// Unwraps.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let outputs: Vec<_> = [args.output()].into_iter().chain(args.page()).collect();
    output::check(&outputs, &args.inputs(), args.write, console)?;
    let packer = external_packer(args.packer)?;
    let started = Instant::now();
    console.part_to(UNTIL[0]);
    let Kept { mut loaded, asset } = load(args, console)?;
    let bake = textures::of(args, &mut loaded, asset.as_ref(), console)?;
    if args.stack != Stack::None && !bake.is_none() {
        let wrong = "stacked parts share their texels, so no texture of one's own can be baked for each: add \
                     --bake-from none, or leave out --stack";
        return Err(Usage(wrong.into()).into());
    }
    let asset = asset.filter(|asset| bake.keeps_materials(asset));
    let asset = textures::kept(args, &loaded, asset, console)?;
    let polygons = loaded.polygons.take();
    let mut mesh = loaded.into_mesh();
    let page = bake.page(&mesh, args, console)?;
    let options = options(args, &mesh, polygons.as_ref())?
        .with_page_size(page.size)
        .with_padding_px(page.padding)
        .with_pages(if bake.is_none() { args.pages } else { Some(1) });
    console.part_to(UNTIL[1]);
    let (mut layout, stages) = console.start(&args.run).execute(|ctx| {
        // The layout is measured afterwards: no run ends there for want of memory.
        let needed = measure::memory_needed(mesh.positions.len(), mesh.triangles.len(), ctx.threads());
        ctx.reserve(needed, "Raise the limit, or simplify the mesh")?;
        let layout = match packer {
            Some(packer) => unwrap::unwrap_with(&mesh, &options, packer, ctx)?,
            None => unwrap::unwrap(&mesh, &options, ctx)?,
        };
        Ok((layout, ctx.stage_seconds()))
    })?;
    console.part_to(UNTIL[2]);
    page.enlarge(&mut layout, console);
    let quality = lay_on(&mut mesh, &layout, args, console)?;
    report::notes(&layout, &options, console);
    console.part_to(UNTIL[3]);
    let size = [layout.width, layout.height];
    let pages = textures::baked(&mut mesh, &bake, size, args, console)?;
    let done = Done {
        path: &args.mesh,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        polygons: polygons.as_ref().map(|p| p.sizes.len()),
        layout: &layout,
        quality: &quality,
        seconds: started.elapsed().as_secs_f64(),
        stages: &stages,
        files: &[],
    };
    let page = if args.report.is_some() {
        let facts = done.facts();
        let unwrapped = Unwrapped {
            mesh: &mesh,
            page: size,
            bound: layout.stretch_bound,
            stages: &stages,
            name: files::name(&args.mesh),
        };
        Some(console.start(&args.run).execute(|ctx| page::page(&unwrapped, &facts, console, ctx))?)
    } else {
        None
    };
    let results =
        Results { mesh: &mesh, polygons: polygons.as_ref(), pages: &pages, report: page.as_deref() };
    let written = save(&results, asset.as_ref(), args, console)?;
    let done = Done { seconds: started.elapsed().as_secs_f64(), files: &written.files, ..done };
    console.report(&done.text(), &done.json());
    Ok(())
}

/// Reads the mesh; points alone are refused.
fn load(args: &Args, console: &Console) -> Result<Kept> {
    let output = args.output().format(args.write)?;
    // A glTF file is read as it is kept: only where it is.
    let replaced = args.bake || args.baked_file().is_some() || args.output == Path::new(files::STANDARD);
    let output = (output != Format::Gltf || !replaced).then_some(output);
    let kept = files::load_kept(&args.mesh, args.read.input_format, output, &args.run, console)?;
    if kept.loaded.faces.is_empty() {
        return Err(Usage(format!(
            "{} has no faces: only a mesh can be unwrapped. Make a surface of points with denoise",
            args.mesh.display()
        ))
        .into());
    }
    Ok(kept)
}

/// The core's options.
fn options(args: &Args, mesh: &TriMesh, polygons: Option<&Polygons>) -> Result<UnwrapOptions> {
    let for_charts = args.max_stretch.is_some() || args.max_energy.is_some() || args.max_charts.is_some();
    if args.pack_only && for_charts {
        let wrong =
            "the charts are kept: leave out --max-stretch, --max-energy and --max-charts, or unwrap anew";
        return Err(Usage(wrong.into()).into());
    }
    let of_triangle = polygons.map(Polygons::of_triangles);
    let groups = args.groups.as_deref().map(|p| constraints::groups(p, mesh, of_triangle.as_deref()));
    let packer = match args.packer {
        Packer::Boxes => unwrap::Packer::Boxes,
        Packer::Shapes | Packer::Xatlas => unwrap::Packer::Shapes,
    };
    Ok(UnwrapOptions::default()
        .with_max_stretch(args.max_stretch.unwrap_or(args.preset.max_stretch()))
        .with_max_energy(args.max_energy)
        .with_max_charts(args.max_charts)
        .with_texels_per_unit(args.density)
        .with_packer(packer)
        .with_stack(match args.stack {
            Stack::None => unwrap::Stack::None,
            Stack::Identical => unwrap::Stack::Identical,
            Stack::Mirrored => unwrap::Stack::Mirrored,
        })
        .with_straighten(match args.straighten {
            Straighten::Auto => unwrap::Straighten::Auto,
            Straighten::Off => unwrap::Straighten::Off,
        })
        .with_face_group(groups.transpose()?)
        .with_seam_edges(args.seams.as_deref().map(|p| constraints::seams(p, mesh)).transpose()?)
        .with_seams_hidden(args.seams_hidden)
        .with_up(args.up)
        .with_seam_price(args.seam_price.as_deref().map(|name| constraints::prices(name, mesh)).transpose()?)
        .with_face_polygon(of_triangle)
        .with_keep_uv_seams(args.keep_uv_seams)
        .with_keep_uvs(args.pack_only)
        .with_hard_edge_angle(args.hard_edges))
}

/// Gives the mesh its UVs, pages side by side, and measures them.
fn lay_on(mesh: &mut TriMesh, layout: &UvLayout, args: &Args, console: &Console) -> Result<UvQuality> {
    mesh.corner_uv = Some(layout.corner_uv.clone());
    mesh.face_chart = Some(layout.face_chart.clone());
    let pages =
        Pages { of_face: Some(&layout.face_page), size: [layout.width, layout.height].map(f64::from) };
    let quality = console.start(&args.run).execute(|ctx| uv_on(mesh, &pages, ctx))?;
    if layout.pages > 1 {
        mesh.corner_uv = Some(layout.side_by_side());
    }
    Ok(quality)
}

/// What is written.
struct Results<'a> {
    mesh: &'a TriMesh,
    polygons: Option<&'a Polygons>,
    /// The new images as PNG files, one per layer of the mesh's file, or one.
    pages: &'a [Vec<u8>],
    /// The page of --report.
    report: Option<&'a [u8]>,
}

/// Writes the mesh with its textures. What the format cannot hold is a note.
fn save(results: &Results<'_>, asset: Option<&Asset>, args: &Args, console: &Console) -> Result<Written> {
    console.part_to(1.0);
    let Results { mesh, polygons, pages, report } = *results;
    let mut writer = Writer::new(args.write, &args.run, console);
    match asset {
        Some(asset) => writer.asset(args.output(), asset, mesh, polygons, pages)?,
        None => {
            let kept = |lost: &str| lost.starts_with("chart numbers");
            writer.mesh(args.output(), mesh, polygons, pages.first().map(Vec::as_slice), kept)?;
        }
    }
    if let (Some(output), Some(page)) = (args.page(), report) {
        writer.bytes(output, page)?;
    }
    Ok(writer.written)
}
