//! A file whose UVs and textures are replaced while all else in it stays as it is.
//!
//! In: an OBJ file with its material libraries. Out: its content, the images of its materials by layer
//! (colour, normals, roughness, ...), and the file again with other UVs and other images.

use crate::error::{Error, Result};
use crate::format::Format;
use crate::input::Input;
use crate::job::{FileBeside, Written};
use crate::load::{LoadOptions, Loaded, load_bytes};
use crate::obj::edit::{self, materials};
use crate::obj::library::{self, Map};
use crate::save::{SaveMesh, Saved, checked, mesh_job, save_by};
use crate::staged::is_same_file;
use atlasfit::geometry::TriMesh;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// What [`Layer::face_image`] holds for a face without an image: that of the core.
const NO_IMAGE: u32 = atlasfit::bake::NO_IMAGE;

/// Images of one kind that the materials of a file put on its faces.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Layer {
    /// What the images say, as the file has it: `map_kd`, ...
    pub name: String,
    /// The bytes of the image files.
    pub images: Vec<Vec<u8>>,
    /// The image of each triangle; `u32::MAX` for one without.
    pub face_image: Vec<u32>,
    /// Where the corners of each triangle lie in its image, v up.
    pub corner_uv: Vec<[[f32; 2]; 3]>,
    /// Whether the images are normal maps.
    pub normals: bool,
}

/// The parts of a file that UVs do not touch.
#[derive(Debug, Clone)]
pub struct Asset {
    data: Vec<u8>,
    /// The text of all material libraries.
    library: Option<Vec<u8>>,
    layers: Vec<Layer>,
    missing: Vec<String>,
    materials: usize,
    /// The files that this one names.
    named: Vec<PathBuf>,
}

/// Reads a file, and what is needed to write it again with other UVs; `None` for formats whose files hold
/// nothing besides.
///
/// # Errors
/// As [`load`](crate::load).
pub fn load_asset(path: &Path, options: &LoadOptions) -> Result<(Loaded, Option<Asset>)> {
    let format = options.format.or_else(|| Format::from_path(path));
    if format != Some(Format::Obj) {
        return Ok((crate::load(path, options)?, None));
    }
    let io = |source| Error::Io { file: path.display().to_string(), action: "read it", source };
    let length = std::fs::metadata(path).map_err(io)?.len();
    if let Some(limit_bytes) = options.max_memory_bytes.filter(|&limit| length > limit) {
        let file = path.display().to_string();
        return Err(Error::OutOfMemory { file, needed_bytes: length, limit_bytes });
    }
    let data = std::fs::read(path).map_err(io)?;
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
            layers[at].add(&map, bytes, |t| used.of_triangle[t] == Some(of as u32));
        }
        let library = found.then_some(all);
        Some(Self { data: text, library, layers, missing, materials: used.names.len(), named })
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
        format == Format::Obj
    }

    /// The file that this one uses and that an output at `path` would replace by its own.
    #[must_use]
    pub fn replaces(&self, path: &Path) -> Option<&Path> {
        let stem = path.with_extension("");
        let stem = stem.file_name().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let pages = self.layers.iter().map(|l| page_name(&stem, &l.name));
        let new: Vec<PathBuf> =
            pages.chain([format!("{stem}.mtl")]).map(|name| path.with_file_name(name)).collect();
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
        save_by(path, &options.stop, |out| {
            let mut written = Written::default();
            let mut library = None;
            let own = pages.len() == self.layers.len();
            let with_pages = own.then_some(()).and(self.library.as_ref());
            if let Some(text) = with_pages {
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
                library = Some(name);
            }
            let mut out = BufWriter::with_capacity(1 << 16, out);
            edit::write(&job, &self.data, library.as_deref(), &mut out)?;
            out.flush()?;
            Ok(written)
        })
    }
}

/// The file name of a layer's new image.
fn page_name(stem: &str, layer: &str) -> String {
    match layer {
        "map_kd" => format!("{stem}.png"),
        other => format!("{stem}_{}.png", other.trim_start_matches("map_")),
    }
}

impl Layer {
    /// Puts an image on the faces of a material.
    fn add(&mut self, map: &Map, bytes: Vec<u8>, has: impl Fn(usize) -> bool) {
        let image = self.images.iter().position(|b| *b == bytes).unwrap_or_else(|| {
            self.images.push(bytes);
            self.images.len() - 1
        });
        for t in (0..self.face_image.len()).filter(|&t| has(t)) {
            self.face_image[t] = image as u32;
            let moved = |uv: [f32; 2]| [0, 1].map(|k| uv[k] * map.scale[k] + map.offset[k]);
            if map.scale != [1.0; 2] || map.offset != [0.0; 2] {
                self.corner_uv[t] = self.corner_uv[t].map(moved);
            }
        }
    }
}
