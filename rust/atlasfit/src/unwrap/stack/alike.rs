//! Whether two parts of a surface have one shape.
//!
//! In: two parts, whether one may be the other's mirror image. Out: for each face of one the face of the other
//! that lies on it, corner by corner. The faces of both are walked through at once, from one edge of the first
//! and each of the other that has its length; then all vertices must have the same distances from four of
//! them, which leaves a rigid motion or a mirror image, and these four tell which.

use super::constants::STACK;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::unwrap::surface::{NONE, Surface};

/// A connected part of the surface.
pub(super) struct Part<'a> {
    /// Its faces, ascending.
    pub faces: &'a [u32],
    /// Its half-edges without a twin.
    open: usize,
    group: u32,
    /// Summed length of its half-edges.
    pub length: f64,
    /// The longest of them.
    longest: u32,
}

impl<'a> Part<'a> {
    pub(super) fn new(s: &Surface, faces: &'a [u32], group: u32) -> Self {
        let mut out = Self { faces, open: 0, group, length: 0.0, longest: faces[0] * 3 };
        for h in faces.iter().flat_map(|f| [0, 1, 2].map(|k| 3 * f + k)) {
            out.open += usize::from(twin(s, h) == NONE);
            out.length += length(s, h);
            if length(s, h) > length(s, out.longest) {
                out.longest = h;
            }
        }
        out
    }

    /// What parts of one shape have alike exactly.
    pub(super) fn kind(&self) -> (usize, usize, u32) {
        (self.faces.len(), self.open, self.group)
    }

    /// Number of its half-edges.
    pub(super) fn edges(&self) -> f64 {
        3.0 * self.faces.len() as f64
    }
}

fn twin(s: &Surface, h: u32) -> u32 {
    s.twin[h as usize / 3][h as usize % 3]
}

fn length(s: &Surface, h: u32) -> f64 {
    f64::from(s.length[h as usize / 3][h as usize % 3])
}

/// What is needed to compare parts, again and again.
pub(super) struct Matcher<'a> {
    s: &'a Surface,
    /// For each face that was walked through, `3 * face + corner` of the other part: where its first corner
    /// lies.
    place: Vec<u32>,
    /// Whether a face of the other part is taken.
    taken: Vec<bool>,
    /// Faces that were walked through.
    walked: Vec<u32>,
    open: Vec<[u32; 2]>,
}

impl<'a> Matcher<'a> {
    pub(super) fn new(s: &'a Surface) -> Self {
        let (place, taken) = (vec![NONE; s.faces()], vec![false; s.faces()]);
        Self { s, place, taken, walked: Vec::new(), open: Vec::new() }
    }

    /// Where the first corner of a face of the first part lies: `3 * face + corner` of the other one.
    pub(super) fn place(&self, face: u32) -> u32 {
        self.place[face as usize]
    }

    /// Whether the parts have one shape; [`place`](Self::place) then says how they lie on each other.
    pub(super) fn alike(
        &mut self,
        part: &Part<'_>,
        other: &Part<'_>,
        mirrored: bool,
        rounded: f64,
        ctx: &Context<'_>,
    ) -> Result<bool> {
        let s = self.s;
        let corner = |f: u32| s.tri[f as usize].map(|v| s.pos[v as usize]);
        let first = corner(part.faces[0])[0];
        let size =
            part.faces.iter().flat_map(|&f| corner(f)).map(|p| p.dist2(first)).fold(0.0, f64::max).sqrt();
        let slack = STACK.alike * size + 4.0 * rounded;
        let wanted = length(s, part.longest);
        let starts = other.faces.iter().flat_map(|f| [0, 1, 2].map(|k| 3 * f + k));
        for start in starts.filter(|&h| (length(s, h) - wanted).abs() <= slack) {
            ctx.check()?;
            if self.walk([part.longest, start], mirrored, slack, ctx)?
                && self.walked.len() == part.faces.len()
                && self.congruent(part, mirrored, slack)
            {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Walks through both parts at once, from one half-edge of each; false where they differ.
    fn walk(&mut self, start: [u32; 2], mirrored: bool, slack: f64, ctx: &Context<'_>) -> Result<bool> {
        let s = self.s;
        for f in self.walked.drain(..) {
            self.taken[self.place[f as usize] as usize / 3] = false;
            self.place[f as usize] = NONE;
        }
        self.open.clear();
        self.open.push(start);
        while let Some([g, h]) = self.open.pop() {
            let (f, k, on, l) = (g / 3, g % 3, h / 3, h % 3);
            // A half-edge starts where the other one starts, or ends in a mirror image.
            let at = 3 * on + if mirrored { l + 1 + k } else { l + 3 - k } % 3;
            if self.place[f as usize] != NONE {
                if self.place[f as usize] != at {
                    return Ok(false);
                }
                continue;
            }
            if self.taken[on as usize] {
                return Ok(false);
            }
            self.place[f as usize] = at;
            self.taken[on as usize] = true;
            self.walked.push(f);
            ctx.check_at(self.walked.len())?;
            for i in 0..3 {
                let g = 3 * f + (k + i) % 3;
                let h = 3 * on + if mirrored { l + 3 - i } else { l + i } % 3;
                let (to, beyond) = (twin(s, g), twin(s, h));
                let whole = |h: u32, to: u32| to != NONE && s.cell(h / 3) == s.cell(to / 3);
                if (length(s, g) - length(s, h)).abs() > slack
                    || (to == NONE) != (beyond == NONE)
                    || whole(g, to) != whole(h, beyond)
                {
                    return Ok(false);
                }
                if to != NONE {
                    self.open.push([to, beyond]);
                }
            }
        }
        Ok(true)
    }

    /// Whether a rigid motion, or that of a mirror image, lays the part on the other as it was walked through.
    fn congruent(&self, part: &Part<'_>, mirrored: bool, slack: f64) -> bool {
        let s = self.s;
        // Each corner of the part, and the place that it would lie on.
        let pairs = || {
            part.faces.iter().flat_map(|&f| {
                let (on, c) = (self.place[f as usize] / 3, self.place[f as usize] % 3);
                [0u32, 1, 2].map(|i| {
                    let j = if mirrored { c + 3 - i } else { c + i } % 3;
                    [s.tri[f as usize][i as usize], s.tri[on as usize][j as usize]].map(|v| s.pos[v as usize])
                })
            })
        };
        let farthest = |score: &dyn Fn(Vec3) -> f64| {
            pairs().fold(None, |best: Option<(f64, [Vec3; 2])>, p| match best {
                Some(b) if b.0 >= score(p[0]) => Some(b),
                _ => Some((score(p[0]), p)),
            })
        };
        let Some(a) = pairs().next() else { return false };
        let Some((_, a)) = farthest(&|p| p.dist2(a[0])) else { return false };
        let Some((wide, b)) = farthest(&|p| p.dist2(a[0])) else { return false };
        let along = b[0] - a[0];
        let Some((_, c)) = farthest(&|p| along.cross(p - a[0]).norm2()) else { return false };
        let across = along.cross(c[0] - a[0]);
        let Some((volume, d)) = farthest(&|p| across.dot(p - a[0]).abs()) else { return false };
        let all = [a, b, c, d];
        let same = |p: [Vec3; 2]| {
            all.iter().all(|q| (p[0].dist2(q[0]).sqrt() - p[1].dist2(q[1]).sqrt()).abs() <= 2.0 * slack)
        };
        // A flat part is its own mirror image.
        let flat = volume <= STACK.flat * wide.powf(1.5);
        let side = |k: usize| (b[k] - a[k]).cross(c[k] - a[k]).dot(d[k] - a[k]) > 0.0;
        (flat || (side(0) == side(1)) != mirrored) && pairs().all(same)
    }
}
