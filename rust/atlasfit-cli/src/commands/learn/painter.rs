//! The project's renderer and image readers, as learning asks for them.

use crate::files;
use crate::render::camera::{Up, View};
use crate::render::{Mode, Style, render};
use atlasfit::bake::Image;
use atlasfit::geometry::TriMesh;
use atlasfit::{Context, Result};
use atlasfit_learn::data::Painter;

/// Draws by the program's renderer.
pub struct Renderer;

impl Painter for Renderer {
    fn draw(
        &self,
        mesh: &TriMesh,
        [azimuth, elevation]: [f64; 2],
        side: usize,
        ctx: &Context<'_>,
    ) -> Result<Image> {
        let style = Style {
            mode: Mode::Shaded,
            view: View { azimuth, elevation },
            up: Up::Y,
            size: [side; 2],
            flat: true,
            boundary: false,
            colors: false,
            point_size: None,
        };
        let picture = render(mesh, None, &style, ctx)?;
        let rgba = picture.rgb.as_chunks::<3>().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect();
        Ok(Image { width: side as u32, height: side as u32, rgba })
    }

    fn read(&self, bytes: &[u8]) -> std::result::Result<Image, String> {
        files::read_image(bytes).map_err(|e| format!("{e:#}"))
    }
}
