//! Colours: red, green, blue in [0, 1].

/// A colour.
pub type Rgb = [f32; 3];

/// A colour, 8 bits a channel.
pub type Rgb8 = [u8; 3];

/// A colour in 8 bits a channel.
pub fn eight_bits(color: Rgb) -> Rgb8 {
    color.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8)
}

/// `t` of the way from a to b.
pub fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

/// A colour times a brightness.
pub fn scaled(a: Rgb, s: f32) -> Rgb {
    a.map(|x| x * s)
}

/// A colour for a chart: hues a golden angle apart, so that any few charts differ; grey where there is no
/// chart.
pub fn chart_color(chart: u32) -> Rgb {
    if chart == u32::MAX {
        return [0.6; 3];
    }
    let hue = (f64::from(chart) * 0.618_033_988_749_895).fract() as f32;
    let (saturation, value) =
        ([0.55, 0.40, 0.65][chart as usize % 3], [0.95, 0.88, 0.80][chart as usize / 3 % 3]);
    std::array::from_fn(|k| {
        let x = ((hue * 6.0 + [5.0, 3.0, 1.0][k]) % 6.0).clamp(0.0, 6.0);
        value - value * saturation * x.min(4.0 - x).clamp(0.0, 1.0)
    })
}

/// Where nothing is.
pub const BACKGROUND: Rgb = [1.0, 1.0, 1.0];
/// Front of a face without a colour of its own.
pub const FRONT: Rgb = [0.74, 0.77, 0.80];
/// Back of a face.
pub const BACK: Rgb = [0.93, 0.55, 0.25];
/// Edges and seams.
pub const LINE: Rgb = [0.15, 0.15, 0.2];
/// Edges with one face.
pub const BOUNDARY: Rgb = [0.90, 0.05, 0.05];
/// Edges with more than two faces.
pub const NON_MANIFOLD: Rgb = [0.90, 0.0, 0.90];
/// Faces that are turned over in the UV layout.
pub const FLIPPED: Rgb = [0.0, 0.0, 0.0];
/// Places of the UV layout that more than one face covers.
pub const OVERLAP: Rgb = [1.0, 0.0, 0.0];
