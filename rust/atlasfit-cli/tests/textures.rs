//! Textures and all else that a mesh's file holds survive new UVs.

mod common;

use common::{Folder, err, png_of, run};
use std::path::Path;

/// A house of two materials: walls and a roof, with hard edges, groups, and a square face.
const HOUSE: &str = "# a house\nmtllib house.mtl\no house\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0.5 1\n\
    v 1 0.5 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 -1\nvn 0 -0.9 0.4\nvn 0 0.9 0.4\ng floor\ns off\n\
    usemtl wall\nf 1/1/1 4/4/1 3/3/1 2/2/1\ng roof\ns 1\nusemtl tiles\nf 1/1/2 2/2/2 6/3/2 5/4/2\n\
    f -4/1/3 -1/2/3 -2/3/3\nf 3/1/3 5/2/3 4/3/3\n";
const LIBRARY: &str = "newmtl wall\nKd 1 1 1\nNs 12\nmap_Kd wall.png\nnewmtl tiles\nKd 1 1 1\nd 0.5\n\
    map_Kd tiles.png\n";

fn house(folder: &Folder) -> std::path::PathBuf {
    folder.file("house.mtl", LIBRARY);
    std::fs::write(folder.0.join("wall.png"), png_of([200, 20, 20])).unwrap();
    std::fs::write(folder.0.join("tiles.png"), png_of([20, 20, 200])).unwrap();
    folder.file("house.obj", HOUSE)
}

/// The lines of an OBJ file that UVs do not touch.
fn untouched(obj: &str) -> Vec<&str> {
    let touched = |l: &&str| ["vt ", "f ", "mtllib "].iter().any(|k| l.starts_with(k));
    obj.lines().filter(|l| !touched(l)).collect()
}

#[test]
fn an_obj_file_keeps_its_materials_groups_and_normals() {
    let folder = Folder::new("textures-keep");
    let (mesh, output) = (house(&folder), folder.0.join("out.obj"));
    let done = run(&[&"unwrap", &mesh, &"-o", &output]);
    assert!(done.status.success(), "{}", err(&done));
    let text = std::fs::read_to_string(&output).unwrap();
    assert_eq!(untouched(&text), untouched(HOUSE));
    assert!(text.contains("mtllib out.mtl"), "{text}");
    let library = std::fs::read_to_string(folder.0.join("out.mtl")).unwrap();
    let renamed = LIBRARY.replace("wall.png", "out.png").replace("tiles.png", "out.png");
    assert_eq!(library, renamed);
    // Every corner still names its normal.
    let faces: Vec<&str> = text.lines().filter(|l| l.starts_with("f ")).collect();
    let normals = |f: &str| f.split(' ').skip(1).all(|c| c.split('/').count() == 3);
    assert!(faces.len() >= 4 && faces.iter().all(|f| normals(f)), "{faces:?}");
    assert!(faces[0].split(' ').skip(1).all(|c| c.ends_with("/1")), "{}", faces[0]);
}

/// The colours of a texture under the middle of each face.
fn colors(obj: &str, image: &Path) -> Vec<[u8; 3]> {
    let file = std::io::BufReader::new(std::fs::File::open(image).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    let numbers = |l: &str| -> Vec<f64> { l.split(' ').skip(1).map(|w| w.parse().unwrap()).collect() };
    let uv: Vec<Vec<f64>> = obj.lines().filter(|l| l.starts_with("vt ")).map(numbers).collect();
    let face = |l: &str| {
        let at = |c: &str| c.split('/').nth(1).unwrap().parse::<usize>().unwrap() - 1;
        let corners: Vec<&Vec<f64>> = l.split(' ').skip(1).map(|c| &uv[at(c)]).collect();
        let mean = |k: usize| corners.iter().map(|c| c[k]).sum::<f64>() / corners.len() as f64;
        let (w, h) = (f64::from(info.width), f64::from(info.height));
        let i = 3 * (((1.0 - mean(1)) * h) as usize * info.width as usize + (mean(0) * w) as usize);
        [data[i], data[i + 1], data[i + 2]]
    };
    obj.lines().filter(|l| l.starts_with("f ")).map(face).collect()
}

#[test]
fn the_images_of_several_materials_become_one_page() {
    let folder = Folder::new("textures-merge");
    let (mesh, output) = (house(&folder), folder.0.join("out.obj"));
    let done = run(&[&"unwrap", &mesh, &"-o", &output]);
    assert!(done.status.success(), "{}", err(&done));
    let text = std::fs::read_to_string(&output).unwrap();
    let colors = colors(&text, &folder.0.join("out.png"));
    assert_eq!(colors[0], [200, 20, 20]);
    assert!(colors[1..].iter().all(|c| *c == [20, 20, 200]), "{colors:?}");
    // Without textures the old library stays.
    let done = run(&[&"unwrap", &mesh, &"-o", &output, &"--bake-from", &"none"]);
    assert!(done.status.success(), "{}", err(&done));
    assert!(std::fs::read_to_string(&output).unwrap().contains("mtllib house.mtl"));
}

#[test]
fn an_image_for_a_mesh_without_one_comes_with_a_material() {
    let folder = Folder::new("textures-named");
    let (mesh, output) = (house(&folder), folder.0.join("out.obj"));
    let plain: Vec<&str> =
        HOUSE.lines().filter(|l| !l.starts_with("mtllib") && !l.starts_with("usemtl")).collect();
    std::fs::write(&mesh, plain.join("\n")).unwrap();
    let image = folder.0.join("wall.png");
    let done = run(&[&"unwrap", &mesh, &"-o", &output, &"--bake-from", &image]);
    assert!(done.status.success(), "{}", err(&done));
    let text = std::fs::read_to_string(&output).unwrap();
    assert!(text.contains("usemtl"), "{text}");
    assert!(folder.0.join("out.png").exists());
}

#[test]
fn what_the_output_cannot_keep_is_refused_before_the_work() {
    let folder = Folder::new("textures-refuse");
    let (mesh, output) = (house(&folder), folder.0.join("out.glb"));
    let done = run(&[&"unwrap", &mesh, &"-o", &output]);
    assert_eq!(done.status.code(), Some(2));
    assert!(err(&done).contains("does not keep: 2 materials"), "{}", err(&done));
    assert!(!output.exists());
    let gltf = "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0},{\"mesh\":0}],\
        \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\
        \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],\
        \"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"buffers\":[{\"byteLength\":36,\
        \"uri\":\"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}]}";
    let scene = folder.file("scene.gltf", gltf);
    // A GLB keeps both nodes, another format does not.
    let output = folder.0.join("out.ply");
    let done = run(&[&"unwrap", &scene, &"-o", &output]);
    assert_eq!(done.status.code(), Some(2));
    assert!(err(&done).contains("2 nodes with meshes"), "{}", err(&done));
    let done = run(&[&"unwrap", &scene, &"-o", &output, &"--allow-loss"]);
    assert!(done.status.success(), "{}", err(&done));
    // A file that the input uses is not replaced by the output's own.
    let wall = folder.0.join("wall.obj");
    let done = run(&[&"unwrap", &mesh, &"-o", &wall]);
    assert_eq!(done.status.code(), Some(2));
    assert!(err(&done).contains("would replace"), "{}", err(&done));
    assert_eq!(std::fs::read(folder.0.join("wall.png")).unwrap(), png_of([200, 20, 20]));
}
