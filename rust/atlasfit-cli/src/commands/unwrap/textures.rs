//! Where the colours of `unwrap`'s textures come from, how large the textures are, and what of the mesh's
//! file is kept.

use super::args::Args;
use crate::console::{Console, Usage};
use crate::files::{self, STANDARD};
use anyhow::{Context as _, Result};
use atlasfit::bake::{
    BakeOptions, Colors, Image, TexturePage, Textures, bake, texture_padding, texture_page,
};
use atlasfit::geometry::TriMesh;
use atlasfit::unwrap::{UnwrapOptions, UvLayout};
use atlasfit_io::{Asset, Loaded};
use std::path::Path;

/// What is baked.
pub enum Bake {
    Nothing,
    Vertices,
    Scan(Box<Loaded>),
    /// Old textures by layer.
    Old(Vec<Old>),
}

/// Old textures of one kind.
pub struct Old {
    images: Vec<Image>,
    face_image: Vec<u32>,
    corner_uv: Vec<[[f32; 2]; 3]>,
    normals: bool,
}

impl Old {
    fn textures(&self) -> Textures<'_> {
        Textures {
            images: &self.images,
            corner_uv: &self.corner_uv,
            face_image: Some(&self.face_image),
            normals: self.normals,
        }
    }
}

/// The size of the page and its padding; the density that the old textures ask for.
pub struct Page {
    pub size: [u32; 2],
    pub padding: u32,
    old: Option<TexturePage>,
    /// Whether the user gave the size.
    given: bool,
}

impl Page {
    /// A larger page for the same UVs, where their density is lower than the old textures'.
    pub fn enlarge(&self, layout: &mut UvLayout, console: &Console) {
        let Some(old) = &self.old else { return };
        if !self.given {
            let factor = old.enlarged(layout.width, layout.texels_per_unit);
            layout.width *= factor;
            layout.height *= factor;
            layout.padding_px *= factor;
            layout.texels_per_unit *= f64::from(factor);
        }
        if layout.texels_per_unit < old.density {
            console.note(format_args!(
                "the new texture has {:.4} texels per unit where the old one has up to {:.4}: give a larger \
                 --texture-size to keep its detail",
                layout.texels_per_unit, old.density
            ));
        }
    }
}

impl Bake {
    pub fn is_none(&self) -> bool {
        matches!(self, Bake::Nothing)
    }

    /// Whether the materials of the file stay, with their images drawn anew or left alone. A page that none
    /// of them has an image for needs a new one.
    pub fn keeps_materials(&self, asset: &Asset) -> bool {
        match self {
            Bake::Nothing => true,
            Bake::Old(layers) => layers.len() == asset.layers().len(),
            _ => false,
        }
    }

    /// How large the page has to be.
    pub fn page(&self, mesh: &TriMesh, args: &Args, console: &Console) -> Result<Page> {
        let defaults = UnwrapOptions::default();
        let given = args.texture_size.is_some();
        let size = args.texture_size.unwrap_or(defaults.page_size);
        let Bake::Old(layers) = self else {
            let padding = args.padding.unwrap_or(defaults.padding_px);
            return Ok(Page { size, padding, old: None, given });
        };
        let textures: Vec<Textures<'_>> = layers.iter().map(Old::textures).collect();
        let old = console.start(&args.run).execute(|ctx| texture_page(mesh, &textures, ctx))?;
        let size = if given { size } else { [old.side; 2] };
        let padding = args.padding.unwrap_or(texture_padding(size));
        Ok(Page { size, padding, old: Some(old), given })
    }
}

/// What is baked; what cannot be is refused.
pub fn of(args: &Args, loaded: &mut Loaded, asset: Option<&Asset>, console: &Console) -> Result<Bake> {
    if args.bake {
        return if loaded.cloud.colors.is_some() { Ok(Bake::Vertices) } else { Err(colourless(args)) };
    }
    let Some(file) = args.baked_file() else {
        if args.bake_from.as_deref() == Some(Path::new("none")) {
            return Ok(Bake::Nothing);
        }
        return automatic(args, loaded, asset, console);
    };
    if args.pages.is_some() {
        return Err(Usage("--bake-from makes one texture, on one page. Leave --pages away".into()).into());
    }
    let image = |e: &str| file.extension().is_some_and(|x| x.eq_ignore_ascii_case(e));
    if file != Path::new(STANDARD) && ["png", "jpg", "jpeg"].into_iter().any(image) {
        let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        let Some(corner_uv) = loaded.corner_uv.clone() else {
            let wrong = format!("{} has no UVs for the texture. Give a mesh with UVs", args.mesh.display());
            return Err(Usage(wrong).into());
        };
        return Ok(Bake::Old(vec![one(bytes, corner_uv, args, console)?]));
    }
    let scan = files::load(file, &args.run, console)?;
    if scan.cloud.colors.is_none() {
        return Err(Usage(format!("{} has no colours to bake", file.display())).into());
    }
    Ok(Bake::Scan(Box::new(scan)))
}

fn colourless(args: &Args) -> anyhow::Error {
    let mesh = args.mesh.display();
    Usage(format!("{mesh} has no colours to bake. Give a coloured mesh, or a scan with --bake-from")).into()
}

/// One image for all faces.
fn one(bytes: Vec<u8>, corner_uv: Vec<[[f32; 2]; 3]>, args: &Args, console: &Console) -> Result<Old> {
    let face_image = vec![0; corner_uv.len()];
    let image = console.apart(&args.run, "reading", move || files::read_image(&bytes))??;
    Ok(Old { images: vec![image], face_image, corner_uv, normals: false })
}

/// The textures that the mesh has; none where it has none.
fn automatic(args: &Args, loaded: &mut Loaded, asset: Option<&Asset>, console: &Console) -> Result<Bake> {
    let mut layers = Vec::new();
    for layer in asset.map(Asset::layers).unwrap_or_default() {
        let mut images = Vec::new();
        for bytes in layer.images.clone() {
            images.push(console.apart(&args.run, "reading", move || files::read_image(&bytes))??);
        }
        let (face_image, corner_uv) = (layer.face_image.clone(), layer.corner_uv.clone());
        layers.push(Old { images, face_image, corner_uv, normals: layer.normals });
    }
    if asset.is_none()
        && let (Some(bytes), Some(uv)) = (loaded.texture.take(), loaded.corner_uv.clone())
    {
        layers.push(one(bytes, uv, args, console)?);
    }
    if layers.is_empty() {
        return Ok(Bake::Nothing);
    }
    if args.pages.is_some() {
        let wrong = "the mesh's textures are drawn anew on one page. Leave --pages away, or give \
                     --bake-from none to leave them out";
        return Err(Usage(wrong.into()).into());
    }
    Ok(Bake::Old(layers))
}

/// The asset, where the output keeps it. What the output cannot keep is refused, or a note where the user
/// allows it.
pub fn kept(args: &Args, loaded: &Loaded, asset: Option<Asset>, console: &Console) -> Result<Option<Asset>> {
    let mut lost = loaded.left_out.clone();
    let format = args.output().format(args.write)?;
    let asset = match asset {
        Some(asset) if asset.is_kept_in(format) && args.output != Path::new(STANDARD) => {
            if let Some(file) = asset.replaces(&args.output).filter(|_| !args.write.force) {
                let file = file.display();
                let wrong = format!("the output would replace {file}, which {} uses", args.mesh.display());
                return Err(Usage(format!("{wrong}. Give --force, or another --output")).into());
            }
            let missing = asset.missing().iter();
            missing.for_each(|m| console.note(format_args!("{m} cannot be read: left as it is")));
            Some(asset)
        }
        Some(asset) => {
            if asset.materials() > 1 {
                lost.push(format!("{} materials", asset.materials()));
            }
            let others = asset.layers().iter().filter(|l| l.name != "map_kd");
            lost.extend(others.map(|l| format!("the images of {}", l.name)));
            None
        }
        None => None,
    };
    if lost.is_empty() {
        return Ok(asset);
    }
    let what = format!("{}: the output does not keep: {}", args.mesh.display(), lost.join(", "));
    if !args.allow_loss {
        return Err(Usage(format!("{what}. Give --allow-loss to go on without")).into());
    }
    console.note(what);
    Ok(asset)
}

/// The textures as PNG files; the vertices' own colours are taken off then, or they would tint them.
pub fn baked(
    mesh: &mut TriMesh,
    from: &Bake,
    size: [u32; 2],
    args: &Args,
    console: &Console,
) -> Result<Vec<Vec<u8>>> {
    let sources: Vec<Colors<'_>> = match from {
        Bake::Nothing => return Ok(Vec::new()),
        Bake::Vertices => vec![Colors::Vertices],
        Bake::Scan(scan) => vec![Colors::Points(&scan.cloud)],
        Bake::Old(layers) => layers.iter().map(|l| Colors::Textures(l.textures())).collect(),
    };
    let options = BakeOptions::default().with_size(size);
    let mut pages = Vec::new();
    for source in sources {
        let image = console.start(&args.run).execute(|ctx| bake(mesh, source, &options, ctx))?;
        pages.push(files::png_apart(image, &args.run, console)?);
    }
    mesh.colors = None;
    Ok(pages)
}
