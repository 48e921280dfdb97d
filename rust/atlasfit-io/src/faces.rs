//! Polygons in, triangles out: gathers the faces of a file in order, and checks their indices once all
//! vertices are known. A polygon of n corners always gives n - 2 triangles, so that collinear corners stay
//! connected. The polygons themselves are kept beside the triangles, so that they can be written again.

use crate::content::{FaceColumns, Polygons};
use crate::report::LoadReport;
use atlasfit::geometry::triangulate::{MOST_TESTS, triangulate};

/// An index that no vertex has.
pub(crate) const NO_VERTEX: u32 = u32::MAX;

/// A face of more than three corners.
struct Polygon {
    /// Its first triangle.
    triangle: usize,
    /// Its first corner in [`Faces::corners`].
    corner: usize,
    /// How many corners it has.
    len: usize,
}

/// The faces read so far.
#[derive(Default)]
pub(crate) struct Faces {
    /// Polygons stand here as fans until [`Faces::finish`].
    pub triangles: Vec<[u32; 3]>,
    uv: Vec<[[f32; 2]; 3]>,
    has_uv: bool,
    without_uv: u64,
    /// UV chart per triangle; dropped unless there is one for each.
    pub chart: Vec<u32>,
    polygons: Vec<Polygon>,
    /// The corners of all polygons, and their texture coordinates.
    corners: Vec<u32>,
    corner_uv: Vec<[f32; 2]>,
    too_small: u64,
}

/// A vertex index of a file as ours; [`NO_VERTEX`] if it is negative or too large.
pub(crate) fn index(value: i64) -> u32 {
    u32::try_from(value).unwrap_or(NO_VERTEX)
}

impl Faces {
    /// Takes a face. `uv` has one entry per corner, or is empty. Returns how many triangles it makes.
    pub fn push(&mut self, corners: &[u32], uv: &[[f32; 2]]) -> usize {
        let n = corners.len();
        if n < 3 {
            self.too_small += 1;
            return 0;
        }
        let uv = (uv.len() == n).then_some(uv);
        if uv.is_some() && !self.has_uv {
            self.has_uv = true;
            self.uv.resize(self.triangles.len(), [[0.0; 2]; 3]);
            self.without_uv = self.triangles.len() as u64;
        }
        if n > 3 {
            self.polygons.push(Polygon {
                triangle: self.triangles.len(),
                corner: self.corners.len(),
                len: n,
            });
            self.corners.extend_from_slice(corners);
            match uv {
                Some(uv) => self.corner_uv.extend_from_slice(uv),
                None => self.corner_uv.resize(self.corners.len(), [0.0; 2]),
            }
        }
        for i in 1..n - 1 {
            self.triangles.push([corners[0], corners[i], corners[i + 1]]);
            if self.has_uv {
                self.uv.push(uv.map_or([[0.0; 2]; 3], |u| [u[0], u[i], u[i + 1]]));
            }
        }
        if self.has_uv && uv.is_none() {
            self.without_uv += (n - 2) as u64;
        }
        n - 2
    }

    /// Triangulates the polygons over their positions, drops faces with wrong indices, and reports both.
    pub fn finish(mut self, positions: &[[f64; 3]], report: &mut LoadReport) -> FaceColumns {
        let count = positions.len();
        let wrong = |v: u32| v as usize >= count;
        let mut wrong_faces = 0;
        let mut tests = MOST_TESTS;
        let mut ears = Vec::new();
        for p in &self.polygons {
            let corners = &self.corners[p.corner..p.corner + p.len];
            let triangles = &mut self.triangles[p.triangle..p.triangle + p.len - 2];
            if corners.iter().any(|&v| wrong(v)) {
                triangles.fill([NO_VERTEX; 3]);
                wrong_faces += 1;
                continue;
            }
            triangulate(positions, corners, &mut tests, &mut ears);
            for (i, ear) in ears.iter().enumerate() {
                triangles[i] = ear.map(|c| corners[c as usize]);
                if self.has_uv {
                    self.uv[p.triangle + i] = ear.map(|c| self.corner_uv[p.corner + c as usize]);
                }
            }
        }
        report.add("polygons, cut into triangles", self.polygons.len() as u64, None);
        report.add("faces of fewer than 3 corners, left out", self.too_small, None);
        if self.chart.len() != self.triangles.len() {
            self.chart.clear();
        }
        let is_wrong = |t: &[u32; 3]| t.iter().any(|&v| wrong(v));
        let polygons = self.take_polygons(is_wrong);
        if let Some(first) = self.triangles.iter().position(is_wrong) {
            let keep: Vec<bool> = self.triangles.iter().map(|t| !is_wrong(t)).collect();
            wrong_faces +=
                self.triangles.iter().filter(|t| is_wrong(t) && **t != [NO_VERTEX; 3]).count() as u64;
            retain(&mut self.triangles, &keep);
            retain(&mut self.uv, &keep);
            retain(&mut self.chart, &keep);
            let first = Some(format!("triangle {first}"));
            report.add("faces that name a vertex that is not there, left out", wrong_faces.max(1), first);
        }
        let repeated = self.triangles.iter().filter(|t| t[0] == t[1] || t[1] == t[2] || t[2] == t[0]).count();
        report.add("triangles that name a vertex twice, kept", repeated as u64, None);
        if self.has_uv {
            report.add("triangles without texture coordinates, set to 0", self.without_uv, None);
        }
        let corner_uv = self.has_uv.then_some(self.uv);
        let chart = (!self.chart.is_empty()).then_some(self.chart);
        FaceColumns { triangles: self.triangles, corner_uv, chart, polygons }
    }

    /// All faces as polygons, without those that hold a wrong triangle.
    fn take_polygons(&mut self, is_wrong: impl Fn(&[u32; 3]) -> bool) -> Option<Polygons> {
        let polygons = std::mem::take(&mut self.polygons);
        if polygons.is_empty() {
            return None;
        }
        let mut out = Polygons::default();
        let mut next = polygons.iter().peekable();
        let mut t = 0;
        while t < self.triangles.len() {
            let (corners, made) = match next.next_if(|p| p.triangle == t) {
                Some(p) => (&self.corners[p.corner..p.corner + p.len], p.len - 2),
                None => (&self.triangles[t][..], 1),
            };
            // A polygon's triangles are wrong together.
            if !is_wrong(&self.triangles[t]) {
                out.sizes.push(corners.len() as u32);
                out.corners.extend_from_slice(corners);
            }
            t += made;
        }
        Some(out)
    }
}

/// Keeps the values whose entry is true, and those beyond the last entry.
fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut i = 0;
    values.retain(|_| {
        i += 1;
        keep.get(i - 1).copied().unwrap_or(true)
    });
}
