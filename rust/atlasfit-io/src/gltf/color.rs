//! Colours: linear light in glTF, sRGB in ours (IEC 61966-2-1).

/// sRGB to linear light, one channel in [0, 1].
pub(super) fn to_linear(c: f32) -> f32 {
    let c = f64::from(c);
    (if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }) as f32
}

/// Linear light to sRGB, one channel in [0, 1].
#[cfg(feature = "gltf")]
pub(super) fn to_srgb(c: f32) -> f32 {
    let c = f64::from(c);
    (if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }) as f32
}
