//! Polygons in, triangles out: gathers the faces of a file in order, checks their indices once all vertices are
//! known, and triangulates polygons so that they do not fold (ear clipping in the polygon's mean plane, Meisters
//! 1975). A polygon of n corners always gives n - 2 triangles, so that collinear corners stay connected. The polygons
//! themselves are kept beside the triangles, so that they can be written again.

use crate::load::LoadReport;
use atlasfit::Vec3;

/// Ear clipping is quadratic at worst: beyond this many tests in one file, polygons become plain fans.
const MOST_TESTS: u64 = 1 << 26;

/// An index that no vertex has.
pub const NO_VERTEX: u32 = u32::MAX;

/// The faces of a file as polygons: what its triangles were cut from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Polygons {
    /// Corners per face, at least 3, in file order. A face of n corners is n - 2 of the triangles, in the same order.
    pub sizes: Vec<u32>,
    /// The corners of all faces, one face after the other.
    pub corners: Vec<u32>,
}

impl Polygons {
    /// The polygon that each triangle was cut from.
    #[must_use]
    pub fn of_triangles(&self) -> Vec<u32> {
        (self.sizes.iter().zip(0u32..))
            .flat_map(|(&n, i)| std::iter::repeat_n(i, n.saturating_sub(2) as usize))
            .collect()
    }
}

/// The columns of the faces read.
pub struct Finished {
    pub triangles: Vec<[u32; 3]>,
    pub corner_uv: Option<Vec<[[f32; 2]; 3]>>,
    pub chart: Option<Vec<u32>>,
    /// `None` if all faces are triangles.
    pub polygons: Option<Polygons>,
}

struct Polygon {
    triangle: usize,
    corner: usize,
    len: usize,
}

/// The faces read so far.
#[derive(Default)]
pub struct Faces {
    pub triangles: Vec<[u32; 3]>,
    uv: Vec<[[f32; 2]; 3]>,
    has_uv: bool,
    without_uv: u64,
    pub chart: Vec<u32>,
    polygons: Vec<Polygon>,
    corners: Vec<u32>,
    corner_uv: Vec<[f32; 2]>,
    too_small: u64,
}

/// A vertex index of a file as ours.
pub fn index(value: i64) -> u32 {
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
    pub fn finish(mut self, positions: &[[f64; 3]], report: &mut LoadReport) -> Finished {
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
        let uv = self.has_uv.then_some(self.uv);
        let chart = (!self.chart.is_empty()).then_some(self.chart);
        Finished { triangles: self.triangles, corner_uv: uv, chart, polygons }
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

fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut i = 0;
    values.retain(|_| {
        i += 1;
        keep.get(i - 1).copied().unwrap_or(true)
    });
}

/// Cuts a polygon into `corners.len() - 2` triangles of local corner numbers.
fn triangulate(positions: &[[f64; 3]], corners: &[u32], tests: &mut u64, out: &mut Vec<[u32; 3]>) {
    let n = corners.len();
    let at = |i: usize| Vec3(positions[corners[i] as usize]);
    out.clear();
    // Newell's normal, relative to the first corner so that far-away coordinates do not cancel.
    let mut normal = Vec3::ZERO;
    for i in 1..n - 1 {
        normal += (at(i) - at(0)).cross(at(i + 1) - at(0));
    }
    let largest = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(2);
    let flat = |i: usize| {
        let p = at(i) - at(0);
        let (u, v) = (p[(largest + 1) % 3], p[(largest + 2) % 3]);
        if normal[largest] < 0.0 { [v, u] } else { [u, v] }
    };
    let turn =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if n == 4 {
        // Both triangles of a diagonal must face as the polygon does; of two such diagonals the shorter.
        let facing = |a, b, c| (at(b) - at(a)).cross(at(c) - at(a)).dot(normal) > 0.0;
        let first = facing(0, 1, 2) && facing(0, 2, 3);
        let second = facing(1, 2, 3) && facing(1, 3, 0);
        let shorter = at(1).dist2(at(3)) < at(0).dist2(at(2)) * (1.0 - 1e-12);
        let split: [[u32; 3]; 2] =
            if second && (!first || shorter) { [[1, 2, 3], [1, 3, 0]] } else { [[0, 1, 2], [0, 2, 3]] };
        out.extend(split);
        return;
    }
    let points: Vec<[f64; 2]> = (0..n).map(flat).collect();
    let reflex: Vec<usize> =
        (0..n).filter(|&i| turn(points[(i + n - 1) % n], points[i], points[(i + 1) % n]) < 0.0).collect();
    if reflex.is_empty() || *tests == 0 {
        out.extend((1..n as u32 - 1).map(|i| [0, i, i + 1]));
        return;
    }
    let mut next: Vec<usize> = (0..n).map(|i| (i + 1) % n).collect();
    let mut previous: Vec<usize> = (0..n).map(|i| (i + n - 1) % n).collect();
    let mut gone = vec![false; n];
    let mut left = n;
    let mut i = 0;
    // Corners looked at since the last cut; a full round without an ear means a self-crossing or flat polygon.
    let mut looked = 0;
    while left > 3 {
        let (a, c) = (previous[i], next[i]);
        let area = turn(points[a], points[i], points[c]);
        let forced = looked >= left || *tests == 0;
        let ear = forced
            || area > 0.0 && {
                *tests = tests.saturating_sub(reflex.len() as u64);
                !reflex.iter().any(|&r| {
                    let p = points[r];
                    !gone[r]
                        && r != a
                        && r != i
                        && r != c
                        && p != points[a]
                        && p != points[i]
                        && p != points[c]
                        && turn(points[a], points[i], p) >= 0.0
                        && turn(points[i], points[c], p) >= 0.0
                        && turn(points[c], points[a], p) >= 0.0
                })
            };
        if ear {
            out.push([a as u32, i as u32, c as u32]);
            next[a] = c;
            previous[c] = a;
            gone[i] = true;
            left -= 1;
            looked = 0;
            i = c;
        } else {
            looked += 1;
            i = c;
        }
    }
    out.push([previous[i] as u32, i as u32, next[i] as u32]);
}
