//! How overlapping charts face each other.

/// Two overlapping charts, `a` < `b`, and how much their normals agree over the points that they share:
/// positive when they face the same way, its size the number of points that say so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relation {
    /// First chart.
    pub a: u32,
    /// Second chart.
    pub b: u32,
    /// Signed agreement.
    pub agreement: f64,
}

/// Two overlapping charts, the first less than the second.
pub type Pair = (u32, u32);
