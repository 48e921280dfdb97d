//! A denoised scan's surface as a watertight shell.
//!
//! In: what denoising made. Out: the same with a shell for its surface, and UVs for it.

use crate::interface::Cgal;
use atlasfit::geometry::TriMesh;
use atlasfit::geometry::mesh::vertex_normals;
use atlasfit::pipeline::{DenoiseOptions, Denoised, uv_options};
use atlasfit::{Context, Result, measure, unwrap};

/// Radius of the ball that rolls over the surface, in spacings of the points: what is narrower is closed. A
/// hole of the sampling is about two wide. Source: chosen.
const ALPHA: f64 = 2.0;
/// Least distance of the shell from the surface, in spacings. Source: chosen: the shell's triangles get about
/// as large as this and `ALPHA` allow.
const OFFSET: f64 = 0.1;

/// Replaces the surface by a shell around it, as far off as the noise or a tenth of the spacing, whichever is
/// more. Colours and attributes of the surface are lost; a texture can be baked from the points.
///
/// # Errors
/// Those of [`Cgal::alpha_wrap`] and of [`unwrap`](fn@atlasfit::unwrap::unwrap).
pub fn wrap(
    denoised: &mut Denoised,
    cgal: &dyn Cgal,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<()> {
    let (spacing, noise) = (denoised.report.spacing, denoised.report.noise);
    let offset = noise.max(OFFSET * spacing);
    let shell = cgal.alpha_wrap(&denoised.surface, ALPHA * spacing, offset, ctx)?;
    let mut mesh = TriMesh {
        normals: Some(vertex_normals(&shell.positions, &shell.triangles)),
        ..TriMesh::new(shell.positions, shell.triangles)
    };
    denoised.report.uv_charts = 0;
    if options.uv {
        let layout = unwrap::unwrap(&mesh, &uv_options(options), ctx)?;
        (mesh.corner_uv, mesh.face_chart) = (Some(layout.corner_uv), Some(layout.face_chart));
        denoised.report.uv_charts = layout.charts;
    }
    let topology = measure::topology(&mesh, ctx)?;
    let lost = denoised.surface.colors.is_some() || !denoised.surface.attributes.is_empty();
    let report = &mut denoised.report;
    (report.parts, report.boundary_loops, report.boundary_edges) =
        (topology.parts, topology.boundary_loops, topology.boundary_edges);
    report.one_sided = false;
    if lost {
        report
            .warnings
            .push("the shell has no colours and attributes. Bake a texture from the points".into());
    }
    denoised.surface = mesh;
    Ok(())
}
