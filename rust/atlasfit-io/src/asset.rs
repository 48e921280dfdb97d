//! A file whose UVs and textures are replaced while all else in it stays as it is.
//!
//! In: an OBJ file with its material libraries, or a glTF file. Out: its content, the images of its materials
//! by layer (colour, normals, roughness, ...), and the file again with other UVs and other images.

use crate::error::{Error, Result};
use crate::format::Format;
#[cfg(feature = "gltf")]
use crate::gltf::keep;
use crate::input::Input;
use crate::job::{FileBeside, Job, Written};
use crate::layer::{Layer, NO_IMAGE};
use crate::load::{LoadOptions, Loaded, load_bytes};
use crate::obj::edit::{self, materials};
use crate::obj::library::{self, Map};
use crate::save::{SaveMesh, Saved, checked, mesh_job, save_by};
use crate::staged::is_same_file;
use atlasfit::geometry::TriMesh;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The parts of a file that UVs do not touch.
#[derive(Debug, Clone)]
pub struct Asset {
    kind: Kind,
    layers: Vec<Layer>,
    missing: Vec<String>,
    materials: usize,
    /// The files that this one names.
    named: Vec<PathBuf>,
}

/// The content of a file, by its format.
#[derive(Debug, Clone)]
enum Kind {
    Obj {
        text: Vec<u8>,
        /// The text of all material libraries.
        library: Option<Vec<u8>>,
    },
    #[cfg(feature = "gltf")]
    Gltf(Box<keep::Kept>),
}

/// Reads a file, and what is needed to write it again with other UVs to a file of the format `output`; `None`
/// for formats whose files hold nothing besides. A glTF file that is to become one again is read as one mesh
/// in which each of its meshes stands once, however many nodes name it.
///
/// # Errors
/// As [`load`](crate::load).
pub fn load_asset(path: &Path, output: Format, options: &LoadOptions) -> Result<(Loaded, Option<Asset>)> {
    let format = options.format.or_else(|| Format::from_path(path));
    let is_gltf = cfg!(feature = "gltf") && format == Some(Format::Gltf) && output == Format::Gltf;
    if format != Some(Format::Obj) && !is_gltf {
        return Ok((crate::load(path, options)?, None));
    }
    let io = |source| Error::io(path, "read it", source);
    let length = std::fs::metadata(path).map_err(io)?.len();
    if let Some(limit_bytes) = options.max_memory_bytes.filter(|&limit| length > limit) {
        let file = path.display().to_string();
        return Err(Error::OutOfMemory { file, needed_bytes: length, limit_bytes });
    }
    let data = std::fs::read(path).map_err(io)?;
    #[cfg(feature = "gltf")]
    if is_gltf && Format::detect(&data, path) == Some(Format::Gltf) {
        return of_gltf(path, &crate::text::utf8(&data), options);
    }
    let mut loaded = load_bytes(path, &data, options)?;
    if loaded.format != Format::Obj || loaded.faces.is_empty() {
        return Ok((loaded, None));
    }
    let asset = Asset::of_obj(path, data, &loaded, options);
    if asset.is_some() {
        // All that is said to be lost here is kept.
        let lost = ["changes of material", "groups and objects", "vertices with different normals"];
        loaded.report.notes.retain(|n| !lost.iter().any(|l| n.what.starts_with(l)));
    }
    Ok((loaded, asset))
}

/// Reads a glTF file.
#[cfg(feature = "gltf")]
fn of_gltf(path: &Path, data: &[u8], options: &LoadOptions) -> Result<(Loaded, Option<Asset>)> {
    let mut input = Input::whole(path, data, options.max_memory_bytes).until(&options.stop);
    input.reserve(data.len(), 1)?;
    let opened = keep::open(&mut input, options.max_memory_bytes);
    // A reader that is stopped sees a file that ends early: this is why.
    input.check()?;
    let keep::Opened { content, kept, layers, missing, named } = opened?;
    let named = named.iter().map(|n| path.with_file_name("").join(n)).collect();
    let materials = kept.materials();
    let mut loaded = crate::load::loaded(input, content, Format::Gltf);
    // All that is said to be lost here is kept.
    let lost = ["skinned", "meshes with morph", "sets of lines", "vertices ", "normals, left out"];
    loaded.report.notes.retain(|n| !lost.iter().any(|l| n.what.starts_with(l)));
    let asset = Asset { kind: Kind::Gltf(Box::new(kept)), layers, missing, materials, named };
    let has_faces = !loaded.faces.is_empty();
    Ok((loaded, has_faces.then_some(asset)))
}

impl Asset {
    fn of_obj(path: &Path, data: Vec<u8>, loaded: &Loaded, options: &LoadOptions) -> Option<Self> {
        let text = crate::text::utf8(&data).into_owned();
        let used = materials(&text, loaded.cloud.len());
        if used.of_triangle.len() != loaded.faces.len() {
            return None;
        }
        let mut input = Input::whole(path, &text, options.max_memory_bytes);
        let mut missing = Vec::new();
        let mut all = Vec::new();
        let mut found = false;
        for name in &used.libraries {
            match input.beside(name) {
                Some(bytes) => {
                    found = true;
                    all.extend(bytes);
                    if all.last().is_some_and(|&b| b != b'\n') {
                        all.push(b'\n');
                    }
                }
                None => missing.push(format!("the material library {name}")),
            }
        }
        let mut layers: Vec<Layer> = Vec::new();
        let beside = |name: &str| path.with_file_name("").join(name);
        let mut named: Vec<PathBuf> = used.libraries.iter().map(|l| beside(l)).collect();
        for map in library::maps(&all) {
            let file = map.file.replace('\\', "/");
            named.push(beside(&file));
            let Some(of) = used.names.iter().position(|n| *n == map.material) else { continue };
            let Some(uv) = &loaded.corner_uv else { continue };
            let Some(bytes) = input.beside(&file) else {
                missing.push(format!("the image {}", map.file));
                continue;
            };
            let at = layers.iter().position(|l| l.name == map.key).unwrap_or_else(|| {
                layers.push(Layer {
                    name: map.key.clone(),
                    images: Vec::new(),
                    face_image: vec![NO_IMAGE; loaded.faces.len()],
                    corner_uv: uv.clone(),
                    normals: map.key == "norm",
                });
                layers.len() - 1
            });
            add(&mut layers[at], &map, bytes, |t| used.of_triangle[t] == Some(of as u32));
        }
        let library = found.then_some(all);
        let kind = Kind::Obj { text, library };
        Some(Self { kind, layers, missing, materials: used.names.len(), named })
    }

    /// The images of the file's materials.
    #[must_use]
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Files that this one names and that cannot be read, in words.
    #[must_use]
    pub fn missing(&self) -> &[String] {
        &self.missing
    }

    /// How many materials the faces have.
    #[must_use]
    pub fn materials(&self) -> usize {
        self.materials
    }

    /// Whether an output of this format keeps what UVs do not touch.
    #[must_use]
    pub fn is_kept_in(&self, format: Format) -> bool {
        match self.kind {
            Kind::Obj { .. } => format == Format::Obj,
            #[cfg(feature = "gltf")]
            Kind::Gltf(_) => format == Format::Gltf,
        }
    }

    /// The file that this one uses and that an output at `path` would replace by its own.
    #[must_use]
    pub fn replaces(&self, path: &Path) -> Option<&Path> {
        let stem = path.with_extension("");
        let stem = stem.file_name().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let pages = self.layers.iter().map(|l| page_name(&stem, &l.name));
        let own = match self.kind {
            Kind::Obj { .. } => Some("mtl"),
            #[cfg(feature = "gltf")]
            Kind::Gltf(_) => is_text(path).then_some("bin"),
        };
        // A GLB holds its images.
        let own = own.map(|end| pages.chain([format!("{stem}.{end}")]).collect::<Vec<_>>());
        let new: Vec<PathBuf> = own.into_iter().flatten().map(|name| path.with_file_name(name)).collect();
        let same = |named: &&PathBuf| new.iter().any(|n| n.exists() && is_same_file(n, named));
        self.named.iter().find(same).map(PathBuf::as_path)
    }

    /// Writes the file with the UVs of `mesh`, which was read from it, and new images: the bytes of a PNG
    /// file for each layer, or none at all, which leaves the materials and their images as they are.
    ///
    /// # Errors
    /// As [`save_mesh`](crate::save_mesh).
    pub fn save(
        &self,
        path: &Path,
        mesh: &TriMesh,
        pages: &[Vec<u8>],
        options: &SaveMesh<'_>,
    ) -> Result<Saved> {
        let job = mesh_job(path, mesh, options);
        checked(path, options.format, &job)?;
        match &self.kind {
            Kind::Obj { text, library } => {
                let library = library.as_deref().filter(|_| pages.len() == self.layers.len());
                save_by(path, &options.stop, |out| self.write_obj(&job, text, library, pages, out))
            }
            #[cfg(feature = "gltf")]
            Kind::Gltf(kept) => self.save_gltf(path, &job, kept, pages),
        }
    }

    /// Writes an OBJ file; `library` with new images.
    fn write_obj(
        &self,
        job: &Job<'_>,
        text: &[u8],
        library: Option<&[u8]>,
        pages: &[Vec<u8>],
        out: impl Write,
    ) -> std::io::Result<Written> {
        let mut written = Written::default();
        let mut name_of_library = None;
        if let Some(text) = library {
            for (layer, bytes) in self.layers.iter().zip(pages) {
                let name = page_name(&job.stem, &layer.name);
                written.beside.push(FileBeside { name, bytes: bytes.clone() });
            }
            let kept = |map: &Map| {
                let known = self.layers.iter().any(|l| l.name == map.key);
                let missing = self.missing.iter().any(|m| m.ends_with(&map.file));
                let name = known.then(|| page_name(&job.stem, &map.key));
                if missing { Some(map.file.clone()) } else { name }
            };
            let name = format!("{}.mtl", job.stem);
            let bytes = library::renamed(text, kept);
            written.beside.push(FileBeside { name: name.clone(), bytes });
            name_of_library = Some(name);
        }
        let mut out = BufWriter::with_capacity(1 << 16, out);
        edit::write(job, text, name_of_library.as_deref(), &mut out)?;
        out.flush()?;
        Ok(written)
    }

    /// Writes a GLB, or a glTF file with its buffer and its new images beside it.
    #[cfg(feature = "gltf")]
    fn save_gltf(&self, path: &Path, job: &Job<'_>, kept: &keep::Kept, pages: &[Vec<u8>]) -> Result<Saved> {
        let is_text = is_text(path);
        let names: Vec<String> = self.layers.iter().map(|l| page_name(&job.stem, &l.name)).collect();
        let new: Vec<keep::Page<'_>> = (pages.iter().zip(&names))
            .map(|(bytes, name)| keep::Page { bytes, file: is_text.then_some(&**name) })
            .collect();
        let own = pages.len() == self.layers.len();
        let buffer = is_text.then(|| format!("{}.bin", job.stem));
        let place = keep::Place {
            moved: !is_same_folder(path, kept.path()),
            buffer: buffer.as_deref(),
            pages: own.then_some(&new[..]),
        };
        let edited = kept.edited(job, &place)?;
        save_by(path, &job.stop.clone(), |out| {
            let mut out = BufWriter::with_capacity(1 << 16, out);
            let mut written = edited.write(&mut out)?;
            out.flush()?;
            if is_text && own {
                let files = names.into_iter().zip(pages);
                written.beside.extend(files.map(|(name, bytes)| FileBeside { name, bytes: bytes.clone() }));
            }
            Ok(written)
        })
    }
}

/// Whether a glTF file of this name is JSON, not a GLB.
#[cfg(feature = "gltf")]
fn is_text(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf"))
}

/// Whether two files lie in one folder.
#[cfg(feature = "gltf")]
fn is_same_folder(a: &Path, b: &Path) -> bool {
    let folder =
        |p: &Path| p.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new(".")).canonicalize();
    matches!((folder(a), folder(b)), (Ok(a), Ok(b)) if a == b)
}

/// The file name of a layer's new image.
fn page_name(stem: &str, layer: &str) -> String {
    match layer {
        "map_kd" | "baseColorTexture" => format!("{stem}.png"),
        other => format!("{stem}_{}.png", other.trim_start_matches("map_").replace("Texture", "")),
    }
}

/// Puts an image on the faces of a material.
fn add(layer: &mut Layer, map: &Map, bytes: Vec<u8>, has: impl Fn(usize) -> bool) {
    let image = layer.images.iter().position(|b| *b == bytes).unwrap_or_else(|| {
        layer.images.push(bytes);
        layer.images.len() - 1
    });
    for t in (0..layer.face_image.len()).filter(|&t| has(t)) {
        layer.face_image[t] = image as u32;
        let moved = |uv: [f32; 2]| [0, 1].map(|k| uv[k] * map.scale[k] + map.offset[k]);
        if map.scale != [1.0; 2] || map.offset != [0.0; 2] {
            layer.corner_uv[t] = layer.corner_uv[t].map(moved);
        }
    }
}
