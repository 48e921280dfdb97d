//! Parts of one shape laid on each other: bolts, wheels, bricks share their texels.
//!
//! In: a surface, and what may be stacked. Out: which faces take their UVs from which others. Parts are what
//! hangs together after all cuts; two are of one shape where their meshes are alike face by face (`alike`).

mod alike;
mod constants;
#[cfg(test)]
mod tests;

use super::options::Stack;
use super::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort_by;
use crate::run::Context;
use alike::{Matcher, Part};

/// A face that takes the UVs of another one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StackedFace {
    pub face: u32,
    /// The face that it takes them of.
    pub of: u32,
    /// Corner of the face that the other's first one lies on.
    corner: u8,
    /// Whether corners run the other way.
    mirrored: bool,
}

impl StackedFace {
    /// What the face has at its corners, of what the other one has.
    pub(crate) fn taken<T: Copy>(&self, of: [T; 3]) -> [T; 3] {
        let c = usize::from(self.corner);
        [0, 1, 2].map(|j| of[if self.mirrored { c + 3 - j } else { j + 3 - c } % 3])
    }
}

/// What is laid on what.
#[derive(Debug, Default)]
pub(crate) struct Stacks {
    pub copies: Vec<StackedFace>,
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
    let faces = s.parts(ctx)?;
    let mut parts: Vec<Part<'_>> = Vec::with_capacity(faces.len());
    for own in &faces {
        ctx.check()?;
        parts.push(Part::new(s, own, group.map_or(0, |g| g[own[0] as usize])));
    }
    // Parts that may be alike follow each other.
    let order = |a: &Part<'_>, b: &Part<'_>| {
        a.kind().cmp(&b.kind()).then(a.length.total_cmp(&b.length)).then(a.faces.cmp(b.faces))
    };
    sort_by(&mut parts, order, ctx)?;
    let mirrors = if stack == Stack::Mirrored { &[false, true][..] } else { &[false] };
    let mut matcher = Matcher::new(s, rounded);
    for same in parts.chunk_by(|a, b| a.kind() == b.kind()) {
        // Parts that others lie on.
        let mut below: Vec<&Part<'_>> = Vec::new();
        for part in same {
            match copied(&mut matcher, &below, part, mirrors, ctx)? {
                Some(copies) => {
                    out.copies.extend(copies);
                    out.parts += 1;
                }
                None => below.push(part),
            }
        }
    }
    Ok(out)
}

/// The faces of a part as copies of those of one that it is alike, if there is one: the last that was found,
/// as lengths ascend.
fn copied(
    matcher: &mut Matcher<'_>,
    below: &[&Part<'_>],
    part: &Part<'_>,
    mirrors: &[bool],
    ctx: &Context<'_>,
) -> Result<Option<Vec<StackedFace>>> {
    let near = |other: &&&Part<'_>| part.length - other.length <= matcher.slack(part) * part.edges();
    for other in below.iter().rev().take_while(near).copied().collect::<Vec<_>>() {
        for &mirrored in mirrors {
            if matcher.alike(other, part, mirrored, ctx)? {
                let copy = |&f: &u32| {
                    let to = matcher.place(f);
                    StackedFace { face: to / 3, of: f, corner: (to % 3) as u8, mirrored }
                };
                return Ok(Some(other.faces.iter().map(copy).collect()));
            }
        }
    }
    Ok(None)
}
