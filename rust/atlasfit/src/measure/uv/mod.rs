//! Quality of a mesh's UVs.
//!
//! In: a mesh with texture coordinates per corner. Out: charts, seams, stretch, flips, overlaps, coverage.

mod apart;
mod charts;
mod layout;
mod overlap;
mod seen;
mod stretch;

pub use crate::geometry::MOST_PAGES;
pub use charts::{Charts, charts};
pub use layout::{Pages, coverage};
pub use overlap::TEXELS;
pub use seen::seams_seen;
pub use stretch::face_stretch;

use super::memory;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::run::{Context, Stage};
use layout::{FaceUv, SAME_UV, corners, is_finite, laid_out};
use overlap::{overlapping, texels};
use rayon::prelude::*;
use stretch::{Areas, SingularValues, singular_values, stretch};

/// Faces per task: below a millisecond of work.
const BLOCK: usize = 4096;

/// Quality of UVs. Stretch is after one global scale that makes the summed areas equal: 1 = isometric.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct UvQuality {
    /// Faces.
    pub faces: usize,
    /// Groups of faces joined through edges with equal UVs at both ends.
    pub charts: usize,
    /// Length of the inner edges that are cut in the texture, divided by the square root of the surface's
    /// area: has no unit.
    pub seam: f64,
    /// Share of the length of the charts' outlines in the texture that is parallel to a side of the page, to
    /// within 1e-6 of the page for each edge: in [0, 1].
    pub straightness: f64,
    /// Sander's L2 stretch of the whole atlas, 1 or more; infinite where every face has collapsed.
    pub stretch_l2: f64,
    /// Sander's L-infinity stretch: the largest stretch from texture to surface of any face, collapsed faces
    /// left out.
    pub stretch_linf: f64,
    /// Median by area of max(s1, 1/s2), with s1 >= s2 the singular values of the map from surface to texture.
    pub stretch_median: f64,
    /// 95% of the area is below.
    pub stretch_p95: f64,
    /// Mean by area of s1/s2: 1 = conformal.
    pub conformal: f64,
    /// Faces turned against the majority of their chart.
    pub flips: usize,
    /// Faces with area in space and none in the texture, or with UVs that are not finite.
    pub degenerate: usize,
    /// Texels covered twice or more / texels covered, in [0, 1], on a texture of [`TEXELS`] squared.
    pub overlap: f64,
    /// Faces whose inside meets another face's inside in the texture, by exact predicates.
    pub overlapping_faces: usize,
    /// Texels covered / texels of the pages, in [0, 1].
    pub coverage: f64,
    /// Whether all UVs lie in [0, 1].
    pub inside: bool,
    /// Whether all UVs are finite.
    pub finite: bool,
}

/// Measures the UVs of a mesh on one square page.
///
/// # Errors
/// [`EmptyInput`](crate::Error::EmptyInput) where there are no faces or no UVs;
/// [`InvalidArgument`](crate::Error::InvalidArgument) where there are not three UVs per face;
/// [`IndexOutOfRange`](crate::Error::IndexOutOfRange); cancel and time limit.
///
/// ```
/// use atlasfit::{Run, geometry::TriMesh, measure};
/// let mut mesh = TriMesh::new(vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], vec![[0, 1, 2]]);
/// mesh.corner_uv = Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
/// let quality = Run::default().execute(|ctx| measure::uv(&mesh, ctx))?;
/// assert_eq!((quality.charts, quality.flips, quality.overlapping_faces), (1, 0, 0));
/// assert!((quality.stretch_l2 - 1.0).abs() < 1e-6, "one scale is no stretch");
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn uv(mesh: &TriMesh, ctx: &Context<'_>) -> Result<UvQuality> {
    uv_on(mesh, &Pages::default(), ctx)
}

/// Measures the UVs of a mesh that lie on several pages, or on one that is not square.
///
/// # Errors
/// As [`uv`], also [`InvalidArgument`](crate::Error::InvalidArgument) for a page without size and
/// [`IndexOutOfRange`](crate::Error::IndexOutOfRange) for the page of a face.
///
/// ```
/// use atlasfit::Run;
/// use atlasfit::geometry::TriMesh;
/// use atlasfit::measure::uv::{Pages, uv_on};
/// let mut mesh = TriMesh::new(vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
/// mesh.corner_uv = Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
/// let page = Pages { of_face: None, size: [2048.0, 1024.0] };
/// let quality = Run::default().execute(|ctx| uv_on(&mesh, &page, ctx))?;
/// assert!(quality.stretch_p95 < 1.001 && quality.charts == 1);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn uv_on(mesh: &TriMesh, pages: &Pages<'_>, ctx: &Context<'_>) -> Result<UvQuality> {
    let laid = laid_out(mesh, pages)?;
    memory::reserve(mesh, ctx)?;
    let uvs = laid.uvs;
    let m = uvs.len();
    ctx.stage(Stage::Measure, 4);
    let finite: Vec<bool> = uvs.iter().map(is_finite).collect();

    let charts = charts::charts_of(mesh, &uvs, ctx)?;
    ctx.advance(1);
    ctx.check()?;

    let areas = Areas::new(mesh, &uvs, ctx)?;
    let mut singular = vec![SingularValues::default(); m];
    singular.par_chunks_mut(BLOCK).enumerate().try_for_each(|(block, values)| {
        ctx.check()?;
        for (i, value) in (block * BLOCK..).zip(values) {
            *value = singular_values(mesh, i, &uvs[i], areas.to_space);
        }
        Ok(())
    })?;
    let stretch = stretch(&singular, &areas, ctx)?;
    ctx.advance(1);
    ctx.check()?;

    let mut majority = vec![0.0; charts.count];
    for (chart, area) in charts.of_face.iter().zip(&areas.texture) {
        majority[*chart as usize] += area;
    }
    let turned = |i: usize| {
        let sign: f64 = majority[charts.of_face[i] as usize];
        areas.some(i) && sign != 0.0 && areas.texture[i] * sign.signum() < 0.0
    };
    let flips = (0..m).filter(|&i| turned(i)).count();

    let covered = texels(&uvs, &finite, ctx)?;
    ctx.advance(1);
    let overlapping_faces = overlapping(&uvs, &finite, ctx)?;
    ctx.advance(1);
    let mut all = corners(mesh)?.as_flattened().as_flattened().iter();
    Ok(UvQuality {
        faces: m,
        charts: charts.count,
        seam: charts.seam_length / areas.total.sqrt(),
        straightness: straightness(&charts, &uvs),
        stretch_l2: stretch.l2,
        stretch_linf: stretch.linf,
        stretch_median: stretch.median,
        stretch_p95: stretch.p95,
        conformal: stretch.conformal,
        flips,
        degenerate: stretch.collapsed,
        overlap: covered.twice as f64 / covered.once.max(1) as f64,
        overlapping_faces,
        coverage: covered.once as f64 / (TEXELS * TEXELS) as f64 / laid.page_share,
        inside: all.all(|&x| (-SAME_UV..=1.0 + SAME_UV).contains(&f64::from(x))),
        finite: finite.iter().all(|f| *f),
    })
}

/// Share of the outlines' length in the texture that is parallel to an axis.
fn straightness(charts: &Charts, uvs: &[FaceUv]) -> f64 {
    let (mut straight, mut all) = (0.0, 0.0);
    for &h in &charts.outline {
        let (t, k) = (&uvs[h as usize / 3], h as usize % 3);
        let [u, v] = [0, 1].map(|i| (t[(k + 1) % 3][i] - t[k][i]).abs());
        let length = u.hypot(v);
        if length.is_finite() {
            all += length;
            straight += if u.min(v) < SAME_UV { length } else { 0.0 };
        }
    }
    if all > 0.0 { straight / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::measure::shapes::sheet;
    use crate::run::Run;
    use proptest::prelude::*;

    fn of(mesh: &TriMesh) -> UvQuality {
        Run::default().execute(|ctx| uv(mesh, ctx)).unwrap()
    }

    /// A sheet with UVs by a function of its positions.
    fn mapped(n: u32, f: impl Fn([f64; 2]) -> [f64; 2]) -> TriMesh {
        let mut mesh = sheet(1.0, n);
        mesh.corner_uv = Some(
            mesh.triangles
                .iter()
                .map(|t| {
                    t.map(|v| {
                        let p = mesh.positions[v as usize];
                        f([p[0], p[1]]).map(|x| x as f32)
                    })
                })
                .collect(),
        );
        mesh
    }

    fn near(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() < tolerance, "{a} is not {b}");
    }

    #[test]
    fn an_isometric_map_is_perfect_at_any_scale() {
        for s in [1.0, 0.5, 0.125] {
            let q = of(&mapped(4, |p| [s * p[0], s * p[1]]));
            assert_eq!((q.charts, q.flips, q.degenerate, q.overlapping_faces), (1, 0, 0, 0));
            for v in [q.stretch_l2, q.stretch_linf, q.stretch_median, q.stretch_p95, q.conformal] {
                near(v, 1.0, 1e-6);
            }
            assert_eq!((q.seam, q.overlap, q.inside, q.finite), (0.0, 0.0, true, true));
            assert_eq!(q.straightness, 1.0);
            // The texels on the diagonals have their centres on a side and count for neither face.
            near(q.coverage, s * s, 5e-3);
        }
    }

    #[test]
    fn a_sheet_pulled_to_twice_its_width_has_the_known_stretch() {
        // Singular values 1 and 1/2, times sqrt 2 for equal areas.
        let q = of(&mapped(4, |p| [p[0], 0.5 * p[1]]));
        let (s1, s2) = (2f64.sqrt(), 0.5f64.sqrt());
        near(q.stretch_l2, (0.5 * (s1.powi(-2) + s2.powi(-2))).sqrt(), 1e-6);
        near(q.stretch_linf, 1.0 / s2, 1e-6);
        near(q.stretch_p95, s1, 1e-6);
        near(q.conformal, 2.0, 1e-6);
    }

    #[test]
    fn a_square_that_is_turned_has_no_side_along_the_page() {
        let q = of(&mapped(4, |p| [0.3 + 0.4 * p[0] - 0.3 * p[1], 0.1 + 0.3 * p[0] + 0.4 * p[1]]));
        assert_eq!(q.straightness, 0.0);
        // Sheared along x, two of its sides are: lengths 1 and 1.25.
        near(of(&mapped(4, |p| [0.5 * (p[0] + 0.75 * p[1]), 0.5 * p[1]])).straightness, 1.0 / 2.25, 1e-6);
    }

    #[test]
    fn a_cut_makes_two_charts_and_a_seam_of_its_length() {
        let mut mesh = mapped(4, |p| [0.4 * p[0], 0.4 * p[1]]);
        let left: Vec<bool> =
            mesh.triangles.iter().map(|t| t.iter().all(|&v| mesh.positions[v as usize][0] <= 0.5)).collect();
        for (c, left) in mesh.corner_uv.as_mut().unwrap().iter_mut().zip(left) {
            if left {
                c.iter_mut().for_each(|p| p[1] += 0.5);
            }
        }
        let q = of(&mesh);
        assert_eq!((q.charts, q.overlapping_faces), (2, 0));
        near(q.seam, 1.0, 1e-12);
        // The same surface with a vertex per corner, as in glTF files, has the same seam.
        let split = TriMesh {
            positions: mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect(),
            triangles: (0..mesh.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..mesh.clone()
        };
        assert_eq!(of(&split), q);
    }

    #[test]
    fn folds_flip_and_overlap() {
        // Folded at x = 3/4: a quarter of the sheet lies turned on its neighbour.
        let q = of(&mapped(4, |p| [if p[0] > 0.75 { 1.5 - p[0] } else { p[0] }, p[1]]));
        assert_eq!((q.flips, q.charts), (8, 1));
        assert_eq!(q.overlapping_faces, 16);
        near(q.overlap, 1.0 / 3.0, 0.01);
        // A mirrored chart as a whole is not flipped.
        assert_eq!(of(&mapped(4, |p| [1.0 - p[0], p[1]])).flips, 0);
    }

    #[test]
    fn the_smallest_overlap_is_found_and_touching_is_none() {
        let pair = |dx: f32| {
            let mut mesh = TriMesh::new(
                vec![
                    [0.0; 3],
                    [1.0, 0.0, 0.0],
                    [0.0, 1.0, 0.0],
                    [5.0, 0.0, 0.0],
                    [6.0, 0.0, 0.0],
                    [5.0, 1.0, 0.0],
                ],
                vec![[0, 1, 2], [3, 4, 5]],
            );
            let a = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]];
            let b = [[0.5 + dx, 0.0], [1.0, 0.0], [0.5 + dx, 0.5]];
            mesh.corner_uv = Some(vec![a, b]);
            of(&mesh).overlapping_faces
        };
        assert_eq!((pair(0.0), pair(1e-7), pair(-1e-7)), (0, 0, 2));
    }

    #[test]
    fn collapsed_outside_and_undefined_uvs_are_told_apart() {
        let q = of(&mapped(2, |p| [p[0], 0.0]));
        assert_eq!((q.degenerate, q.coverage), (8, 0.0));
        assert!(q.stretch_l2.is_infinite());
        let q = of(&mapped(2, |p| [p[0] + 0.5, p[1]]));
        assert!(!q.inside && q.finite);
        let mut mesh = mapped(2, |p| p);
        mesh.corner_uv.as_mut().unwrap()[0][0][0] = f32::NAN;
        let q = of(&mesh);
        assert!(!q.finite && !q.inside);
        assert_eq!(q.degenerate, 1);
        near(q.stretch_median, 1.0, 0.1);
    }

    #[test]
    fn a_position_that_is_not_finite_says_nothing_about_other_faces() {
        let stretched = mapped(8, |p| [p[0], 0.5 * p[1]]);
        let mut damaged = stretched.clone();
        damaged.positions[0] = [f64::NAN; 3];
        damaged.positions[1] = [f64::INFINITY, 0.0, 0.0];
        let (whole, damaged) = (of(&stretched), of(&damaged));
        near(damaged.stretch_p95, whole.stretch_p95, 1e-6);
        near(damaged.conformal, whole.conformal, 1e-6);
        assert!(damaged.seam.is_finite());
    }

    #[test]
    fn meshes_without_uvs_are_errors() {
        let run = |m: &TriMesh| Run::default().execute(|ctx| uv(m, ctx));
        assert!(matches!(run(&sheet(1.0, 2)), Err(Error::EmptyInput { .. })));
        assert!(matches!(run(&TriMesh::default()), Err(Error::EmptyInput { .. })));
        let short = TriMesh { corner_uv: Some(vec![[[0.0; 2]; 3]]), ..sheet(1.0, 2) };
        assert!(matches!(run(&short), Err(Error::InvalidArgument { .. })));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn stretch_ignores_rotation_and_scale_on_both_sides(
            angle in 0.0f64..6.3,
            s in 0.1f64..0.6,
            big in 1e-3f64..1e3,
        ) {
            let shear = |p: [f64; 2]| [p[0] + 0.3 * p[1], 0.7 * p[1]];
            let turn = |p: [f64; 2]| {
                let (c, d) = (angle.cos(), angle.sin());
                [0.5 + s * (c * p[0] - d * p[1]), 0.5 + s * (d * p[0] + c * p[1])]
            };
            let one = of(&mapped(3, shear));
            let mut turned = mapped(3, |p| turn(shear(p)));
            for p in &mut turned.positions {
                *p = p.map(|x| big * x);
            }
            let two = of(&turned);
            let values = |q: &UvQuality| [q.stretch_l2, q.stretch_p95, q.conformal];
            for (a, b) in values(&one).into_iter().zip(values(&two)) {
                prop_assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
            }
            let counts = |q: &UvQuality| (q.charts, q.flips, q.overlapping_faces);
            prop_assert_eq!(counts(&one), counts(&two));
        }
    }
}
