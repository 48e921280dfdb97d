//! xatlas (Jonathan Young, MIT) as a packer: only its packing is used.
//!
//! In: flat charts in texels. Out: a page and a place on it for each.
//!
//! Where xatlas does not do what is asked of it, and how that is handled:
//! - It stretches every chart to whole texels. A chart of its true size, put in the middle of the stretched
//!   one, comes up to half a texel nearer to its neighbours: a larger padding makes up for that.
//! - Its quarter turns mirror the chart: they are off.
//! - It leaves out faces without area. A chart that would fall apart without them is packed as its bounding
//!   box.
//! - The crate's safe functions count vertices wrongly for flat charts, and read a chart type that is not set
//!   for them: the bindings are used instead.
#![allow(unsafe_code)]

use atlasfit::unwrap::{ChartPosition, FlatChart, PagePacker, Pages};
use atlasfit::{Context, Error};
use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;
use xatlas_rs_v2::root::xatlas as ffi;

/// xatlas takes faces of no more area than this for faces without area, in square texels.
const NO_AREA: f32 = f32::EPSILON;

/// xatlas as a packer.
pub struct Xatlas;

impl PagePacker for Xatlas {
    fn fill(
        &self,
        charts: &[FlatChart<'_>],
        pages: Pages,
        ctx: &Context<'_>,
    ) -> Result<Option<Vec<ChartPosition>>, Error> {
        let [width, height] = pages.size;
        if width != height {
            return Err(Error::InvalidArgument {
                what: format!("the page is {width} by {height}, and xatlas makes square pages only"),
                advice: "Give one size, or use another packer".into(),
            });
        }
        let mut input = Input::default();
        charts.iter().for_each(|c| input.push(c));
        // The border stays free. Between charts xatlas leaves twice its padding; stretching takes up to a
        // texel of that.
        let inner = width - 2 * pages.padding;
        let padding = (pages.padding + 1).div_ceil(2);
        let longest = input.uv.iter().flatten().fold(0f32, |a, &x| a.max(x));
        if longest.ceil() > (inner - 1) as f32 {
            return Ok(None);
        }
        let Some(Packed { pages: used, vertices }) = pack(&input, inner, padding, ctx)? else {
            return Ok(None);
        };
        if used > pages.most {
            return Ok(None);
        }
        let positions = charts.iter().enumerate().map(|(c, chart)| {
            let own = &vertices[input.first[c] as usize..input.first[c + 1] as usize];
            let torn = || Error::Internal { what: format!("xatlas tore chart {c}") };
            let (atlas, id) = own.first().map(|v| (v.atlasIndex, v.chartIndex)).ok_or_else(torn)?;
            if atlas < 0 || own.iter().any(|v| (v.atlasIndex, v.chartIndex) != (atlas, id)) {
                return Err(torn());
            }
            let at = [0, 1].map(|k| {
                let ends = |x: &mut dyn Iterator<Item = f64>| {
                    x.fold((f64::INFINITY, f64::NEG_INFINITY), |e, x| (e.0.min(x), e.1.max(x)))
                };
                let (lo, hi) = ends(&mut own.iter().map(|v| f64::from(v.uv[k])));
                let size = ends(&mut chart.uv.iter().map(|p| p[k])).1;
                f64::from(pages.padding) + (lo + hi - size) / 2.0
            });
            Ok(ChartPosition { page: atlas as u32, at })
        });
        positions.collect::<Result<_, _>>().map(Some)
    }
}

/// All charts as one mesh.
struct Input {
    uv: Vec<[f32; 2]>,
    indices: Vec<u32>,
    /// The chart of each face: faces of two charts stay apart wherever they lie.
    chart: Vec<u32>,
    /// The first vertex of each chart, and their number.
    first: Vec<u32>,
}

impl Default for Input {
    fn default() -> Self {
        Self { uv: Vec::new(), indices: Vec::new(), chart: Vec::new(), first: vec![0] }
    }
}

impl Input {
    fn push(&mut self, chart: &FlatChart<'_>) {
        let base = self.uv.len() as u32;
        let id = self.first.len() as u32 - 1;
        let uv: Vec<[f32; 2]> = chart.uv.iter().map(|p| p.map(|x| x as f32)).collect();
        if in_one_piece(&uv, chart.triangles) {
            self.indices.extend(chart.triangles.iter().flatten().map(|v| base + v));
            self.uv.extend(uv);
        } else {
            let [w, h] = [0, 1].map(|k| uv.iter().fold(0f32, |a, p| a.max(p[k])).ceil().max(1.0));
            self.uv.extend([[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]]);
            self.indices.extend([0, 1, 2, 0, 2, 3].map(|v| base + v));
        }
        self.chart.resize(self.indices.len() / 3, id);
        self.first.push(self.uv.len() as u32);
    }
}

/// Whether the faces that xatlas sees hold all vertices and hang together.
fn in_one_piece(uv: &[[f32; 2]], triangles: &[[u32; 3]]) -> bool {
    let mut root: Vec<u32> = (0..uv.len() as u32).collect();
    let mut pieces = uv.len();
    fn find(root: &mut [u32], mut v: u32) -> u32 {
        while root[v as usize] != v {
            root[v as usize] = root[root[v as usize] as usize];
            v = root[v as usize];
        }
        v
    }
    for t in triangles {
        let [a, b, c] = t.map(|v| uv[v as usize]);
        let area = (((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) * 0.5).abs();
        if area <= NO_AREA || !area.is_finite() {
            continue;
        }
        for k in 1..3 {
            let (p, q) = (find(&mut root, t[0]), find(&mut root, t[k]));
            if p != q {
                root[q as usize] = p;
                pieces -= 1;
            }
        }
    }
    pieces == 1
}

/// An atlas of xatlas, freed when dropped.
struct Atlas(*mut ffi::Atlas);

impl Drop for Atlas {
    fn drop(&mut self) {
        // SAFETY: made by `Create` and destroyed here only.
        unsafe { ffi::Destroy(self.0) }
    }
}

/// Called by xatlas between charts; says whether to go on.
unsafe extern "C" fn go_on(_: ffi::ProgressCategory, _: c_int, ctx: *mut c_void) -> bool {
    // SAFETY: `pack` hands over a context that outlives the atlas.
    let ctx = unsafe { &*ctx.cast::<Context<'_>>() };
    catch_unwind(AssertUnwindSafe(|| ctx.check().is_ok())).unwrap_or(false)
}

/// What xatlas gives back.
struct Packed {
    /// Number of pages.
    pages: u32,
    /// Every vertex in its place.
    vertices: Vec<ffi::Vertex>,
}

/// Packs on pages of `side` texels; `None` if nothing came back.
fn pack(input: &Input, side: u32, padding: u32, ctx: &Context<'_>) -> Result<Option<Packed>, Error> {
    let decl = ffi::UvMeshDecl {
        vertexUvData: input.uv.as_ptr().cast(),
        indexData: input.indices.as_ptr().cast(),
        faceMaterialData: input.chart.as_ptr(),
        vertexCount: input.uv.len() as u32,
        vertexStride: size_of::<[f32; 2]>() as u32,
        indexCount: input.indices.len() as u32,
        indexOffset: 0,
        indexFormat: ffi::IndexFormat_UInt32,
    };
    let chart_options = ffi::ChartOptions {
        paramFunc: None,
        maxChartArea: 0.0,
        maxBoundaryLength: 0.0,
        normalDeviationWeight: 2.0,
        roundnessWeight: 0.01,
        straightnessWeight: 6.0,
        normalSeamWeight: 4.0,
        textureSeamWeight: 0.5,
        maxCost: 2.0,
        maxIterations: 1,
        useInputMeshUvs: false,
        fixWinding: false,
    };
    let pack_options = ffi::PackOptions {
        maxChartSize: 0,
        padding,
        texelsPerUnit: 1.0,
        resolution: side,
        bilinear: false,
        blockAlign: false,
        bruteForce: true,
        createImage: false,
        rotateChartsToAxis: false,
        rotateCharts: false,
    };
    static QUIET: Once = Once::new();
    // SAFETY: the calls come in the order that xatlas.h asks for; `decl` points into `input`, which outlives
    // them; the output is read while the atlas lives, and copied.
    unsafe {
        // It would print warnings to the standard output.
        QUIET.call_once(|| ffi::SetPrint(None, false));
        let atlas = Atlas(ffi::Create());
        let user = std::ptr::from_ref(ctx).cast_mut().cast();
        ffi::SetProgressCallback(atlas.0, Some(go_on), user);
        let added = ffi::AddUvMesh(atlas.0, &decl);
        if added != ffi::AddMeshError_Success {
            return Err(Error::Internal { what: format!("xatlas refused the charts ({added})") });
        }
        ffi::ComputeCharts(atlas.0, chart_options);
        ctx.check()?;
        ffi::PackCharts(atlas.0, pack_options);
        ctx.check()?;
        let out = &*atlas.0;
        if out.meshCount != 1 || out.meshes.is_null() {
            return Ok(None);
        }
        let mesh = &*out.meshes;
        let vertices = std::slice::from_raw_parts(mesh.vertexArray, mesh.vertexCount as usize);
        Ok(Some(Packed { pages: out.atlasCount, vertices: vertices.to_vec() }))
    }
}
