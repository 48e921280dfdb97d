//! A glTF file keeps all that UVs do not touch.

mod common;

use common::gltf::{Gltf, at, floats};
use common::{Folder, err, png_of, run};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The corners of the unit cube; the triangles of its sides, two and two.
const CUBE: [[u8; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

fn corner(i: u8) -> [f32; 3] {
    [i & 1, i >> 1 & 1, i >> 2].map(f32::from)
}

/// What the JSON of the robot says besides its data. Mesh 1 has two nodes.
fn frame() -> Value {
    let all = json!({
        "asset": { "version": "2.0", "generator": "a test", "copyright": "nobody" },
        "extensionsUsed": ["KHR_texture_transform", "KHR_lights_punctual", "EXT_unknown"],
        "extensions": {
            "KHR_lights_punctual": { "lights": [{ "type": "point", "name": "lamp" }] },
            "EXT_unknown": { "says": [1, 2.5, 0.1, "three"] }
        },
        "scene": 0,
        "scenes": [{ "name": "stage", "nodes": [0, 1, 2, 3, 5] }],
        "nodes": [
            { "name": "body", "mesh": 0, "skin": 0, "extras": { "kind": "robot" } },
            { "name": "left", "mesh": 1, "translation": [5.3, 0.1, 0] },
            { "name": "right", "mesh": 1, "translation": [-5, 0, 0], "scale": [-2, 2, 2] },
            { "name": "hip", "children": [4], "translation": [0, 0.3, 0] },
            { "name": "knee", "camera": 0 },
            { "name": "sun", "extensions": { "KHR_lights_punctual": { "light": 0 } } }
        ],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.01 } }],
        "materials": [
            { "name": "paint", "extras": { "coats": 2 }, "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.9, 1, 1],
                "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 2 } },
              "occlusionTexture": { "index": 2, "strength": 0.4 } },
            { "name": "cloth", "doubleSided": true, "pbrMetallicRoughness": { "baseColorTexture": {
                "index": 1, "texCoord": 1,
                "extensions": { "KHR_texture_transform": { "scale": [2, 2], "rotation": 0.3 } } } },
              "normalTexture": { "index": 3, "scale": 0.7 } }
        ],
        "samplers": [{ "magFilter": 9729, "name": "smooth" }],
        "textures": [{ "source": 0, "sampler": 0 }, { "source": 1 }, { "source": 2 }, { "source": 3 }],
        "images": [], "accessors": [], "bufferViews": []
    });
    all
}

/// The mesh "body": two primitives of two materials that share all vertices, which have everything.
fn body(file: &mut Gltf) -> Value {
    let (n, f32) = (8, 5126);
    let both: Vec<f32> = (0..8).flat_map(|i| corner(i).into_iter().chain([0.0, 0.6, 0.8])).collect();
    let view = file.view(&floats(&both), json!({ "byteStride": 24, "target": 34962, "name": "mixed" }));
    let about = |kind: &str| json!({ "componentType": f32, "count": n, "type": kind });
    let mut position = about("VEC3");
    position["min"] = json!([0, 0, 0]);
    position["max"] = json!([1, 1, 1]);
    position["name"] = "where".into();
    let position = file.accessor(view, position);
    let mut normal = about("VEC3");
    normal["byteOffset"] = 12.into();
    let normal = file.accessor(view, normal);
    let numbers = |w: u8| (0..8 * w).map(|i| f32::from(i) / 64.0).collect::<Vec<f32>>();
    let uv = file.rows(&floats(&numbers(2)), about("VEC2"));
    let second = file.rows(&floats(&numbers(2)), about("VEC2"));
    let tangent = file.rows(&floats(&[1.0, 0.0, 0.0, 1.0].repeat(8)), about("VEC4"));
    let weights: Vec<f32> = (0..8).map(|i| i as f32 / 8.0).flat_map(|w| [w, 1.0 - w, 0.0, 0.0]).collect();
    let weights = file.rows(&floats(&weights), about("VEC4"));
    let own = file.rows(&floats(&numbers(1)), about("SCALAR"));
    let bytes: Vec<u8> = [0, 1, 0, 0].repeat(8);
    let joints = file.rows(&bytes, json!({ "componentType": 5121, "count": n, "type": "VEC4" }));
    let colors: Vec<u8> = (0..32).map(|i| 200 + i).collect();
    let view = file.view(&colors, json!({ "byteStride": 4, "target": 34962 }));
    let color = json!({ "componentType": 5121, "count": n, "type": "VEC3", "normalized": true });
    let color = file.accessor(view, color);
    // A morph target that moves two vertices.
    let at = file.view(&[1, 0, 6, 0], json!({}));
    let by = file.view(&floats(&[0.5, 0.0, 0.0, 0.0, 0.25, 0.0]), json!({}));
    let mut target = about("VEC3");
    target["sparse"] = json!({ "count": 2, "values": { "bufferView": by },
        "indices": { "bufferView": at, "componentType": 5123 } });
    target["min"] = json!([0, 0, 0]);
    target["max"] = json!([0.5, 0.25, 0]);
    let all = file.json["accessors"].as_array_mut().unwrap();
    all.push(target);
    let target = all.len() - 1;
    let attributes = json!({ "POSITION": position, "NORMAL": normal, "TANGENT": tangent,
        "TEXCOORD_0": uv, "TEXCOORD_1": second, "COLOR_0": color, "JOINTS_0": joints,
        "WEIGHTS_0": weights, "_OWN": own });
    let primitive = |file: &mut Gltf, triangles: &[[u8; 3]], material: usize| {
        let about = json!({ "componentType": 5121, "count": 3 * triangles.len(), "type": "SCALAR" });
        let indices = file.rows(triangles.as_flattened(), about);
        json!({ "attributes": attributes, "indices": indices, "material": material,
            "targets": [{ "POSITION": target }] })
    };
    let parts = [primitive(file, &CUBE[..6], 0), primitive(file, &CUBE[6..], 1)];
    json!({ "name": "body", "weights": [0.5], "primitives": parts,
        "extras": { "targetNames": ["smile"] } })
}

/// A robot: a skinned, animated body of two materials, and a box that two nodes show.
fn robot() -> Gltf {
    let mut file = Gltf { json: frame(), buffer: Vec::new() };
    let body = body(&mut file);
    // Without indices, and with the vertices of each triangle its own.
    let places: Vec<f32> = CUBE.as_flattened().iter().flat_map(|&i| corner(i)).collect();
    let about = json!({ "componentType": 5126, "count": 36, "type": "VEC3", "min": [0, 0, 0],
        "max": [1, 1, 1] });
    let place = file.rows(&floats(&places), about);
    let boxes = json!({ "name": "box", "primitives": [{ "attributes": { "POSITION": place } }] });
    file.json["meshes"] = json!([body, boxes]);
    for (name, color) in
        [("red", [200, 20, 20]), ("blue", [20, 20, 200]), ("rough", [9, 99, 9]), ("bumps", [128, 128, 255])]
    {
        file.image(name, &png_of(color));
    }
    let times = file.rows(
        &floats(&[0.0, 0.1]),
        json!({ "componentType": 5126, "count": 2,
        "type": "SCALAR", "min": [0], "max": [0.1] }),
    );
    let moves = file.rows(
        &floats(&[0.0, 0.3, 0.0, 0.0, 1.0, 0.0]),
        json!({ "componentType": 5126, "count": 2, "type": "VEC3" }),
    );
    file.json["animations"] = json!([{ "name": "walk", "samplers": [{ "input": times, "output": moves }],
        "channels": [{ "sampler": 0, "target": { "node": 3, "path": "translation" } }] }]);
    let one: Vec<f32> = (0..16).map(|i| if i % 5 == 0 { 1.0 } else { 0.0 }).collect();
    let bind = file.rows(
        &floats(&one.repeat(2)),
        json!({ "componentType": 5126, "count": 2,
        "type": "MAT4" }),
    );
    file.json["skins"] = json!([{ "name": "bones", "joints": [3, 4], "inverseBindMatrices": bind }]);
    file
}

/// Writes the robot, and unwraps it to a file of this name.
fn unwrapped(folder: &Folder, name: &str, more: &[&str]) -> (Gltf, PathBuf) {
    let (input, output) = (folder.0.join("robot.glb"), folder.0.join(name));
    std::fs::write(&input, robot().glb()).unwrap();
    let mut command = common::command();
    let done = command.arg("unwrap").arg(&input).arg("-o").arg(&output).args(more).output().unwrap();
    assert!(done.status.success(), "{}", err(&done));
    (Gltf::read(&output), output)
}

/// The JSON without what UVs touch: where data lie, their numbers, and what the materials' textures name.
fn untouched(mut json: Value) -> Value {
    for key in ["buffers", "bufferViews", "accessors", "images", "extensionsUsed"] {
        json.as_object_mut().unwrap().remove(key);
    }
    for sampler in json["animations"][0]["samplers"].as_array_mut().unwrap() {
        sampler.take();
    }
    json["skins"][0]["inverseBindMatrices"].take();
    for texture in json["textures"].as_array_mut().unwrap() {
        texture.as_object_mut().unwrap().remove("source");
    }
    for mesh in json["meshes"].as_array_mut().unwrap() {
        for primitive in mesh["primitives"].as_array_mut().unwrap() {
            let primitive = primitive.as_object_mut().unwrap();
            ["attributes", "indices", "targets"].iter().for_each(|k| drop(primitive.remove(*k)));
        }
    }
    for path in ["/0/pbrMetallicRoughness/baseColorTexture", "/1/pbrMetallicRoughness/baseColorTexture"] {
        json["materials"].pointer_mut(path).unwrap().take();
    }
    json
}

/// Every number of the JSON that names data names some that are there, aligned, and bounded as it says.
fn is_sound(file: &Gltf) {
    let len = at(&file.json["buffers"][0]["byteLength"]);
    assert!(len <= file.buffer.len() && file.buffer.len() < len + 4);
    for view in file.json["bufferViews"].as_array().unwrap() {
        assert!(view["buffer"] == 0 && at(&view["byteOffset"]) + at(&view["byteLength"]) <= len);
    }
    for i in 0..file.json["accessors"].as_array().unwrap().len() {
        file.rows_of(&i.into());
    }
    for primitive in file.primitives() {
        let count = |id: &Value| file.json["accessors"][at(id)]["count"].clone();
        let attributes = primitive["attributes"].as_object().unwrap();
        let vertices = count(&attributes["POSITION"]);
        assert!(attributes.values().all(|id| count(id) == vertices));
        let about = &file.json["accessors"][at(&attributes["POSITION"])];
        let rows = file.rows_of(&attributes["POSITION"]);
        for k in 0..3 {
            let all = rows.iter().map(|r| f32::from_le_bytes(r[4 * k..4 * k + 4].try_into().unwrap()));
            let low = all.clone().fold(f32::INFINITY, f32::min);
            let high = all.fold(f32::NEG_INFINITY, f32::max);
            assert_eq!(about["min"][k].as_f64(), Some(low.into()));
            assert_eq!(about["max"][k].as_f64(), Some(high.into()));
        }
    }
}

/// What vertices have at the corners of the triangles is the same byte by byte.
fn same_corners(old: &Gltf, new: &Gltf) {
    for (old_part, new_part) in old.primitives().into_iter().zip(new.primitives()) {
        for (name, id) in old_part["attributes"].as_object().unwrap() {
            if !["TEXCOORD_0", "TANGENT"].contains(&&**name) {
                let now = new.by_corner(new_part, &new_part["attributes"][name]);
                assert!(old.by_corner(old_part, id) == now, "{name} changed");
            }
        }
        for (old_target, new_target) in old_part["targets"]
            .as_array()
            .into_iter()
            .flatten()
            .zip(new_part["targets"].as_array().into_iter().flatten())
        {
            let before = old.by_corner(old_part, &old_target["POSITION"]);
            assert!(before == new.by_corner(new_part, &new_target["POSITION"]), "a morph target changed");
        }
    }
}

/// The new file is sound, and only its UVs are other ones.
fn all_else_is_kept(old: &Gltf, new: &Gltf) {
    assert_eq!(untouched(old.json.clone()).to_string(), untouched(new.json.clone()).to_string());
    is_sound(new);
    same_corners(old, new);
}

#[test]
fn a_glb_keeps_all_that_uvs_do_not_touch() {
    let folder = Folder::new("keep-glb");
    let (new, output) = unwrapped(&folder, "out.glb", &[]);
    let old = Gltf::read(&folder.0.join("robot.glb"));
    all_else_is_kept(&old, &new);
    let animation = &old.json["animations"][0]["samplers"][0];
    for id in [&animation["input"], &animation["output"], &old.json["skins"][0]["inverseBindMatrices"]] {
        assert_eq!(old.json["accessors"][at(id)]["count"], new.json["accessors"][at(id)]["count"]);
        assert!(old.rows_of(id) == new.rows_of(id));
    }
    // The parts of one mesh still share their vertices; those of seams are there twice.
    let [first, second, boxes] = new.primitives()[..] else { panic!("three primitives") };
    assert_eq!(first["attributes"], second["attributes"]);
    assert!(new.rows_of(&first["attributes"]["POSITION"]).len() > 8);
    assert_eq!(new.rows_of(&boxes["attributes"]["TEXCOORD_0"]).len(), 36);
    assert!(boxes.get("indices").is_none());
    let read = run(&[&"info", &output]);
    assert!(read.status.success(), "{}", err(&read));
}

#[test]
fn a_gltf_file_gets_its_buffer_and_images_beside_it() {
    let folder = Folder::new("keep-gltf");
    let (new, output) = unwrapped(&folder, "out.gltf", &[]);
    let old = Gltf::read(&folder.0.join("robot.glb"));
    all_else_is_kept(&old, &new);
    assert_eq!(new.json["buffers"][0]["name"], "all");
    assert_eq!(
        folder.names(),
        ["out.bin", "out.gltf", "out.png", "out_metallicRoughness.png", "out_normal.png", "robot.glb",]
    );
    // From text to GLB, in another folder: images beside the file move into it.
    let inner = folder.0.join("inner");
    std::fs::create_dir(&inner).unwrap();
    let again = inner.join("again.glb");
    let done = run(&[&"unwrap", &output, &"-o", &again, &"--bake-from", &"none"]);
    assert!(done.status.success(), "{}", err(&done));
    let again = Gltf::read(&again);
    is_sound(&again);
    same_corners(&new, &again);
    assert_eq!(again.png(0), std::fs::read(folder.0.join("out.png")).unwrap());
}

/// The colours under the middles of a primitive's triangles.
fn colors(file: &Gltf, primitive: &Value, png: &[u8]) -> Vec<[u8; 3]> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    let uv = file.by_corner(primitive, &primitive["attributes"]["TEXCOORD_0"]);
    let number = |row: &[u8], k: usize| f32::from_le_bytes(row[4 * k..4 * k + 4].try_into().unwrap());
    let middle = |t: &[Vec<u8>]| {
        let mean = |k: usize| t.iter().map(|row| number(row, k)).sum::<f32>() / 3.0;
        let [x, y] = [mean(0) * info.width as f32, mean(1) * info.height as f32];
        let i = info.color_type.samples() * (y as usize * info.width as usize + x as usize);
        [data[i], data[i + 1], data[i + 2]]
    };
    uv.chunks(3).map(middle).collect()
}

#[test]
fn textures_of_several_materials_are_drawn_anew() {
    let folder = Folder::new("keep-textures");
    let (new, _) = unwrapped(&folder, "out.glb", &[]);
    let materials = &new.json["materials"];
    let image = |path: &str| {
        let info = materials.pointer(path).unwrap();
        assert!(info.get("texCoord").is_none() && info.get("extensions").is_none(), "{info}");
        at(&new.json["textures"][at(&info["index"])]["source"])
    };
    let [red, blue] = [0, 1].map(|m| image(&format!("/{m}/pbrMetallicRoughness/baseColorTexture")));
    assert_eq!(red, blue);
    let rough = image("/0/pbrMetallicRoughness/metallicRoughnessTexture");
    assert_eq!(rough, image("/0/occlusionTexture"));
    let bumps = image("/1/normalTexture");
    assert!(red != rough && red != bumps && rough != bumps);
    assert_eq!(new.json["images"].as_array().unwrap().len(), 3);
    let [first, second, _] = new.primitives()[..] else { panic!("three primitives") };
    assert!(colors(&new, first, new.png(red)).iter().all(|c| *c == [200, 20, 20]));
    assert!(colors(&new, second, new.png(red)).iter().all(|c| *c == [20, 20, 200]));
    assert!(colors(&new, first, new.png(rough)).iter().all(|c| *c == [9, 99, 9]));
    // Tangents along the old coordinates would be wrong; the transform of a texture is drawn into it.
    assert!(new.primitives().iter().all(|p| p["attributes"].get("TANGENT").is_none()));
    assert_eq!(new.json["extensionsUsed"], json!(["KHR_lights_punctual", "EXT_unknown"]));
}

#[test]
fn an_instanced_mesh_is_laid_out_once() {
    let folder = Folder::new("keep-instances");
    let input = folder.0.join("robot.glb");
    std::fs::write(&input, robot().glb()).unwrap();
    let done = run(&[&"unwrap", &input, &"-o", &folder.0.join("out.glb"), &"--json"]);
    assert!(done.status.success(), "{}", err(&done));
    let told: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(told["triangles"], 24, "{told}");
}

#[test]
fn what_new_uvs_would_break_is_refused_before_the_work() {
    let folder = Folder::new("keep-refused");
    let refused = |name: &str, change: &dyn Fn(&mut Value), says: &str| {
        let mut file = robot();
        change(&mut file.json);
        let (input, output) =
            (folder.0.join(format!("{name}.glb")), folder.0.join(format!("{name}-out.glb")));
        std::fs::write(&input, file.glb()).unwrap();
        let done = run(&[&"unwrap", &input, &"-o", &output]);
        assert!(!done.status.success() && err(&done).contains(says), "{}", err(&done));
        assert!(!output.exists());
        run(&[&"unwrap", &input, &"-o", &output, &"--allow-loss"]).status.success()
    };
    let primitive = "/meshes/0/primitives/0";
    assert!(refused(
        "outline",
        &|j| j.pointer_mut(primitive).unwrap()["extensions"] = json!({ "X_outline": { "indices": 0 } }),
        "X_outline",
    ));
    assert!(refused(
        "lines",
        &|j| {
            let mut lines = j.pointer(primitive).unwrap().clone();
            lines["mode"] = 1.into();
            j["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
        },
        "textures on points or lines",
    ));
    assert!(refused(
        "webp",
        &|j| drop(j["textures"][0].as_object_mut().unwrap().remove("source")),
        "neither PNG nor JPEG",
    ));
    assert!(refused(
        "anisotropy",
        &|j| j["materials"][0]["extensions"] = json!({ "KHR_materials_anisotropy": {} }),
        "anisotropy",
    ));
    // These are damaged: no option helps.
    assert!(!refused("far", &|j| j["skins"][0]["inverseBindMatrices"] = 99.into(), "number 99 in accessors"));
    assert!(!refused("short", &|j| j["accessors"][2]["count"] = 7.into(), "7 rows for 8 vertices"));
    assert!(!refused("long", &|j| j["bufferViews"][3]["byteLength"] = 1e7.into(), "bufferView"));
}

#[test]
fn without_textures_the_old_images_stay() {
    let folder = Folder::new("keep-none");
    let (new, _) = unwrapped(&folder, "out.glb", &["--bake-from", "none"]);
    let old = Gltf::read(&folder.0.join("robot.glb"));
    assert_eq!(old.json["materials"], new.json["materials"]);
    assert_eq!(old.json["textures"], new.json["textures"]);
    (0..4).for_each(|i| assert_eq!(old.png(i), new.png(i)));
    is_sound(&new);
    same_corners(&old, &new);
}

#[test]
fn points_and_lines_beside_triangles_stay() {
    let folder = Folder::new("keep-lines");
    let mut file = robot();
    for primitive in file.json["meshes"][0]["primitives"].as_array_mut().unwrap() {
        primitive.as_object_mut().unwrap().remove("material");
    }
    let mut lines = file.json["meshes"][0]["primitives"][0].clone();
    lines["mode"] = 1.into();
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().insert(0, lines);
    let (input, output) = (folder.0.join("robot.glb"), folder.0.join("out.glb"));
    std::fs::write(&input, file.glb()).unwrap();
    let done = run(&[&"unwrap", &input, &"-o", &output]);
    assert!(done.status.success(), "{}", err(&done));
    let (old, new) = (Gltf::read(&input), Gltf::read(&output));
    is_sound(&new);
    same_corners(&old, &new);
    let uv = |file: &Gltf| {
        let lines = file.primitives()[0].clone();
        file.by_corner(&lines, &lines["attributes"]["TEXCOORD_0"])
    };
    assert!(uv(&old) == uv(&new), "the lines share the accessors of the triangles, which moved away");
}

#[test]
fn an_output_does_not_replace_files_that_the_input_uses() {
    let folder = Folder::new("keep-beside");
    let (_, output) = unwrapped(&folder, "out.gltf", &[]);
    let done = run(&[&"unwrap", &output, &"-o", &folder.0.join("out.glb")]);
    assert!(done.status.success(), "{}", err(&done));
    let other: &Path = &folder.0.join("b.gltf");
    std::fs::copy(&output, other).unwrap();
    let done = run(&[&"unwrap", &other, &"-o", &output]);
    assert_eq!(done.status.code(), Some(2));
    assert!(err(&done).contains("would replace"), "{}", err(&done));
}

/// Numbers under these names anywhere in a value.
fn named(value: &Value, names: &[&str], out: &mut Vec<u64>) {
    for (key, v) in value.as_object().into_iter().flatten() {
        out.extend(v.as_u64().filter(|_| names.contains(&&**key)));
        named(v, names, out);
    }
    value.as_array().into_iter().flatten().for_each(|v| named(v, names, out));
}

#[test]
fn what_nobody_names_any_more_is_left_out() {
    let folder = Folder::new("keep-lean");
    let (input, output) = (folder.0.join("robot.glb"), folder.0.join("out.gltf"));
    let mut file = robot();
    // An extension that is not known may name data: with one all numbers would stay.
    file.json["extensionsUsed"] = json!(["KHR_texture_transform", "KHR_lights_punctual"]);
    file.json["extensions"].as_object_mut().unwrap().remove("EXT_unknown");
    std::fs::write(&input, file.glb()).unwrap();
    let done = run(&[&"unwrap", &input, &"-o", &output]);
    assert!(done.status.success(), "{}", err(&done));
    let (old, new) = (Gltf::read(&input), Gltf::read(&output));
    all_else_is_kept(&old, &new);
    let accessors = [
        "POSITION",
        "NORMAL",
        "TEXCOORD_0",
        "TEXCOORD_1",
        "COLOR_0",
        "JOINTS_0",
        "WEIGHTS_0",
        "_OWN",
        "indices",
        "input",
        "output",
        "inverseBindMatrices",
    ];
    for (key, names) in
        [("accessors", &accessors[..]), ("bufferViews", &["bufferView"]), ("images", &["source"])]
    {
        let mut used = Vec::new();
        named(&new.json, names, &mut used);
        used.sort_unstable();
        used.dedup();
        let count = new.json[key].as_array().unwrap().len() as u64;
        assert_eq!(used, (0..count).collect::<Vec<u64>>(), "{key}");
    }
    let walk = |file: &Gltf| {
        let sampler = file.json["animations"][0]["samplers"][0].clone();
        [file.rows_of(&sampler["input"]), file.rows_of(&sampler["output"])]
    };
    assert!(walk(&old) == walk(&new));
    let bind = |file: &Gltf| file.rows_of(&file.json["skins"][0]["inverseBindMatrices"]);
    assert!(bind(&old) == bind(&new));
}
