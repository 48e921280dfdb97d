//! What can be turned in the report: points and a surface, each in several colourings, as JSON with packed
//! arrays.
//!
//! In: positions, triangles, colours. Out: the JSON that `viewer.js` reads. Positions are whole numbers of 16
//! bits in a cube about the surface; what lies outside of it is not shown. Large scans and meshes are made
//! light first ([`light_mesh`], [`light_points`]), so that a page stays below 10 MB.

use crate::number::short;
use crate::render::color::{Rgb8, chart_color, eight_bits};
use crate::render::scale::Scale;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::{self, Pages};
use atlasfit::numeric::rng::shuffled;
use atlasfit::simplify::{SimplifyOptions, simplify_mesh};
use atlasfit::spatial::bvh::Aabb;
use atlasfit::{Context, Result, Vec3};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

/// Triangles of a page, about: 40 bytes each.
const MOST_TRIANGLES: usize = 100_000;
/// Points of a page: 30 bytes each, before and after.
const MOST_POINTS: usize = 100_000;
/// Side of the cube that is shown, in sides of the box about the surface: strays near it are seen.
const ROOM: f64 = 1.6;

/// Points, a surface, and the ways to show them.
#[derive(Default)]
pub struct Scene {
    pub clouds: Vec<Cloud>,
    pub mesh: Option<TriMesh>,
    pub shows: Vec<Show>,
    /// What is shown first, left and right, by its place in `shows`.
    pub start: [usize; 2],
}

/// Points.
#[derive(Default)]
pub struct Cloud {
    pub positions: Vec<[f64; 3]>,
    /// Unit normals for the light, or zeros; empty: none.
    pub normals: Vec<[f32; 3]>,
}

/// A way to show something.
pub struct Show {
    pub name: &'static str,
    pub what: What,
    /// A colour for each point, vertex or face; empty: one for all.
    pub colors: Vec<Rgb8>,
    pub legend: Option<Scale>,
}

/// What is shown.
#[derive(Clone, Copy)]
pub enum What {
    /// The cloud of this number.
    Cloud(usize),
    /// The surface in colours of its vertices, or in one.
    Vertices,
    /// The surface in colours of its faces.
    Faces,
    /// The surface under a checker of the UVs.
    Checker,
    /// The UVs themselves, in colours of the faces.
    Uvs,
}

impl Show {
    pub fn new(name: &'static str, what: What) -> Self {
        Self { name, what, colors: Vec::new(), legend: None }
    }

    pub fn with_colors(self, colors: Vec<Rgb8>) -> Self {
        Self { colors, ..self }
    }

    /// Vertices' own colours; how much one can see through them does not count.
    pub fn with_vertex_colors(self, colors: &[[f32; 4]]) -> Self {
        self.with_colors(colors.iter().map(|&[r, g, b, _]| eight_bits([r, g, b])).collect())
    }

    /// Numbers as colours.
    pub fn with_values(self, values: &[f64], scale: Scale) -> Self {
        Self {
            colors: values.iter().map(|&v| eight_bits(scale.color(v))).collect(),
            legend: Some(scale),
            ..self
        }
    }

    fn json(&self) -> Value {
        let (of, cloud) = match self.what {
            What::Cloud(number) => ("cloud", number),
            What::Vertices => ("vertices", 0),
            What::Faces => ("faces", 0),
            What::Checker => ("checker", 0),
            What::Uvs => ("uvs", 0),
        };
        let legend = self.legend.as_ref().map(|scale| {
            let [from, to] = scale.ends().map(short);
            json!({ "from": from, "to": to, "colors": scale.colors().map(eight_bits) })
        });
        json!({
            "name": self.name, "of": of, "cloud": cloud, "rgb": packed(self.colors.as_flattened()),
            "legend": legend,
        })
    }
}

/// The mesh, or one with so few triangles that a page holds it.
pub fn light_mesh(mesh: &TriMesh, ctx: &Context<'_>) -> Result<TriMesh> {
    if mesh.triangles.len() <= MOST_TRIANGLES {
        return Ok(mesh.clone());
    }
    let options = SimplifyOptions::default().with_faces(Some(MOST_TRIANGLES));
    Ok(simplify_mesh(mesh, &options, ctx)?.mesh)
}

/// The numbers of the points of so many that are shown: all, or some at random.
pub fn light_points(points: usize, seed: u64) -> Vec<u32> {
    let mut some = shuffled(points, seed);
    some.truncate(MOST_POINTS);
    some.sort_unstable();
    some
}

/// The surface in one colour and in its own, under these two names.
pub fn show_mesh(scene: &mut Scene, [plain, colored]: [&'static str; 2], mesh: &TriMesh) {
    scene.shows.push(Show::new(plain, What::Vertices));
    if let Some(colors) = &mesh.colors {
        scene.shows.push(Show::new(colored, What::Vertices).with_vertex_colors(colors));
    }
}

/// The checker, the charts on the surface and on the page, and the stretch.
pub fn show_uvs(scene: &mut Scene, mesh: &TriMesh, pages: &Pages<'_>, ctx: &Context<'_>) -> Result<()> {
    scene.shows.push(Show::new("Checker through the UVs", What::Checker));
    let charts = uv::charts(mesh, ctx)?;
    let colors: Vec<Rgb8> = charts.of_face.iter().map(|&c| eight_bits(chart_color(c))).collect();
    scene.shows.push(Show::new("Charts", What::Faces).with_colors(colors.clone()));
    scene.shows.push(Show::new("UV layout (turned faces black)", What::Uvs).with_colors(colors));
    let stretch: Vec<f64> = uv::face_stretch(mesh, pages, ctx)?.into_iter().map(f64::from).collect();
    let most = Scale::over("stretch", &stretch).ends()[1].max(1.1);
    let scale = Scale::between("stretch", 1.0, most);
    scene.shows.push(Show::new("Stretch (1 = lengths are kept)", What::Faces).with_values(&stretch, scale));
    Ok(())
}

/// A cube: its least corner and its side.
struct Cube {
    least: [f64; 3],
    side: f64,
}

/// The cube about all finite points, a little larger.
fn about(points: &[[f64; 3]]) -> Cube {
    let finite = points.iter().filter(|p| p.iter().all(|x| x.is_finite()));
    let bounds = Aabb::of(&finite.map(|p| Vec3(*p)).collect::<Vec<_>>());
    let side = match bounds.longest_side() {
        longest if longest > 0.0 => ROOM * longest,
        _ => 1.0,
    };
    let middle = (bounds.min + bounds.max) * 0.5;
    let least = middle.0.map(|x| if x.is_finite() { x - 0.5 * side } else { 0.0 });
    Cube { least, side }
}

impl Cube {
    /// Three numbers of 16 bits for each point; the largest, 65535, three times where it lies outside.
    fn packed(&self, points: &[[f64; 3]]) -> String {
        let mut bytes = Vec::with_capacity(6 * points.len());
        for p in points {
            let at: [f64; 3] = std::array::from_fn(|k| 65534.0 * (p[k] - self.least[k]) / self.side);
            let inside = at.iter().all(|x| (0.0..=65534.0).contains(x));
            for x in at {
                let whole = if inside { x.round() as u16 } else { u16::MAX };
                bytes.extend(whole.to_le_bytes());
            }
        }
        packed(&bytes)
    }
}

/// Bytes as text.
fn packed(bytes: &[u8]) -> String {
    BASE64_STANDARD.encode(bytes)
}

impl Scene {
    /// What the viewer reads.
    pub fn json(&self) -> Value {
        // Of the scan only where nothing else is there: its strays would make the rest small.
        let points = self.clouds.last().map(|cloud| &cloud.positions);
        let shown = self.mesh.as_ref().map(|mesh| &mesh.positions).or(points);
        let cube = about(shown.map_or(&[], Vec::as_slice));
        let clouds: Vec<Value> = self.clouds.iter().map(|c| c.json(&cube)).collect();
        let shows: Vec<Value> = self.shows.iter().map(Show::json).collect();
        json!({
            "clouds": clouds, "mesh": self.mesh.as_ref().map(|m| mesh_json(m, &cube)), "shows": shows,
            "start": self.start,
        })
    }
}

impl Cloud {
    fn json(&self, cube: &Cube) -> Value {
        // In 8 bits a coordinate: for shading only.
        let eighth = |x: f32| ((127.0 * x).round() as i8).to_le_bytes()[0];
        let normals: Vec<u8> = self.normals.as_flattened().iter().map(|&x| eighth(x)).collect();
        json!({ "xyz": cube.packed(&self.positions), "normals": packed(&normals) })
    }
}

fn mesh_json(mesh: &TriMesh, cube: &Cube) -> Value {
    let corners: Vec<u8> = mesh.triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let uv = mesh.corner_uv.as_ref().map(|uv| {
        let all = || uv.as_flattened().iter().filter(|p| p.iter().all(|x| x.is_finite()));
        let least = all().fold([0.0; 2], |m: [f32; 2], p| [m[0].min(p[0]), m[1].min(p[1])]);
        let most = all().fold([1.0; 2], |m: [f32; 2], p| [m[0].max(p[0]), m[1].max(p[1])]);
        let side = (most[0] - least[0]).max(most[1] - least[1]);
        let whole = |p: &[f32; 2], k: usize| (65535.0 * (p[k] - least[k]) / side).round() as u16;
        let bytes: Vec<u8> = (uv.as_flattened().iter())
            .flat_map(|p| [whole(p, 0), whole(p, 1)])
            .flat_map(u16::to_le_bytes)
            .collect();
        json!({ "least": least, "side": side, "most": most, "of_corners": packed(&bytes) })
    });
    json!({ "xyz": cube.packed(&mesh.positions), "triangles": packed(&corners), "uv": uv })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_kept_to_a_part_in_ten_thousand_and_strays_do_not_count() {
        let surface =
            TriMesh::new(vec![[5e5, 0.0, 0.0], [5e5 + 1.0, 0.0, 0.0], [5e5, 1.0, 0.0]], vec![[0, 1, 2]]);
        let scene = Scene {
            clouds: vec![Cloud {
                positions: vec![[5e5 + 0.25, 0.5, 0.0], [0.0, 0.0, 0.0], [f64::NAN; 3]],
                normals: Vec::new(),
            }],
            mesh: Some(surface),
            ..Scene::default()
        };
        let json = scene.json();
        let bytes = BASE64_STANDARD.decode(json["clouds"][0]["xyz"].as_str().unwrap()).unwrap();
        let whole: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect();
        let x = 1.6 * f64::from(whole[0]) / 65534.0 - 0.3;
        assert!((x - 0.25).abs() < 1e-4, "{x}");
        assert_eq!(whole[3..], [u16::MAX; 6], "outside, and no number");
    }
}
