//! What every writer gets and gives back: a mesh, or a cloud as a mesh without faces.

use crate::content::Polygons;
use crate::stopping::{WRITING, watched};
use atlasfit::Stop;
use atlasfit::geometry::Attribute;

/// A texture for a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Texture<'a> {
    /// The bytes of a PNG file. GLB holds them inside; for OBJ and PLY they go to a PNG file beside the
    /// output, of the output's name.
    Png(&'a [u8]),
    /// The name of an image file that exists already, relative to the output's folder.
    File(&'a str),
}

/// What a writer writes. Columns of vertices are as long as `positions`, columns of faces as long as
/// `triangles`, and no index is too large: the door has checked that.
pub(crate) struct Job<'a> {
    pub positions: &'a [[f64; 3]],
    pub normals: Option<&'a [[f32; 3]]>,
    /// Red, green, blue, alpha in [0, 1], sRGB.
    pub colors: Option<&'a [[f32; 4]]>,
    pub attributes: &'a [Attribute],
    pub triangles: &'a [[u32; 3]],
    /// Texture coordinates per corner of each triangle, v up.
    pub corner_uv: Option<&'a [[[f32; 2]; 3]]>,
    /// Unit normals per corner of each triangle, where those of a vertex differ.
    pub corner_normals: Option<&'a [[[f32; 3]; 3]]>,
    pub face_chart: Option<&'a [u32]>,
    pub texture: Option<Texture<'a>>,
    /// The polygons that the triangles were cut from.
    pub polygons: Option<&'a Polygons>,
    /// Text instead of binary.
    pub ascii: bool,
    /// The output's file name without folder and extension, and without what a URI or an MTL cannot hold.
    pub stem: String,
    /// The output's extension, lower case.
    pub extension: String,
    /// What ends the writing. What is written through the output is watched by the door already.
    pub stop: &'a Stop,
}

/// A file that belongs beside the output.
pub(crate) struct FileBeside {
    pub name: String,
    pub bytes: Vec<u8>,
}

/// What a writer gives back besides the bytes.
#[derive(Default)]
pub(crate) struct Written {
    /// What the format could not hold, in words.
    pub lost: Vec<String>,
    pub beside: Vec<FileBeside>,
}

impl Written {
    /// Says if 8 bits per channel do not hold these colours.
    pub fn note_rounded(&mut self, colors: Option<&[[f32; 4]]>) {
        let exact = |v: f32| (f32::from(to_u8(v)) / 255.0 - v).abs() < 1e-6;
        if colors.is_some_and(|c| c.iter().flatten().any(|&v| !exact(v))) {
            self.lost.push("colours rounded to 8 bits".into());
        }
    }
}

/// Rounds a colour channel in [0, 1] to 8 bits.
pub(crate) fn to_u8(v: f32) -> u8 {
    (v * 255.0).round() as u8
}

/// A face as it is written.
pub(crate) struct Face<'f> {
    /// Its vertices.
    pub corners: &'f [u32],
    /// Texture coordinates per corner; empty where there are none.
    pub uv: &'f [[f32; 2]],
    /// Unit normals per corner; empty where they are those of the vertices.
    pub normals: &'f [[f32; 3]],
    /// Its first triangle.
    pub triangle: usize,
}

impl Job<'_> {
    /// Calls `each` with every face in order: polygons where they are known and their triangles agree on the
    /// UVs and normals.
    pub fn each_face(&self, mut each: impl FnMut(Face<'_>) -> std::io::Result<()>) -> std::io::Result<()> {
        let triangle = |t: usize| Face {
            corners: &self.triangles[t],
            uv: self.corner_uv.map_or(&[][..], |uv| &uv[t][..]),
            normals: self.corner_normals.map_or(&[][..], |n| &n[t][..]),
            triangle: t,
        };
        let Some(polygons) = self.polygons else {
            return (0..self.triangles.len()).try_for_each(|t| each(triangle(t)));
        };
        let (mut t, mut corner) = (0, 0);
        let (mut uv, mut normals) = (Vec::new(), Vec::new());
        for &n in &polygons.sizes {
            let corners = &polygons.corners[corner..corner + n as usize];
            let triangles = t..t + n as usize - 2;
            (t, corner) = (triangles.end, corner + n as usize);
            let whole = n > 3
                && self.of_one_chart(triangles.clone())
                && self.agree(self.corner_uv, corners, triangles.clone(), &mut uv)
                && self.agree(self.corner_normals, corners, triangles.clone(), &mut normals);
            if whole {
                each(Face { corners, uv: &uv, normals: &normals, triangle: triangles.start })?;
            } else {
                triangles.into_iter().try_for_each(|t| each(triangle(t)))?;
            }
        }
        Ok(())
    }

    /// Whether triangles belong to one chart.
    fn of_one_chart(&self, mut triangles: std::ops::Range<usize>) -> bool {
        let first = triangles.start;
        self.face_chart.is_none_or(|c| triangles.all(|t| c[t] == c[first]))
    }

    /// Gathers the values at a polygon's corners; false where its triangles do not agree on them.
    fn agree<T: Copy + PartialEq>(
        &self,
        all: Option<&[[T; 3]]>,
        corners: &[u32],
        triangles: std::ops::Range<usize>,
        out: &mut Vec<T>,
    ) -> bool {
        out.clear();
        let Some(all) = all else { return true };
        for &v in corners {
            let mut found = triangles
                .clone()
                .flat_map(|t| (0..3).map(move |k| (t, k)))
                .filter(|&(t, k)| self.triangles[t][k] == v)
                .map(|(t, k)| all[t][k]);
            let Some(first) = found.next() else { return false };
            if found.any(|other| other != first) {
                return false;
            }
            out.push(first);
        }
        true
    }

    /// Says that a format which has one normal per vertex does not hold those of corners.
    pub fn note_corner_normals(&self, written: &mut Written) {
        if self.corner_normals.is_some() {
            let what =
                "normals that differ between a vertex's faces: their mean is written (GLB and OBJ hold them)";
            written.lost.push(what.into());
        }
    }

    /// Fails when the writing is to end: for work before the first byte.
    pub fn check(&self) -> std::io::Result<()> {
        self.stop.check(WRITING).map_err(std::io::Error::other)
    }

    /// `items`, which end early when the writing is to end; then [`Self::check`] fails.
    pub fn watched<I: Iterator>(&self, items: I) -> impl Iterator<Item = I::Item> {
        watched(Some(self.stop), items)
    }

    /// Number of faces that [`Self::each_face`] gives.
    pub fn face_count(&self) -> usize {
        let mut count = 0;
        let _ = self.each_face(|_| {
            count += 1;
            Ok(())
        });
        count
    }

    /// Whether some position needs more than a 32-bit float.
    pub fn needs_f64(&self) -> bool {
        self.positions.iter().flatten().any(|&c| f64::from(c as f32) != c && !c.is_nan())
    }
    /// Whether some point is not opaque.
    pub fn has_alpha(&self) -> bool {
        self.colors.is_some_and(|c| c.iter().any(|c| c[3] != 1.0))
    }
    /// The image's file name, and the image itself if it must be written beside the output.
    pub fn texture_file(&self, written: &mut Written) -> Option<String> {
        match self.texture? {
            Texture::File(name) => Some(name.to_owned()),
            Texture::Png(bytes) => {
                let name = format!("{}.png", self.stem);
                written.beside.push(FileBeside { name: name.clone(), bytes: bytes.to_vec() });
                Some(name)
            }
        }
    }
    /// The names of the attributes, for a message.
    pub fn attribute_names(&self) -> String {
        self.attributes.iter().map(|a| a.name.as_str()).collect::<Vec<_>>().join(", ")
    }
}
