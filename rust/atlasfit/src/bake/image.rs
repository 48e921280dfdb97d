//! What baking makes, and what it asks its sources for: plain data.

/// An image of 8 bits per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green, blue, alpha; row after row, the top row (v = 1) first.
    pub rgba: Vec<[u8; 4]>,
}

/// The colour at a point of a face: red, green, blue, alpha, each in [0, 1]. The point is given by the
/// weights of the face's corners.
pub(super) type ColorAt<'a> = Box<dyn Fn(u32, [f64; 3]) -> [f64; 4] + Sync + 'a>;
