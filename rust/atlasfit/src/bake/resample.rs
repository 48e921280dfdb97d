//! Colours of old textures, looked up through the old UVs of the same faces.
//!
//! In: images, the old UVs of each face, and the image that colours it. Out: the colour at a point of a face;
//! how many texels per unit of length the old textures have.

use super::image::{ColorAt, Image};
use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::numeric::vec3::Vec3;
use crate::run::Context;

/// What [`Textures::face_image`] holds for a face without an image.
pub const NO_IMAGE: u32 = u32::MAX;

/// Old textures of a mesh, which are drawn anew for its new UVs.
#[derive(Debug, Clone, Copy)]
pub struct Textures<'a> {
    /// The images; outside of [0, 1] they repeat.
    pub images: &'a [Image],
    /// The old UVs of each face's corners, v up.
    pub corner_uv: &'a [[[f32; 2]; 3]],
    /// The image of each face, or [`NO_IMAGE`]; `None` = the first one for all.
    pub face_image: Option<&'a [u32]>,
    /// Whether the images are normal maps: their directions are turned from the old UVs' axes to the new
    /// ones'.
    pub normals: bool,
}

impl Textures<'_> {
    /// The image of a face.
    fn image_of(&self, face: usize) -> Option<&Image> {
        self.images.get(self.face_image.map_or(0, |of| of[face]) as usize)
    }

    /// Whether a face has an image.
    pub(super) fn covers(&self, face: usize) -> bool {
        self.image_of(face).is_some()
    }

    /// Bytes of the images and the UVs.
    pub(super) fn bytes(&self) -> u64 {
        let images: usize = self.images.iter().map(|i| size_of_val(&i.rgba[..])).sum();
        (images + size_of_val(self.corner_uv) + self.face_image.map_or(0, size_of_val)) as u64
    }

    fn check(&self, mesh: &TriMesh) -> Result<()> {
        let faces = mesh.triangles.len();
        let columns = [Some(self.corner_uv.len()), self.face_image.map(<[u32]>::len)];
        if let Some(len) = columns.into_iter().flatten().find(|&len| len != faces) {
            let found = format!("old UVs or images for {len} faces of {faces}");
            return Err(Error::invalid(found, "Give one entry per face"));
        }
        if self.images.is_empty() || self.images.iter().any(|i| i.rgba.is_empty()) {
            return Err(Error::empty("there is no old texture", "Give an image with at least one texel"));
        }
        let whole = |i: &Image| i.rgba.len() as u64 == u64::from(i.width) * u64::from(i.height);
        if !self.images.iter().all(whole) {
            let advice = "Give width times height texels";
            return Err(Error::invalid("an old texture has texels of another number", advice));
        }
        let known = |&&i: &&u32| i != NO_IMAGE && i as usize >= self.images.len();
        match self.face_image.and_then(|of| of.iter().find(known)) {
            Some(image) => {
                let found = format!("a face has image {image} of {}", self.images.len());
                Err(Error::invalid(found, "Count images from 0"))
            }
            None => Ok(()),
        }
    }
}

/// Texels per unit of length that the old textures have on the mesh: so many or fewer on the given share of
/// the area with a texture, in (0, 1]. 0 where no face has one.
///
/// # Errors
/// [`Error::InvalidArgument`] where the columns do not fit the mesh; those of [`Context::check`].
pub fn density(mesh: &TriMesh, old: &Textures<'_>, share: f64, ctx: &Context<'_>) -> Result<f64> {
    mesh.validate()?;
    old.check(mesh)?;
    let mut faces: Vec<[f64; 2]> = Vec::new();
    for (f, (t, uv)) in mesh.triangles.iter().zip(old.corner_uv).enumerate() {
        ctx.check_at(f)?;
        let Some(image) = old.image_of(f) else { continue };
        let [a, b, c] = t.map(|v| Vec3(mesh.positions[v as usize]));
        let area = (b - a).cross(c - a).norm() / 2.0;
        let texels = uv_area(uv).abs() / 2.0 * f64::from(image.width) * f64::from(image.height);
        let density = (texels / area).sqrt();
        if area > 0.0 && density.is_finite() {
            faces.push([density, area]);
        }
    }
    faces.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    ctx.check()?;
    let total: f64 = faces.iter().map(|f| f[1]).sum();
    let mut below = 0.0;
    for [density, area] in faces {
        below += area;
        if below >= share * total {
            return Ok(density);
        }
    }
    Ok(0.0)
}

/// Twice the area of a triangle in the texture; negative where it is turned over.
fn uv_area(uv: &[[f32; 2]; 3]) -> f64 {
    let [a, b, c] = uv.map(|q| q.map(f64::from));
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The colours of old textures.
pub(super) fn of_textures<'a>(mesh: &'a TriMesh, old: Textures<'a>) -> Result<ColorAt<'a>> {
    old.check(mesh)?;
    let new = mesh.corner_uv.as_deref().unwrap_or_default();
    Ok(Box::new(move |f, w| {
        let f = f as usize;
        let Some(image) = old.image_of(f) else { return [0.0; 4] };
        let uv = old.corner_uv[f];
        let [u, v] = [0, 1].map(|k| (0..3).map(|c| w[c] * f64::from(uv[c][k])).sum());
        let color = look_up(image, u, v);
        if old.normals { turned(color, &frame(mesh, f, &uv), &frame(mesh, f, &new[f])) } else { color }
    }))
}

/// An image between its texels, each channel in [0, 1]; it repeats.
fn look_up(image: &Image, u: f64, v: f64) -> [f64; 4] {
    let (width, height) = (f64::from(image.width), f64::from(image.height));
    let [x, y] = [u * width - 0.5, (1.0 - v) * height - 0.5];
    if !x.is_finite() || !y.is_finite() {
        return [0.0; 4];
    }
    let texel = |x: f64, y: f64| {
        let at = y.rem_euclid(height) as usize * image.width as usize + x.rem_euclid(width) as usize;
        image.rgba[at.min(image.rgba.len() - 1)].map(f64::from)
    };
    let [left, top] = [x.floor(), y.floor()];
    let [s, t] = [x - left, y - top];
    let rows = [top, top + 1.0].map(|y| {
        let [a, b] = [texel(left, y), texel(left + 1.0, y)];
        [0, 1, 2, 3].map(|k| a[k] + s * (b[k] - a[k]))
    });
    [0, 1, 2, 3].map(|k| (rows[0][k] + t * (rows[1][k] - rows[0][k])) / 255.0)
}

/// Directions in a face's plane in which u and v grow, orthogonal and of length 1; 0 where they do not.
struct Frame {
    u: Vec3,
    v: Vec3,
}

/// The frame of a face with these UVs.
fn frame(mesh: &TriMesh, face: usize, uv: &[[f32; 2]; 3]) -> Frame {
    let [a, b, c] = mesh.triangles[face].map(|v| Vec3(mesh.positions[v as usize]));
    let [p, q, r] = uv.map(|q| q.map(f64::from));
    let area = uv_area(uv);
    let u = (b - a) * ((r[1] - p[1]) * area.signum()) - (c - a) * ((q[1] - p[1]) * area.signum());
    let u = u.normalized();
    let v = (b - a).cross(c - a).cross(u).normalized() * area.signum();
    Frame { u, v }
}

/// A normal map's direction in another frame of the same face.
fn turned(color: [f64; 4], old: &Frame, new: &Frame) -> [f64; 4] {
    let [x, y] = [2.0 * color[0] - 1.0, 2.0 * color[1] - 1.0];
    let along = old.u * x + old.v * y;
    if new.u == Vec3::ZERO || old.u == Vec3::ZERO {
        return color;
    }
    let channel = |c: f64| (c + 1.0) / 2.0;
    [channel(along.dot(new.u)), channel(along.dot(new.v)), color[2], color[3]]
}
