//! The font that comes with the program, so that text looks the same everywhere.

use anyhow::Result;

/// The font of all text.
pub const FONT: &str = "sans-serif";

/// Makes the font known; before any text is drawn. In a browser there is no text in pictures.
pub fn fonts() -> Result<()> {
    #[cfg(not(target_family = "wasm"))]
    {
        use plotters::style::{FontStyle, register_font};
        let font = epaint_default_fonts::UBUNTU_LIGHT;
        register_font(FONT, FontStyle::Normal, font)
            .map_err(|_| anyhow::anyhow!("the program's font is damaged"))?;
    }
    Ok(())
}
