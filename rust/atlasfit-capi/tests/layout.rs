//! Structs lie in memory as C and C++ see them: sizes and offsets of Rust's are asserted by the C and the C++
//! compiler.

use atlasfit_capi::atlas::*;
use atlasfit_capi::bake::*;
use atlasfit_capi::buffer::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::faces::*;
use atlasfit_capi::files::*;
use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::save::*;
use atlasfit_capi::simplify::*;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use std::fmt::Write as _;
use std::mem::offset_of;
use std::process::Command;

/// A struct as Rust lays it out: its size, and the name and offset of each field.
struct Struct {
    name: &'static str,
    size: usize,
    fields: Vec<(&'static str, usize)>,
}

macro_rules! layouts {
    ($($name:ident { $($field:ident)* })*) => {
        vec![$(Struct {
            name: stringify!($name),
            size: size_of::<$name>(),
            fields: vec![$((stringify!($field), offset_of!($name, $field))),*],
        }),*]
    };
}

/// The structs of the header, whole: a field that is missing here is found below.
fn structs() -> Vec<Struct> {
    layouts! {
        atlasfit_run {
            struct_size seed threads reserved time_limit_s memory_limit_bytes progress progress_user cancel
            overall log log_user
        }
        atlasfit_attribute { struct_size name values stride width scalar }
        atlasfit_points {
            struct_size positions count stride scalar color_width normals normal_stride colors color_stride
            color_scalar attribute_count attributes triangles triangle_count component_stride faces
        }
        atlasfit_mesh {
            struct_size positions vertex_count stride scalar reserved triangles triangle_count corner_uv
            face_group face_polygon seam_edges seam_edge_count face_page page_width page_height colors
            color_stride color_scalar color_width component_stride faces face_ignored
            seam_price occupied_uv occupied_count
        }
        atlasfit_buffer { struct_size data capacity stride component_stride scalar reserved }
        atlasfit_faces { corners offsets count corner_stride face_stride scalar reserved }
        atlasfit_denoise_options {
            struct_size noise detail fill_holes charts prior outliers uv texture_size network_charts
            network_iterations recipe network_stretch_weight network_learning_rate viewpoint
            has_viewpoint watertight min_part largest faces max_error strength
            surface uncertainty sweeps
        }
        atlasfit_report {
            struct_size points_given not_finite duplicates outliers points vertices triangles charts
            uv_charts parts boundary_loops boundary_edges filled_holes attributes one_sided has_uv
            has_colors reserved spacing noise voxel stage_seconds dropped_parts dropped_points
            followed_outliers uncertainty_factor sweeps apart_before apart_after
        }
        atlasfit_sweep { struct_size sweep reserved points pairs moved matrix }
        atlasfit_atlas_info { struct_size charts origin unit }
        atlasfit_projection { struct_size capacity positions normals charts chart_uv distances }
        atlasfit_unwrap_options {
            struct_size max_stretch max_charts page_width page_height padding pages packer keep_uv_seams
            reserved texels_per_unit hard_edge_angle keep_uvs stack max_energy straighten
            reserved_too seams_hidden up
        }
        atlasfit_uv_info {
            struct_size triangles charts pages split_vertices degenerate_faces duplicate_faces
            non_manifold_edges repaired_charts split_polygons width height texels_per_unit stretch_bound
            over_stretched coverage seconds padding reserved faces corners torn_faces
            welded_vertices stacked_parts straightened_charts
        }
        atlasfit_image { struct_size rgba width height }
        atlasfit_textures { struct_size images image_count corner_uv face_image normals reserved }
        atlasfit_bake_options { struct_size width height padding page textures }
        atlasfit_simplify_options { struct_size faces max_error }
        atlasfit_simplified_info { struct_size vertices triangles has_uv has_colors }
        atlasfit_topology {
            struct_size vertices edges faces degenerate_faces unused_vertices parts boundary_edges
            boundary_loops non_manifold_edges non_manifold_vertices inconsistent_edges euler genus
            orientable closed
        }
        atlasfit_uv_quality {
            struct_size faces charts flips degenerate overlapping_faces seam stretch_l2 stretch_linf
            stretch_median stretch_p95 conformal overlap coverage inside finite straightness
        }
        atlasfit_file_info {
            struct_size points triangles attributes texture_bytes has_normals has_colors has_uv
            has_face_charts has_viewpoint has_corner_normals viewpoint
        }
        atlasfit_save_options {
            struct_size corner_uv face_charts texture texture_bytes ascii reserved corner_normals
        }
        atlasfit_distance_options { struct_size samples chamfer_samples threshold }
        atlasfit_distance_stats { rms mean median p95 p99 max }
        atlasfit_distance {
            struct_size accuracy completeness chamfer chamfer_floor f_score threshold normal_consistency
            normal_orientation not_finite
        }
    }
}

#[test]
fn sizes_and_offsets_agree_between_rust_c_and_cpp() {
    let all = structs();
    let here = env!("CARGO_MANIFEST_DIR");
    let header = std::fs::read_to_string(format!("{here}/../../include/atlasfit.h"))
        .expect("the header lies in include/");
    let mut source = String::from(
        "#include \"atlasfit.h\"\n#include \"atlasfit.h\"\n\
         #ifdef __cplusplus\n#define _Static_assert static_assert\n#endif\n",
    );
    for Struct { name, size, fields } in &all {
        let _ = writeln!(source, "_Static_assert(sizeof({name}) == {size}, \"size\");");
        for (field, offset) in fields {
            let _ = writeln!(source, "_Static_assert(offsetof({name}, {field}) == {offset}, \"{field}\");");
        }
        // The list above is whole: as many fields as the header's struct declares.
        let body =
            header.split(&format!("\n}} {name};")).next().and_then(|h| h.rsplit("typedef struct").next());
        let declared = body.map_or(0, |b| b.lines().filter(|l| l.trim_end().ends_with(';')).count());
        assert_eq!(declared, fields.len(), "{name}");
    }
    assert_eq!(header.matches("\n} atlasfit_").count(), all.len(), "a struct of the header is missing here");
    let dir = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let strict = ["-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only"];
    for (file, standard) in [("layout.c", "-std=c11"), ("layout.cpp", "-std=c++17")] {
        let path = dir.join(file);
        std::fs::write(&path, &source).expect("the source is written");
        let compiler = Command::new("cc")
            .arg(standard)
            .args(strict)
            .arg(format!("-I{here}/../../include"))
            .arg(&path)
            .output();
        let compiler = compiler.expect("a C compiler (cc), which Rust needs too");
        let text = String::from_utf8_lossy(&compiler.stderr);
        if text.contains("cc1plus") {
            assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "no C++ compiler for a part of CI");
            eprintln!("no C++ compiler: {file} is left out");
            continue;
        }
        assert!(compiler.status.success(), "{text}");
    }
}
