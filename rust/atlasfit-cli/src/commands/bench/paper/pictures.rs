//! Pictures of what was fitted, as PNG files in the output folder.

use super::args::Args;
use crate::commands::bench::shared::STYLE;
use crate::commands::render::write_png;
use crate::render::camera::View;
use crate::render::color::chart_color;
use crate::render::{Mode, Style, render};
use anyhow::Result;
use atlasfit::Context;
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit_net::explicit::NetworkAtlas;

/// A picture of the charts, each in its colour.
pub fn draw(args: &Args, name: &str, atlas: &NetworkAtlas, ctx: &Context<'_>) -> Result<()> {
    let mut mesh = atlas.surface();
    if atlas.grid[0] == 1 {
        return draw_points(args, name, vec3::of(&mesh.positions), ctx);
    }
    let batch = atlas.grid[0] * atlas.grid[1];
    let color = |i: usize| {
        let [r, g, b] = chart_color((i / batch) as u32);
        [r, g, b, 1.0]
    };
    mesh.colors = Some((0..mesh.positions.len()).map(color).collect());
    draw_mesh(args, name, &mesh, Mode::Shaded, ctx)
}

/// A picture of points; none where there are none.
pub fn draw_points(args: &Args, name: &str, points: &[Vec3], ctx: &Context<'_>) -> Result<()> {
    if points.is_empty() {
        Ok(())
    } else {
        draw_mesh(args, name, &TriMesh::new(vec3::plain(points.to_vec()), Vec::new()), Mode::Points, ctx)
    }
}

/// A picture of a mesh, from the front where it is flat.
pub fn draw_mesh(args: &Args, name: &str, mesh: &TriMesh, mode: Mode, ctx: &Context<'_>) -> Result<()> {
    let flat = mesh.positions.iter().all(|p| p[2] == 0.0);
    let view = if flat { View { azimuth: 0.0, elevation: 0.0 } } else { STYLE.view };
    let picture = render(mesh, None, &Style { mode, view, ..STYLE }, ctx)?;
    write_png(&args.output.join(format!("{name}.png")), &picture)
}
