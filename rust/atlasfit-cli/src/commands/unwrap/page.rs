//! The page of `unwrap --report`: the mesh with a checker, its charts, its stretch and its UV layout.
//!
//! In: the mesh with its new UVs. Out: the bytes of an HTML file.

use crate::console::Console;
use crate::number::{counted, short};
use crate::page::Page;
use crate::page::bars::Bars;
use crate::page::scene::{Scene, light_mesh, show_mesh, show_uvs};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::{Pages, face_stretch};
use atlasfit::{Context, Result, Stage};

/// The histogram of the stretch ends here, or at the bound if that is larger.
const MOST_STRETCH: f64 = 1.5;

/// What was done.
pub struct Unwrapped<'a> {
    /// With its new UVs.
    pub mesh: &'a TriMesh,
    /// Width and height of a page in texels.
    pub page: [u32; 2],
    /// Bound on the stretch of 95% of the area.
    pub bound: f64,
    pub stages: &'a [(Stage, f64)],
    /// The name of the mesh's file.
    pub name: String,
}

/// Makes the page. `facts` is the command's report as text.
pub fn page(done: &Unwrapped<'_>, facts: &str, console: &Console, ctx: &Context<'_>) -> Result<Vec<u8>> {
    // Pages lie side by side, which is no stretch.
    let pages = Pages { of_face: None, size: done.page.map(f64::from) };
    let mut scene = Scene::default();
    let mesh = light_mesh(done.mesh, ctx)?;
    show_mesh(&mut scene, ["Mesh", "Mesh in its colours"], &mesh);
    let checker = scene.shows.len();
    show_uvs(&mut scene, &mesh, &pages, ctx)?;
    // The checker, and the layout.
    scene.start = [checker, checker + 2];
    scene.mesh = Some(mesh);
    let stretch: Vec<f64> = face_stretch(done.mesh, &pages, ctx)?.into_iter().map(f64::from).collect();
    let words = format!(
        "How many of {} are stretched how much: 1 = lengths are kept. 95% of the area is to be below {}.",
        counted(stretch.len(), "triangle"),
        short(done.bound)
    );
    let bars = [
        Bars::histogram("Stretch", words, &stretch, [1.0, done.bound.max(MOST_STRETCH)]),
        Bars::of_stages(done.stages),
    ];
    let [notes, warnings] = console.told();
    let title = format!("{}: {} unwrapped", done.name, counted(done.mesh.triangles.len(), "triangle"));
    let page = Page { title, facts, warnings: &warnings, notes: &notes, scene: &scene, bars: &bars };
    Ok(page.html().into_bytes())
}
