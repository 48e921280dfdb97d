//! A glTF file with other texture coordinates and other images, and all else as it is.
//!
//! In: a file, read as one mesh in which each mesh of the file stands once; that mesh with new texture
//! coordinates; new images. Out: the file's JSON, edited, and one buffer. Nodes, instances, materials, names,
//! cameras, animations, skins, extras and extensions stay as they are; the numbers that name data too, where
//! an extension that is not known may use them.

mod blob;
mod edit;
mod extensions;
mod lost;
mod pages;
mod parts;
mod refs;
mod rows;
mod slots;
mod split;
mod textures;
mod vertices;

use super::document::{Document, number};
use super::instances::once;
use super::matrix::NormalTransform;
use super::read::add_mesh;
use super::scene::Scene;
use super::write::glb_until_binary;
use crate::content::Content;
use crate::error::{Error, Location, Result};
use crate::input::Input;
use crate::job::{FileBeside, Job, Written};
use crate::layer::Layer;
use edit::{Edit, Finished};
use lost::Findings;
pub(crate) use pages::Page;
use parts::{Block, Part};
use slots::Slot;
use std::io::Write;
use std::path::{Path, PathBuf};
use textures::{Group, Surface, Textures};
use vertices::Layout;

/// A file as it was read.
#[derive(Debug, Clone)]
pub(crate) struct Kept {
    file: Document<'static>,
    parts: Vec<Part>,
    blocks: Vec<Block>,
    groups: Vec<Group>,
    undrawn: Vec<Slot>,
    path: PathBuf,
    limit: Option<u64>,
}

/// A file's content, and what is needed to write it again.
pub(crate) struct Opened {
    /// Each mesh of the file once. What is left out of it is what cannot be kept.
    pub content: Content,
    pub kept: Kept,
    pub layers: Vec<Layer>,
    /// What the file names and cannot be read, in words.
    pub missing: Vec<String>,
    /// The files that it names.
    pub named: Vec<String>,
}

/// Reads a file; `limit` is the memory that writing may take, too.
pub(crate) fn open(input: &mut Input<'_>, limit: Option<u64>) -> Result<Opened> {
    let file = Document::read(input)?;
    let mut file = file.into_owned(input)?;
    let mut scene = Scene::default();
    let mut parts = Vec::new();
    for instance in once(&file.json, input) {
        let mirrored = NormalTransform::of(&instance.world).mirrored;
        for added in add_mesh(input, &file, &mut scene, &instance)? {
            let mut part = Part {
                mesh: instance.mesh,
                primitive: added.primitive,
                material: None,
                mirrored,
                triangles: added.triangles,
                block: 0,
            };
            part.material = number(&parts::json_of(&file.json, &part)["material"]);
            parts.push(part);
        }
    }
    let mut content = scene.finish(input)?;
    check(input, &mut file)?;
    let blocks = parts::blocks(input, &file, &mut parts)?;
    let all = slots::slots(&file.json);
    let mut findings = Findings::default();
    findings.look_through(&file.json, &all);
    let surface = Surface { file: &file, parts: &parts, blocks: &blocks };
    let Textures { groups, layers, undrawn } = textures::textures(input, &surface, all, &mut findings)?;
    content.left_out = findings.lost;
    let named = file.files();
    let path = input.path.to_owned();
    let kept = Kept { file, parts, blocks, groups, undrawn, path, limit };
    Ok(Opened { content, kept, layers, missing: findings.missing, named })
}

/// Refuses a file whose parts name what is not there: what is new would take its place.
fn check(input: &Input<'_>, file: &mut Document<'_>) -> Result<()> {
    let wrong = |found: String| {
        let advice = "The file is damaged: get it again, or write the mesh to .obj or .ply";
        Err(input.malformed(Location::Whole, found, "data within the buffers, as glTF 2.0 asks", advice))
    };
    for list in [refs::ACCESSORS, refs::VIEWS, refs::IMAGES] {
        if let Some(id) = list.named(&mut file.json).beyond {
            return wrong(format!("number {id} in {}, which is not there", list.key));
        }
    }
    match blob::outside(file) {
        Some(id) => wrong(format!("bufferViews: number {id} leaves its buffer")),
        None => Ok(()),
    }
}

/// How the file is written again.
pub(crate) struct Place<'p> {
    /// Whether the output lies in another folder, where the images beside the file are not.
    pub moved: bool,
    /// The file of the buffer; `None` = inside a GLB.
    pub buffer: Option<&'p str>,
    /// The new images, one per layer; `None` leaves the old ones.
    pub pages: Option<&'p [Page<'p>]>,
}

/// A file as it is to be written.
pub(crate) struct Edited<'k> {
    json: Vec<u8>,
    finished: Finished<'k>,
    buffer: Option<String>,
    /// What is not kept, in words.
    lost: Vec<String>,
}

impl Kept {
    /// The file that was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many materials the triangles have.
    pub fn materials(&self) -> usize {
        let mut all: Vec<usize> = self.parts.iter().filter_map(|p| p.material).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    }

    /// The file with the texture coordinates of `job`, whose triangles were read from it.
    pub fn edited(&self, job: &Job<'_>, place: &Place<'_>) -> Result<Edited<'_>> {
        let data = self.file.buffers().first().map_or(&[][..], |b| b);
        let mut input = Input::whole(&self.path, data, self.limit).until(job.stop);
        // The JSON once more, and as text.
        input.reserve(self.file.json_bytes, 3)?;
        self.file.buffers().iter().try_for_each(|b| input.reserve(b.len(), 1))?;
        let triangles: usize = self.parts.iter().map(|p| p.triangles).sum();
        if job.corner_uv.map(<[_]>::len) != Some(triangles) {
            return Err(input.unsupported("the mesh is not the one that was read", "Read it again"));
        }
        let mut edit = Edit::of(&self.file);
        let first: Vec<usize> =
            self.parts.iter().scan(0, |sum, p| Some(std::mem::replace(sum, *sum + p.triangles))).collect();
        let layout = Layout { parts: &self.parts, first: &first, job };
        let mut tangents = 0;
        for block in &self.blocks {
            let follows = self.tangents_follow_uv(block);
            tangents += u64::from(follows);
            vertices::lay(&mut input, &mut edit, block, &layout, follows)?;
        }
        let mut lost = Vec::new();
        if tangents > 0 {
            let what = "tangents along the old texture coordinates: viewers compute those of the new ones";
            lost.push(what.to_owned());
        }
        if let Some(pages) = place.pages {
            pages.iter().try_for_each(|p| input.reserve(p.bytes.len(), 1))?;
            pages::replace(&mut edit, &self.groups, pages);
            pages::remove(&mut edit.json, &self.undrawn);
        }
        let input = std::cell::RefCell::new(input);
        let embed = |uri: &str| {
            let name = super::uri::unescape(uri);
            place.moved.then(|| input.borrow_mut().beside(&name)).flatten()
        };
        let finished = edit.finish(embed, place.buffer);
        let json = match place.buffer {
            Some(_) => serde_json::to_vec_pretty(&finished.json),
            None => serde_json::to_vec(&finished.json),
        };
        let json = json.map_err(|e| Error::Io {
            file: self.path.display().to_string(),
            action: "write its JSON",
            source: e.into(),
        })?;
        Ok(Edited { json, finished, buffer: place.buffer.map(str::to_owned), lost })
    }

    /// Whether the vertices of a block have tangents that a normal map needs: those go, and viewers compute
    /// them (glTF 2.0, 3.7.2.1).
    fn tangents_follow_uv(&self, block: &Block) -> bool {
        let has = block.columns.iter().chain(&block.targets).any(|c| c.name == "TANGENT");
        has && slots::slots(&self.file.json)
            .iter()
            .filter(|s| s.is_normals())
            .any(|s| block.parts.iter().any(|&p| self.parts[p].material == Some(s.material)))
    }
}

impl Edited<'_> {
    /// Writes the file, or its JSON with the buffer beside it.
    pub fn write(mut self, out: &mut impl Write) -> std::io::Result<Written> {
        let mut written = Written { lost: self.lost, ..Written::default() };
        let buffer = &self.finished.buffer;
        if let Some(name) = self.buffer {
            out.write_all(&self.json)?;
            let mut bytes = Vec::with_capacity(buffer.len);
            buffer.write(&mut bytes)?;
            written.beside.push(FileBeside { name, bytes });
            return Ok(written);
        }
        self.json.resize(self.json.len().next_multiple_of(4), b' ');
        glb_until_binary(&self.json, buffer.len, out)?;
        buffer.write(out)?;
        Ok(written)
    }
}
