//! `atlasfit unwrap`: UVs for a mesh; its geometry and the order of its vertices and faces stay as they are.

use crate::console::{Console, RunArgs, Usage};
use crate::files;
use crate::number::{count, json as number, seconds, short, stages_json};
use anyhow::{Context as _, Result};
use atlasfit::bake::{BakeOptions, Colors, bake};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::{Pages, uv_on};
use atlasfit::unwrap::{self, PagePacker, UnwrapOptions, UvLayout};
use atlasfit_io::{Format, SaveMesh, Texture, save_mesh};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `unwrap`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The mesh
    mesh: PathBuf,
    /// The mesh to write, with its UVs; its extension decides the format
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Write text where the format has both text and binary
    #[arg(long)]
    ascii: bool,
    /// Bound on the stretch of 95% of the area: 1.1 = lengths within about 10%. Larger gives fewer charts
    #[arg(long, default_value_t = UnwrapOptions::default().max_stretch, value_name = "FACTOR", help_heading = "Charts")]
    max_stretch: f64,
    /// Most charts: the stretch bound is raised as far as that needs
    #[arg(long, value_name = "N", help_heading = "Charts")]
    max_charts: Option<usize>,
    /// Keep the seams of the UVs that the mesh has
    #[arg(long, help_heading = "Charts")]
    keep_uv_seams: bool,
    /// Cut where faces meet at more than this angle
    #[arg(long, value_name = "DEGREES", help_heading = "Charts")]
    hard_edges: Option<f64>,
    /// Text file with one whole number per face of the mesh: no chart spans two
    #[arg(long, value_name = "FILE", help_heading = "Charts")]
    groups: Option<PathBuf>,
    /// Text file with two vertex numbers per line, counted from 0: these edges become seams
    #[arg(long, value_name = "FILE", help_heading = "Charts")]
    seams: Option<PathBuf>,
    /// Page size in texels
    #[arg(long, default_value = "1024", value_name = "SIZE|WxH", value_parser = size, help_heading = "Pages")]
    texture_size: [u32; 2],
    /// Free texels between charts and at the border
    #[arg(long, default_value_t = UnwrapOptions::default().padding_px, value_name = "TEXELS", help_heading = "Pages")]
    padding: u32,
    /// Texels per unit of length on the mesh; where it is not given, what fills the pages
    #[arg(long, value_name = "TEXELS", help_heading = "Pages")]
    density: Option<f64>,
    /// Most pages; with several, page p lies at u + p (UDIM tiles 1001, 1002, ...)
    #[arg(long, value_name = "N", help_heading = "Pages")]
    pages: Option<u32>,
    /// How charts are put on the page
    #[arg(long, value_enum, default_value = "shapes", help_heading = "Pages")]
    packer: Packer,
    /// Write a texture with the colours of the mesh's vertices, which it then replaces
    #[arg(long, help_heading = "Texture", conflicts_with_all = ["pages", "bake_from"])]
    bake: bool,
    /// Write a texture with the colours of these points, which lie on the mesh
    #[arg(long, value_name = "SCAN", help_heading = "Texture", conflicts_with = "pages")]
    bake_from: Option<PathBuf>,
    #[command(flatten)]
    run: RunArgs,
}

/// How charts are put on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Packer {
    /// By their shapes, in each other's bays and holes
    Shapes,
    /// By their bounding boxes, in rows: fastest
    Boxes,
    /// By xatlas, on square pages, where the program was built with it
    Xatlas,
}

/// The packer that is no part of the core, if one is asked for.
fn outside(packer: Packer) -> Result<Option<&'static dyn PagePacker>> {
    if packer != Packer::Xatlas {
        return Ok(None);
    }
    let xatlas = atlasfit_native::xatlas().ok_or_else(|| {
        Usage(
            "this program was built without xatlas. Build it with `cargo build --release -p atlasfit-cli --features xatlas` \
             (needs a C++ compiler and libclang), or use --packer shapes"
                .into(),
        )
    })?;
    Ok(Some(xatlas))
}

fn size(s: &str) -> Result<[u32; 2], String> {
    let side = |t: &str| t.parse::<u32>().ok().filter(|n| (16..=65536).contains(n));
    match s.split_once('x') {
        None => side(s).map(|n| [n, n]),
        Some((w, h)) => side(w).zip(side(h)).map(|(w, h)| [w, h]),
    }
    .ok_or_else(|| "give SIZE or WIDTHxHEIGHT in texels, each from 16 to 65536".into())
}

/// Unwraps.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let format = files::output_format(&args.output)?;
    if !matches!(format, Format::Ply | Format::Obj | Format::Gltf) {
        return Err(Usage(format!(
            "{}: {} files hold no UVs. Use .ply, .obj or .glb",
            args.output.display(),
            format.name()
        ))
        .into());
    }
    let outside = outside(args.packer)?;
    let started = Instant::now();
    let mut loaded = files::load(&args.mesh, &args.run, console)?;
    if loaded.faces.is_empty() {
        return Err(Usage(format!(
            "{} has no faces: only a mesh can be unwrapped. Make a surface of points with denoise",
            args.mesh.display()
        ))
        .into());
    }
    let polygons = loaded.polygons.take();
    let mut mesh = loaded.into_mesh();
    let of_triangle = polygons.as_ref().map(atlasfit_io::Polygons::of_triangles);
    if args.bake && mesh.colors.is_none() {
        return Err(Usage(format!(
            "{} has no colours to bake. Give a coloured mesh, or a scan with --bake-from",
            args.mesh.display()
        ))
        .into());
    }
    let options = UnwrapOptions {
        max_stretch: args.max_stretch,
        max_charts: args.max_charts,
        page_size: args.texture_size,
        padding_px: args.padding,
        texels_per_unit: args.density,
        // One mesh, one texture.
        pages: if args.bake || args.bake_from.is_some() { Some(1) } else { args.pages },
        packer: match args.packer {
            Packer::Boxes => unwrap::Packer::Boxes,
            Packer::Shapes | Packer::Xatlas => unwrap::Packer::Shapes,
        },
        face_group: args.groups.as_deref().map(|p| groups(p, &mesh, of_triangle.as_deref())).transpose()?,
        seam_edges: args.seams.as_deref().map(|p| seams(p, &mesh)).transpose()?,
        face_polygon: of_triangle,
        keep_uv_seams: args.keep_uv_seams,
        hard_edge_angle: args.hard_edges,
    };
    let (layout, stages) = console.start(&args.run).execute(|ctx| {
        let layout = match outside {
            Some(packer) => unwrap::unwrap_with(&mesh, &options, packer, ctx)?,
            None => unwrap::unwrap(&mesh, &options, ctx)?,
        };
        Ok((layout, ctx.stage_seconds()))
    })?;
    mesh.corner_uv = Some(layout.corner_uv.clone());
    mesh.face_chart = Some(layout.face_chart.clone());
    let pages =
        Pages { of_face: Some(&layout.face_page), size: [layout.width, layout.height].map(f64::from) };
    let quality = console.start_silent(&args.run).execute(|ctx| uv_on(&mesh, &pages, ctx))?;
    if layout.pages > 1 {
        for (uv, &page) in mesh.corner_uv.iter_mut().flatten().zip(&layout.face_page) {
            uv.iter_mut().for_each(|p| p[0] += page as f32);
        }
    }
    console.check()?;
    let texture = baked(&mut mesh, args, console)?;
    let how = SaveMesh {
        ascii: args.ascii,
        polygons: polygons.as_ref(),
        texture: texture.as_deref().map(Texture::Png),
        ..SaveMesh::default()
    };
    let saved = save_mesh(&args.output, &mesh, &how)?;
    for lost in saved.lost.iter().filter(|l| !l.starts_with("chart numbers")) {
        console.note(format_args!("{}: not kept: {lost}", args.output.display()));
    }
    notes(&layout, &options, console);

    let all = started.elapsed().as_secs_f64();
    let files: Vec<String> = saved.files.iter().map(|f| f.display().to_string()).collect();
    let mut text = String::new();
    let _ = writeln!(
        text,
        "mesh           {} vertices, {} triangles{} in {}",
        count(mesh.positions.len()),
        count(mesh.triangles.len()),
        polygons.as_ref().map_or(String::new(), |p| format!(" of {} faces", count(p.sizes.len()))),
        args.mesh.display()
    );
    let _ = writeln!(text, "charts         {}", count(layout.charts));
    let _ = writeln!(
        text,
        "stretch        95% of the area below {:.3}, L2 {:.4}, conformal {:.3}",
        quality.stretch_p95, quality.stretch_l2, quality.conformal
    );
    let _ = writeln!(text, "seams          {} times the square root of the area", short(quality.seam));
    let _ = writeln!(
        text,
        "flips          {}, overlapping faces {}, collapsed {}",
        quality.flips, quality.overlapping_faces, quality.degenerate
    );
    let _ = writeln!(
        text,
        "pages          {} of {} x {} texels, {:.1}% covered, {} texels per unit",
        layout.pages,
        layout.width,
        layout.height,
        100.0 * quality.coverage,
        short(layout.texels_per_unit)
    );
    let _ = writeln!(text, "seconds        {}", seconds(all, &stages));
    let _ = writeln!(text, "written        {}", files.join(", "));
    let json = json!({
        "mesh": args.mesh, "vertices": mesh.positions.len(), "triangles": mesh.triangles.len(),
        "polygons": polygons.as_ref().map(|p| p.sizes.len()), "charts": layout.charts,
        "stretch_bound": number(layout.stretch_bound), "over_stretched": number(layout.over_stretched),
        "stretch_p95": number(quality.stretch_p95), "stretch_l2": number(quality.stretch_l2),
        "conformal": number(quality.conformal), "seam": number(quality.seam), "flips": quality.flips,
        "overlapping_faces": quality.overlapping_faces, "collapsed": quality.degenerate,
        "pages": layout.pages, "width": layout.width, "height": layout.height,
        "coverage": number(quality.coverage), "texels_per_unit": number(layout.texels_per_unit),
        "degenerate_faces": layout.degenerate_faces, "duplicate_faces": layout.duplicate_faces,
        "non_manifold_edges": layout.non_manifold_edges, "repaired_charts": layout.repaired_charts,
        "split_polygons": layout.split_polygons, "seconds": number(all),
        "stages": stages_json(&stages),
        "files": files,
    });
    console.report(&text, &json);
    Ok(())
}

/// The texture asked for, as a PNG file; the vertices' own colours are taken off then, or they would tint it.
fn baked(mesh: &mut TriMesh, args: &Args, console: &Console) -> Result<Option<Vec<u8>>> {
    let scan = args.bake_from.as_deref().map(|p| files::load(p, &args.run, console)).transpose()?;
    let source = match &scan {
        Some(scan) => Colors::Points(&scan.cloud),
        None if args.bake => Colors::Vertices,
        None => return Ok(None),
    };
    let options = BakeOptions { size: args.texture_size, ..BakeOptions::default() };
    let image = console.start(&args.run).execute(|ctx| bake(mesh, source, &options, ctx))?;
    mesh.colors = None;
    files::png(&image).map(Some)
}

/// What the user should know about the mesh and the result.
fn notes(layout: &UvLayout, options: &UnwrapOptions, console: &Console) {
    for (n, what) in [
        (layout.degenerate_faces, "faces without area got small or empty UV triangles"),
        (layout.duplicate_faces, "faces that repeat another got UVs of their own"),
        (
            layout.non_manifold_edges,
            "edges where more than two faces, or two that face apart, meet: cut in the UVs",
        ),
        (layout.split_polygons, "polygons that do not lie flat were cut: these are written as triangles"),
    ] {
        if n > 0 {
            console.note(format_args!("{} {what}", count(n)));
        }
    }
    if layout.stretch_bound > options.max_stretch {
        console.note(format_args!(
            "the stretch bound was raised to {} for fewer charts",
            short(layout.stretch_bound)
        ));
    }
    if let Some(most) = options.max_charts
        && layout.charts > most
    {
        console.note(format_args!(
            "{} charts are the fewest found for this mesh and its constraints",
            layout.charts
        ));
    }
    if let Some(density) = options.texels_per_unit
        && layout.texels_per_unit < 0.999 * density
    {
        console.note(format_args!(
            "the density was lowered to {} texels per unit: the charts did not fit",
            short(layout.texels_per_unit)
        ));
    }
}

/// Whole numbers from a text file, with the line of each.
fn numbers(path: &Path) -> Result<Vec<(usize, u32)>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut out = Vec::new();
    for (i, line) in text.lines().enumerate() {
        for word in line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()) {
            let n = word.parse::<u32>().map_err(|_| {
                Usage(format!("{} line {}: \"{word}\" is no whole number from 0", path.display(), i + 1))
            })?;
            out.push((i + 1, n));
        }
    }
    Ok(out)
}

/// Groups of the triangles, from a file with one number per face.
fn groups(path: &Path, mesh: &TriMesh, polygon: Option<&[u32]>) -> Result<Vec<u32>> {
    let of_face: Vec<u32> = numbers(path)?.into_iter().map(|n| n.1).collect();
    let faces = polygon.map_or(mesh.triangles.len(), |p| p.last().map_or(0, |&l| l as usize + 1));
    if of_face.len() != faces {
        return Err(Usage(format!(
            "{} holds {} numbers for {faces} faces. Give one per face",
            path.display(),
            of_face.len()
        ))
        .into());
    }
    Ok(match polygon {
        Some(polygon) => polygon.iter().map(|&p| of_face[p as usize]).collect(),
        None => of_face,
    })
}

/// Pairs of vertices, from a file with two numbers per line.
fn seams(path: &Path, mesh: &TriMesh) -> Result<Vec<[u32; 2]>> {
    let all = numbers(path)?;
    let mut out = Vec::new();
    for pair in all.chunks(2) {
        let wrong = |what: &str| Usage(format!("{} line {}: {what}", path.display(), pair[0].0));
        let [(line, a), (same, b)] = pair else { return Err(wrong("one number, give two per line").into()) };
        if line != same {
            return Err(wrong("give two numbers per line").into());
        }
        if *a.max(b) as usize >= mesh.positions.len() {
            return Err(wrong(&format!("there are only {} vertices", mesh.positions.len())).into());
        }
        out.push([*a, *b]);
    }
    Ok(out)
}
