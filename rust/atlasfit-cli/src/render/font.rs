//! The font that comes with the program, so that text looks the same everywhere.

use anyhow::{Result, anyhow};
use plotters::style::{FontStyle, register_font};

/// The font of all text.
pub const FONT: &str = "sans-serif";

/// Makes the font known; before any text is drawn.
pub fn fonts() -> Result<()> {
    register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| anyhow!("the program's font is damaged"))
}
