//! What all nodes give together, joined into one mesh or cloud.

use crate::content::Content;
use crate::error::Result;
use crate::faces::{Faces, index};
use crate::input::Input;
use crate::weld::{Welded, bits, weld};
use atlasfit::Vec3;
use atlasfit::geometry::Attribute;

/// The vertices and triangles of all nodes; the optional columns are as long as the positions, or empty.
#[derive(Default)]
pub(super) struct Scene {
    pub positions: Vec<[f64; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub colors: Vec<[f32; 4]>,
    pub uv: Vec<[f32; 2]>,
    pub attributes: Vec<Attribute>,
    pub triangles: Vec<[u32; 3]>,
    /// Lists of triangles whose number of corners is no multiple of three.
    pub skipped: u64,
    /// Whether some vertices came without normals.
    pub normalless: bool,
}

impl Scene {
    /// Fills the columns that the vertices added last lack.
    pub fn pad(&mut self) {
        let total = self.positions.len();
        let pad = |len: usize| len > 0 && len < total;
        if pad(self.normals.len()) {
            self.normals.resize(total, [0.0; 3]);
        }
        if pad(self.colors.len()) {
            self.colors.resize(total, [1.0; 4]);
        }
        if pad(self.uv.len()) {
            self.uv.resize(total, [0.0; 2]);
        }
        for a in &mut self.attributes {
            a.values.resize(total * a.width, 0.0);
        }
    }

    /// The scene as a cloud; or as a mesh, with the vertices joined that were split for their texture
    /// coordinates or normals.
    pub fn finish(mut self, input: &mut Input<'_>) -> Result<Content> {
        let mut out = Content::default();
        input.report.add("lists of triangles with corners left over", self.skipped, None);
        if self.normalless && !self.normals.is_empty() {
            let what = "normals, left out because not every mesh has them";
            input.report.add(what, self.normals.len() as u64, None);
            self.normals.clear();
        }
        if self.triangles.is_empty() {
            out.cloud.positions = self.positions;
            out.cloud.normals = (!self.normals.is_empty()).then_some(self.normals);
            out.cloud.colors = (!self.colors.is_empty()).then_some(self.colors);
            out.cloud.attributes = self.attributes;
            return Ok(out);
        }
        input.reserve(self.positions.len(), 64)?;
        let welded = self.weld(input);
        let joined = welded.ids.len() - welded.first.len();
        let what = "vertices split for texture coordinates or normals, joined where exactly equal";
        input.report.add(what, joined as u64, None);
        let firsts = || welded.first.iter().map(|&i| i as usize);
        out.cloud.positions = firsts().map(|i| self.positions[i]).collect();
        if !self.colors.is_empty() {
            out.cloud.colors = Some(firsts().map(|i| self.colors[i]).collect());
        }
        for a in &self.attributes {
            let values =
                firsts().flat_map(|i| a.values[i * a.width..(i + 1) * a.width].iter().copied()).collect();
            out.cloud.attributes.push(Attribute { values, ..a.clone() });
        }
        let mut differ = false;
        if !self.normals.is_empty() {
            let (normals, mixed) = self.joined_normals(&welded);
            (out.cloud.normals, differ) = (Some(normals), mixed);
        }
        let mut faces = Faces::default();
        for t in &self.triangles {
            let corner = |v: u32| welded.ids.get(v as usize).copied().unwrap_or(index(-1));
            let uv = |v: u32| self.uv.get(v as usize).copied().unwrap_or_default();
            let (uv, normal) = (t.map(uv), t.map(|v| v.saturating_add(1)));
            faces.push(
                &t.map(corner),
                if self.uv.is_empty() { &[] } else { &uv },
                if differ { &normal } else { &[] },
            );
        }
        out.faces = faces.finish(&out.cloud.positions, &mut input.report);
        if let Some(of_vertices) = &out.cloud.normals {
            out.faces.look_up_normals(&self.normals, of_vertices);
        }
        Ok(out)
    }

    /// Joins vertices of equal position, colour and attributes.
    fn weld(&self, input: &Input<'_>) -> Welded {
        let attributes = |i: usize| {
            let numbers = self.attributes.iter().flat_map(|a| &a.values[i * a.width..(i + 1) * a.width]);
            // FNV-1a.
            numbers.fold(0xCBF2_9CE4_8422_2325u64, |h, v| (h ^ v.to_bits()).wrapping_mul(0x0100_0000_01B3))
        };
        let color = |i: usize| self.colors.get(i).map(|c| c.map(f32::to_bits));
        let places = input.watched(0..self.positions.len());
        weld(places.map(|i| (bits(self.positions[i]), color(i), attributes(i))))
    }

    /// The normals of joined vertices, the mean where they differ; and whether they do somewhere.
    fn joined_normals(&self, welded: &Welded) -> (Vec<[f32; 3]>, bool) {
        let mut normals: Vec<[f32; 3]> = welded.first.iter().map(|&i| self.normals[i as usize]).collect();
        let mut sums = vec![[0.0f64; 3]; normals.len()];
        let mut differ = vec![false; normals.len()];
        for (i, &id) in welded.ids.iter().enumerate() {
            let id = id as usize;
            differ[id] |= self.normals[i] != normals[id];
            for (s, &c) in sums[id].iter_mut().zip(&self.normals[i]) {
                *s += f64::from(c);
            }
        }
        for (id, _) in differ.iter().enumerate().filter(|d| *d.1) {
            normals[id] = Vec3(sums[id]).normalized().to_f32();
        }
        let mixed = differ.contains(&true);
        (normals, mixed)
    }
}
