//! Claims about packing, whatever is asked for: it ends, nothing collapses, and the padding reported is kept.

use super::placement::Placement;
use super::*;
use crate::numeric::plane::{corners, twice_area};
use crate::run::Run;
use proptest::prelude::*;

/// Texels per 1024 of the page by which a gap may be too small: what `tighten` leaves, and rounding to f32.
const TOLERANCE: f64 = 0.012;

/// A chart of a polygon that is convex seen from its first corner.
fn chart(points: Vec<[f64; 2]>) -> Chart {
    let n = points.len() as u32;
    let tris: Vec<[u32; 3]> = (1..n - 1).map(|i| [0, i, i + 1]).collect();
    let last = n - 3;
    let border = std::iter::once((0, 0)).chain((0..=last).map(|i| (i, 1))).chain([(last, 2)]).collect();
    let area = tris.iter().map(|t| {
        let [a, b, c] = corners(*t, &points);
        0.5 * twice_area(a, b, c)
    });
    Chart { faces: (0..=last).collect(), area: area.sum(), tris, uv: points, border, ..Chart::default() }
}

/// A triangle, a rectangle or an L of a size.
fn any_chart() -> impl Strategy<Value = Chart> {
    (0..3u8, 0.05..1.0f64, 0.05..1.0f64, 0.0..6.3f64).prop_map(|(kind, w, h, turn)| {
        let points: &[[f64; 2]] = match kind {
            0 => &[[0.0, 0.0], [1.0, 0.0], [0.3, 1.0]],
            1 => &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            _ => &[[0.3, 0.3], [0.3, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.3]],
        };
        let (s, c) = turn.sin_cos();
        chart(points.iter().map(|p| [c * w * p[0] - s * h * p[1], s * w * p[0] + c * h * p[1]]).collect())
    })
}

/// Charts of area 1 together, as many as are asked for.
fn any_charts(most: usize) -> impl Strategy<Value = Vec<Chart>> {
    prop::collection::vec(any_chart(), 1..most).prop_map(|mut charts| {
        let scale = charts.iter().map(|c| c.area).sum::<f64>().sqrt().recip();
        for c in &mut charts {
            c.area *= scale * scale;
            c.uv.iter_mut().for_each(|p| *p = p.map(|x| x * scale));
        }
        charts
    })
}

/// Distance of two segments that do not cross.
fn distance(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> f64 {
    let to = |p: [f64; 2], [a, b]: [[f64; 2]; 2]| {
        let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let t = ((e[0] * d[0] + e[1] * d[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
        (e[0] - t * d[0]).hypot(e[1] - t * d[1])
    };
    [to(a[0], b), to(a[1], b), to(b[0], a), to(b[1], a)].into_iter().fold(f64::INFINITY, f64::min)
}

/// What every packing satisfies.
fn check(charts: &[Chart], job: &PackJob<'_>, packed: &Packed) {
    assert!(packed.padding <= job.padding && packed.density > 0.0);
    let texels = |c: &Chart, p: &Placement| -> Vec<[f64; 2]> {
        let at = p.positions(&c.uv);
        assert!(at.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
        at.iter().map(|q| [0, 1].map(|k| f64::from(q[k]) * f64::from(job.page[k]))).collect()
    };
    let placed: Vec<Vec<[f64; 2]>> =
        charts.iter().zip(&packed.placements).map(|(c, p)| texels(c, p)).collect();
    let longer = f64::from(job.page[0].max(job.page[1]));
    let least = f64::from(packed.padding) - TOLERANCE * (longer / 1024.0).max(1.0);
    for (i, (c, at)) in charts.iter().zip(&placed).enumerate() {
        for t in &c.tris {
            let [p, q, r] = corners(*t, at);
            let area = 0.5 * twice_area(p, q, r);
            let [p, q, r] = corners(*t, &c.uv);
            let wanted = 0.5 * twice_area(p, q, r) * packed.density.powi(2);
            assert!((area / wanted - 1.0).abs() < 0.02, "chart {i}: {area} texels instead of {wanted}");
        }
        for p in at {
            let inside = |k: usize| p[k] >= least && p[k] <= f64::from(job.page[k]) - least;
            assert!(inside(0) && inside(1), "chart {i} at {p:?}");
        }
        assert!(packed.placements[i].page < job.pages);
        let edges = |at: &[[f64; 2]]| -> Vec<[[f64; 2]; 2]> {
            (0..at.len()).map(|k| [at[k], at[(k + 1) % at.len()]]).collect()
        };
        for (j, other) in placed[..i].iter().enumerate() {
            if packed.placements[i].page != packed.placements[j].page {
                continue;
            }
            let pairs = edges(at).into_iter().flat_map(|a| edges(other).into_iter().map(move |b| (a, b)));
            let gap = pairs.map(|(a, b)| distance(a, b)).fold(f64::INFINITY, f64::min);
            assert!(gap > 0.0 && gap >= least, "charts {i} and {j} are {gap} apart, not {least}");
            let holds = |c: &Chart, at: &[[f64; 2]], p: [f64; 2]| {
                (c.tris.iter().map(|t| corners(*t, at)))
                    .any(|[a, b, c]| [(a, b), (b, c), (c, a)].iter().all(|s| twice_area(s.0, s.1, p) > 0.0))
            };
            assert!(!holds(c, at, other[0]) && !holds(&charts[j], other, at[0]), "{i} and {j} overlap");
        }
    }
}

/// Packs and checks.
fn packed(charts: &[Chart], job: &PackJob<'_>) -> Packed {
    let packed = Run::default().execute(|ctx| pack(charts, job, ctx)).expect("nothing cancels");
    check(charts, job, &packed);
    packed
}

const JOB: PackJob<'static> = PackJob {
    page: [1024; 2],
    padding: 0,
    density: None,
    pages: 1,
    occupied: &[],
    packer: Packing::Own(Packer::Shapes),
    seed: 0,
};

/// As many triangles, of different sizes.
fn triangles(n: usize) -> Vec<Chart> {
    let side = (n as f64).sqrt().recip();
    (0..n)
        .map(|i| side * (1.2 + (i as f64).sin()))
        .map(|s| chart(vec![[0.0; 2], [s, 0.0], [0.0, side]]))
        .collect()
}

#[test]
fn a_padding_that_cannot_be_kept_is_lowered_and_one_that_can_is_kept() {
    let (boxes, shapes) = (Packing::Own(Packer::Boxes), Packing::Own(Packer::Shapes));
    for (packer, density) in
        [(boxes, None), (boxes, Some(1.0)), (boxes, Some(1e4)), (shapes, None), (shapes, Some(1.0))]
    {
        let job = PackJob { packer, density, ..JOB };
        // Forty-nine points is about all that a page holds with this padding.
        let lowered = packed(&triangles(200), &PackJob { padding: 128, ..job });
        assert!((16..128).contains(&lowered.padding), "{}", lowered.padding);
        let few = packed(&triangles(8), &PackJob { padding: 100, ..job });
        assert_eq!(few.padding, 100);
    }
    // On many pages there is room for any padding.
    let many = packed(&triangles(200), &PackJob { padding: 128, pages: 100, packer: boxes, ..JOB });
    assert_eq!(many.padding, 128);
}

#[test]
fn more_charts_than_texels_are_packed_all_the_same() {
    for packer in [Packer::Boxes, Packer::Shapes].map(Packing::Own) {
        for padding in [0, 2] {
            let job = PackJob { page: [16, 24], padding, packer, ..JOB };
            assert_eq!(packed(&triangles(400), &job).padding, 0);
            assert_eq!(packed(&triangles(400), &PackJob { density: Some(50.0), pages: 2, ..job }).padding, 0);
        }
    }
}

#[test]
fn charts_keep_free_of_what_is_occupied_and_say_so_where_there_is_no_room() {
    // All but the right quarter, and a needle through that.
    let band = [[[0.0, 0.0], [0.75, 0.0], [0.75, 1.0]], [[0.0, 0.0], [0.75, 1.0], [0.0, 1.0]]];
    let needle = [[0.7, 0.5], [1.0, 0.5], [1.0, 0.501]];
    let beyond = |t: [[f32; 2]; 3], by: [f32; 2]| t.map(|[u, v]| [u + by[0], v + by[1]]);
    let off = [[1.0, 0.0], [-1.0, 0.0], [0.3, 7.0], [0.3, -2.0]].map(|by| beyond(needle, by));
    let occupied = [&[band[0], band[1], needle], &off[..]].concat();
    for density in [None, Some(100.0), Some(1e4)] {
        let charts = triangles(30);
        let job = PackJob { occupied: &occupied, padding: 4, density, ..JOB };
        let packed = packed(&charts, &job);
        assert_eq!(packed.padding, 4);
        let least = f64::from(0.75f32) + 4.0 / 1024.0;
        for (c, p) in charts.iter().zip(&packed.placements) {
            let at = p.positions(&c.uv);
            assert!(at.iter().all(|q| f64::from(q[0]) > least), "{at:?}");
            let below = at.iter().all(|q| f64::from(q[1]) <= 0.5 - 4.0 / 1024.0);
            assert!(below || at.iter().all(|q| f64::from(q[1]) >= 0.501 + 4.0 / 1024.0), "{at:?}");
        }
        assert!(packed.density > 100.0 - 1e-9, "{}", packed.density);
    }
    let all = band.map(|t| t.map(|[u, v]| [u / 0.75, v]));
    let run = |ctx: &Context<'_>| pack(&triangles(30), &PackJob { occupied: &all, ..JOB }, ctx);
    assert!(matches!(Run::default().execute(run), Err(Error::InvalidArgument { .. })));
    // A further page is free.
    let job = PackJob { occupied: &all, pages: 2, ..JOB };
    assert!(packed(&triangles(30), &job).placements.iter().all(|p| p.page == 1));
}

/// Never fits anything.
struct Never;

impl PagePacker for Never {
    fn fill(&self, _: &[FlatChart<'_>], _: Pages, _: &Context<'_>) -> Result<Option<Vec<ChartPosition>>> {
        Ok(None)
    }
}

#[test]
fn a_packer_that_finds_no_room_is_an_error() {
    for density in [None, Some(10.0)] {
        let job = PackJob { packer: Packing::External(&Never), padding: 8, density, ..JOB };
        let run = |ctx: &Context<'_>| pack(&triangles(20), &job, ctx);
        assert!(matches!(Run::default().execute(run), Err(Error::InvalidArgument { .. })));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn whatever_is_asked_for_the_padding_reported_is_kept_and_nothing_collapses(
        charts in any_charts(40),
        page in prop::array::uniform2(16..1200u32),
        share in 0.0..1.0f64,
        density in prop::option::of(-1.0..4.0f64),
        pages in 1..4u32,
        boxes in any::<bool>(),
    ) {
        let packer = Packing::Own(if boxes { Packer::Boxes } else { Packer::Shapes });
        let padding = (share * f64::from(page[0].min(page[1]) / 8)).round() as u32;
        let density = density.map(|d| 10f64.powf(d));
        packed(&charts, &PackJob { page, padding, density, pages, packer, occupied: &[], seed: 1 });
    }
}
