//! Whether two parts of a surface have one shape.
//!
//! In: two parts, whether one may be the other's mirror image. Out: for each face of one the face of the
//! other that lies on it, corner by corner. The faces of both are walked through at once, from one edge of
//! the first and each of the other that has its length; then all vertices must have the same distances from
//! four of them, which leaves a rigid motion or a mirror image, and these four tell which.

use super::constants::STACK;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::unwrap::surface::{NONE, Surface};

/// A connected part of the surface.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    /// Its faces, ascending.
    pub faces: &'a [u32],
    /// Its half-edges without a twin.
    open: usize,
    group: u32,
    /// Summed length of its half-edges.
    pub length: f64,
    /// The longest of its open half-edges, of which there are few; of all where none is open.
    start: u32,
    /// The farthest that one of its vertices is from its first.
    size: f64,
}

impl<'a> Part<'a> {
    pub(super) fn new(s: &Surface, faces: &'a [u32], group: u32) -> Self {
        let mut out = Self { faces, open: 0, group, length: 0.0, start: faces[0] * 3, size: 0.0 };
        let first = s.pos[s.tri[faces[0] as usize][0] as usize];
        let rank = |h: u32| (twin(s, h) == NONE, length(s, h));
        for h in faces.iter().flat_map(|f| [0, 1, 2].map(|k| 3 * f + k)) {
            out.open += usize::from(twin(s, h) == NONE);
            out.length += length(s, h);
            out.size = out.size.max(first.dist2(s.pos[s.tri[h as usize / 3][h as usize % 3] as usize]));
            if rank(h) > rank(out.start) {
                out.start = h;
            }
        }
        out.size = out.size.sqrt();
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
    /// How far the file rounds positions.
    rounded: f64,
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
    pub(super) fn new(s: &'a Surface, rounded: f64) -> Self {
        let (place, taken) = (vec![NONE; s.faces()], vec![false; s.faces()]);
        Self { s, rounded, place, taken, walked: Vec::new(), open: Vec::new() }
    }

    /// Lengths of a part and another one that differ by no more are equal. Each end of an edge is rounded, in
    /// both parts.
    pub(super) fn slack(&self, part: &Part<'_>) -> f64 {
        STACK.alike * part.size + 4.0 * self.rounded
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
        ctx: &Context<'_>,
    ) -> Result<bool> {
        let (s, slack) = (self.s, self.slack(part));
        let starts = other.faces.iter().flat_map(|f| [0, 1, 2].map(|k| 3 * f + k));
        let open = twin(s, part.start) == NONE;
        let wanted = length(s, part.start);
        for start in
            starts.filter(|&h| (twin(s, h) == NONE) == open && (length(s, h) - wanted).abs() <= slack)
        {
            ctx.check()?;
            if self.walk([part.start, start], mirrored, slack, ctx)?
                && self.walked.len() == part.faces.len()
                && self.congruent(part, mirrored, slack, ctx)?
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

    /// Whether a rigid motion, or that of a mirror image, lays the part on the other as it was walked
    /// through.
    fn congruent(&self, part: &Part<'_>, mirrored: bool, slack: f64, ctx: &Context<'_>) -> Result<bool> {
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
        let Some(first) = pairs().next() else { return Ok(false) };
        let farthest = |score: &dyn Fn(Vec3) -> f64| -> Result<(f64, [Vec3; 2])> {
            ctx.check()?;
            Ok(pairs()
                .map(|p| (score(p[0]), p))
                .fold((0.0, first), |best, p| if p.0 > best.0 { p } else { best }))
        };
        let (_, a) = farthest(&|p| p.dist2(first[0]))?;
        let (wide, b) = farthest(&|p| p.dist2(a[0]))?;
        let along = b[0] - a[0];
        let (_, c) = farthest(&|p| along.cross(p - a[0]).norm2())?;
        let across = along.cross(c[0] - a[0]);
        let (volume, d) = farthest(&|p| across.dot(p - a[0]).abs())?;
        let all = [a, b, c, d];
        let same = |p: [Vec3; 2]| {
            all.iter().all(|q| (p[0].dist2(q[0]).sqrt() - p[1].dist2(q[1]).sqrt()).abs() <= 2.0 * slack)
        };
        // A flat part is its own mirror image.
        let flat = volume <= STACK.flat * wide.powf(1.5);
        let side = |k: usize| (b[k] - a[k]).cross(c[k] - a[k]).dot(d[k] - a[k]) > 0.0;
        Ok((flat || (side(0) == side(1)) != mirrored) && pairs().all(same))
    }
}
