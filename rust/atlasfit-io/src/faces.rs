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

/// A value per corner of the triangles; nothing is stored until a face has some.
#[derive(Default)]
struct CornerColumn<T> {
    /// Whether some face has values.
    used: bool,
    /// Triangles without values.
    without: u64,
    /// One row per triangle.
    triangles: Vec<[T; 3]>,
    /// One value per corner of each polygon.
    polygons: Vec<T>,
}

impl<T: Copy + Default> CornerColumn<T> {
    /// Takes the values of a face of `n` corners: one per corner, or none. `triangles` came before it;
    /// `corners` counts the corners of all polygons, this face's among them.
    fn push(&mut self, values: &[T], n: usize, triangles: usize, corners: usize) {
        let values = (values.len() == n).then_some(values);
        if values.is_some() && !self.used {
            self.used = true;
            self.triangles.resize(triangles, [T::default(); 3]);
            self.without = triangles as u64;
        }
        if n > 3 {
            self.polygons.extend_from_slice(values.unwrap_or_default());
            self.polygons.resize(corners, T::default());
        }
        if self.used {
            let row = |i: usize| values.map_or([T::default(); 3], |v| [v[0], v[i], v[i + 1]]);
            self.triangles.extend((1..n - 1).map(row));
            if values.is_none() {
                self.without += (n - 2) as u64;
            }
        }
    }
    /// Sets the values of a triangle to those of its polygon's corners.
    fn set(&mut self, triangle: usize, first: usize, ear: [u32; 3]) {
        if self.used {
            self.triangles[triangle] = ear.map(|c| self.polygons[first + c as usize]);
        }
    }
    /// The rows; `None` where no face has values.
    fn rows(self) -> Option<Vec<[T; 3]>> {
        self.used.then_some(self.triangles)
    }
}

/// The faces read so far.
#[derive(Default)]
pub(crate) struct Faces {
    /// Polygons stand here as fans until [`Faces::finish`].
    pub triangles: Vec<[u32; 3]>,
    uv: CornerColumn<[f32; 2]>,
    /// Numbers of normals, counted from 1; 0 for none.
    normal: CornerColumn<u32>,
    /// UV chart per triangle; dropped unless there is one for each.
    pub chart: Vec<u32>,
    polygons: Vec<Polygon>,
    /// The corners of all polygons.
    corners: Vec<u32>,
    too_small: u64,
}

/// A vertex index of a file as ours; [`NO_VERTEX`] if it is negative or too large.
pub(crate) fn index(value: i64) -> u32 {
    u32::try_from(value).unwrap_or(NO_VERTEX)
}

impl Faces {
    /// Takes a face. `uv` has one entry per corner, or is empty; so has `normal`: numbers of normals,
    /// counted from 1, 0 for none. Returns how many triangles it makes.
    pub fn push(&mut self, corners: &[u32], uv: &[[f32; 2]], normal: &[u32]) -> usize {
        let n = corners.len();
        if n < 3 {
            self.too_small += 1;
            return 0;
        }
        let triangles = self.triangles.len();
        if n > 3 {
            self.polygons.push(Polygon { triangle: triangles, corner: self.corners.len(), len: n });
            self.corners.extend_from_slice(corners);
        }
        self.uv.push(uv, n, triangles, self.corners.len());
        self.normal.push(normal, n, triangles, self.corners.len());
        self.triangles.extend((1..n - 1).map(|i| [corners[0], corners[i], corners[i + 1]]));
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
                self.uv.set(p.triangle + i, p.corner, *ear);
                self.normal.set(p.triangle + i, p.corner, *ear);
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
            retain(&mut self.uv.triangles, &keep);
            retain(&mut self.normal.triangles, &keep);
            retain(&mut self.chart, &keep);
            let first = Some(format!("triangle {first}"));
            report.add("faces that name a vertex that is not there, left out", wrong_faces.max(1), first);
        }
        let repeated = self.triangles.iter().filter(|t| t[0] == t[1] || t[1] == t[2] || t[2] == t[0]).count();
        report.add("triangles that name a vertex twice, kept", repeated as u64, None);
        report.add("triangles without texture coordinates, set to 0", self.uv.without, None);
        let chart = (!self.chart.is_empty()).then_some(self.chart);
        FaceColumns {
            triangles: self.triangles,
            corner_uv: self.uv.rows(),
            corner_normal: self.normal.rows(),
            corner_normals: None,
            chart,
            polygons,
        }
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
