//! Parts of one shape laid on each other: bolts, wheels, bricks share their texels.
//!
//! In: a surface, and what may be stacked. Out: which faces take their UVs from which others. Parts are what
//! hangs together after all cuts; two are of one shape where their meshes are alike face by face (`alike`).

mod alike;
mod constants;
#[cfg(test)]
mod tests;

use super::options::Stack;
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::lists::Lists;
use crate::spatial::sets::Sets;
use alike::{Matcher, Part};
use constants::STACK;

/// A face that takes the UVs of another one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Copy {
    pub face: u32,
    /// The face that it takes them of.
    pub of: u32,
    /// Corner of the face that the other's first one lies on.
    corner: u8,
    /// Whether corners run the other way.
    mirrored: bool,
}

impl Copy {
    /// What the face has at its corners, of what the other one has.
    pub(crate) fn taken<T: std::marker::Copy>(&self, of: [T; 3]) -> [T; 3] {
        let c = usize::from(self.corner);
        [0, 1, 2].map(|j| of[if self.mirrored { c + 3 - j } else { j + 3 - c } % 3])
    }
}

/// What is laid on what.
#[derive(Debug, Default)]
pub(crate) struct Stacks {
    pub copies: Vec<Copy>,
    /// Parts that lie on another one.
    pub parts: usize,
}

/// Finds the parts of one shape. `group` says which faces may be together; `rounded` is how far the file
/// rounds positions, in units of the surface.
pub(crate) fn stacks(
    s: &Surface,
    stack: Stack,
    group: Option<&[u32]>,
    rounded: f64,
    ctx: &Context<'_>,
) -> Result<Stacks> {
    let mut out = Stacks::default();
    if stack == Stack::None {
        return Ok(out);
    }
    let mut sets = Sets::new(s.faces());
    for (f, twins) in s.twin.iter().enumerate() {
        ctx.check_at(f)?;
        twins.iter().filter(|&&h| h != NONE).for_each(|&h| sets.join(f as u32, h / 3));
    }
    let root: Vec<[u32; 1]> = (0..s.faces() as u32).map(|f| [sets.find(f)]).collect();
    let faces = Lists::new(s.faces(), &root, ctx)?;
    let mut parts: Vec<Part<'_>> = Vec::new();
    for f in (0..s.faces() as u32).filter(|&f| root[f as usize][0] == f) {
        ctx.check_at(f as usize)?;
        if s.usable[f as usize] {
            parts.push(Part::new(s, faces.of(f), group.map_or(0, |g| g[f as usize])));
        }
    }
    // Parts that may be alike follow each other.
    parts.sort_by(|a, b| {
        a.kind().cmp(&b.kind()).then(a.length.total_cmp(&b.length)).then(a.faces.cmp(b.faces))
    });
    ctx.check()?;
    let mut matcher = Matcher::new(s);
    for same in parts.chunk_by(|a, b| a.kind() == b.kind()) {
        // Parts that others lie on.
        let mut below: Vec<&Part<'_>> = Vec::new();
        for part in same {
            let far =
                |p: &&&Part<'_>| part.length - p.length <= STACK.alike * part.length + rounded * part.edges();
            let mut found = false;
            for other in below.iter().rev().take_while(far) {
                ctx.check()?;
                let mirrors = if stack == Stack::Mirrored { &[false, true][..] } else { &[false] };
                for &mirrored in mirrors {
                    if matcher.alike(other, part, mirrored, rounded, ctx)? {
                        out.copies.extend(other.faces.iter().map(|&f| {
                            let to = matcher.place(f);
                            Copy { face: to / 3, of: f, corner: (to % 3) as u8, mirrored }
                        }));
                        found = true;
                        break;
                    }
                }
                if found {
                    break;
                }
            }
            if found {
                out.parts += 1;
            } else {
                below.push(part);
            }
        }
    }
    Ok(out)
}
