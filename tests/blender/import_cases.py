"""Cases of Import Scan, and of what one sees first of a result. Part of cases.py, which runs them."""

import os
import struct
import sys
import tempfile

import bpy
import numpy as np

from made import sphere_points
from pages import DOCS, bold, code
from scenes import addon, atlasfit, mesh, monkey, refused, scan, select

PAINT = np.uint8([[255, 128, 0], [10, 200, 30]])


def folder():
    return tempfile.mkdtemp()


def painted(points):
    """A colour for each point: one above, one below."""
    return PAINT[(points[:, 2] > 0).astype(int)]


def las(path, points, colors, scale=0.001):
    """LAS 1.2, point format 2, colours of 16 bits."""
    origin = np.floor(points.min(axis=0))
    rows = np.zeros(len(points), [("xyz", "<i4", 3), ("rest", "u1", 8), ("rgb", "<u2", 3)])
    rows["xyz"] = np.round((points - origin) / scale)
    rows["rgb"] = colors.astype(np.uint16) * 257
    high, low = points.max(axis=0), points.min(axis=0)
    head = struct.pack(
        "<4sHHI12xBB32s32sHHHIIBHI20x",
        b"LASF",
        0,
        0,
        0,
        1,
        2,
        b"",
        b"",
        1,
        2026,
        227,
        227,
        0,
        2,
        26,
        len(points),
    )
    box = [v for pair in zip(high, low) for v in pair]
    head += struct.pack("<12d", *[scale] * 3, *origin, *box)
    with open(path, "wb") as file:
        file.write(head + rows.tobytes())


def pcd(path, points, colors):
    packed = (colors.astype(np.uint32) * [1 << 16, 1 << 8, 1]).sum(axis=1)
    with open(path, "w") as file:
        file.write("VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n")
        file.write(f"WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA ascii\n")
        for p, c in zip(points, packed):
            file.write("{:.6f} {:.6f} {:.6f} {}\n".format(*p, c))


def colors_of(ob):
    """The active colours as 8 bits, as a file has them."""
    values = mesh.get(ob.data.color_attributes.active_color.data, "color", 4, np.float32)
    return np.round(255 * addon.bake.srgb(values)[:, :3]).astype(int)


def test_scans_come_in_with_the_colors_of_their_points():
    points, where = sphere_points(500), folder()
    las(f"{where}/a.las", points, painted(points))
    pcd(f"{where}/a.pcd", points, painted(points))
    atlasfit.save(f"{where}/a.ply", points, colors=painted(points), attributes={"label": np.arange(500)})
    atlasfit.save(f"{where}/a.xyz", points, colors=painted(points))
    for end in ("las", "pcd", "ply", "xyz"):
        assert bpy.ops.import_mesh.atlasfit_scan(filepath=f"{where}/a.{end}") == {"FINISHED"}
        ob = bpy.context.object
        assert ob.name.split(".")[0] == "a" and ob.select_get() and not ob.data.polygons
        assert np.abs(mesh.positions(ob.data) - points).max() < 0.002, end
        assert np.abs(colors_of(ob) - painted(points)).max() <= 1, end
        if end == "ply":
            label = ob.data.attributes["label"]
            assert label.data_type == "INT"
            assert (mesh.get(label.data, "value", 1, np.int32) == np.arange(500)).all()


def test_several_files_are_several_objects_and_meshes_keep_their_faces():
    where = folder()
    atlasfit.save(f"{where}/cloud.ply", sphere_points(100))
    atlasfit.save(f"{where}/face.ply", np.eye(3), [[0, 1, 2]], corner_uv=[[[0, 0], [1, 0], [0, 1]]])
    names = [{"name": "cloud.ply"}, {"name": "face.ply"}]
    bpy.ops.import_mesh.atlasfit_scan(directory=where, files=names)
    cloud, face = bpy.data.objects["cloud"], bpy.data.objects["face"]
    assert len(cloud.data.vertices) == 100 and len(face.data.polygons) == 1
    assert (mesh.uv_get(face.data.uv_layers.active) == [[0, 0], [1, 0], [0, 1]]).all()
    assert {ob.name for ob in bpy.context.selected_objects} == {"cloud", "face"}


def test_survey_coordinates_are_moved_to_the_origin_so_that_no_digit_is_lost():
    points, where = sphere_points(500), folder()
    far = np.array([500_000.0, 5_400_000.0, 300.0])
    atlasfit.save(f"{where}/far.xyz", points + far)
    bpy.ops.import_mesh.atlasfit_scan(filepath=f"{where}/far.xyz")
    me = bpy.context.object.data
    assert np.abs(mesh.positions(me) + np.array(me["atlasfit_origin"]) - far - points).max() < 1e-5
    bpy.ops.import_mesh.atlasfit_scan(filepath=f"{where}/far.xyz", to_origin=False)
    assert mesh.positions(bpy.context.object.data)[:, 1].min() > 5e6


def test_the_axis_that_is_up_is_that_of_blenders_own_importers_or_the_one_asked_for():
    where = folder()
    points = np.float32([[1, 2, 3], [4, 5, 6], [7, 8, 10]])
    normals = np.float32([[0, 1, 0]] * 3)
    turned = points[:, [0, 2, 1]] * np.float32([1, -1, 1])
    up = lambda **how: bpy.ops.import_mesh.atlasfit_scan(**how) and mesh.positions(bpy.context.object.data)
    for end, y_up in (("obj", True), ("glb", True), ("ply", False), ("off", False), ("stl", False)):
        path = f"{where}/a.{end}"
        atlasfit.save(path, points, [[0, 1, 2]])
        ordered = lambda values: values[np.argsort(values[:, 0])]
        assert np.allclose(ordered(up(filepath=path)), turned if y_up else points), end
        assert np.allclose(ordered(up(filepath=path, up="Y")), turned), end
        assert np.allclose(ordered(up(filepath=path, up="Z")), points), end
        if end == "obj" and hasattr(bpy.ops.wm, "obj_import"):
            bpy.ops.wm.obj_import(filepath=path)
            ob = bpy.context.object
            theirs = np.array([ob.matrix_world @ v.co for v in ob.data.vertices])
            assert np.allclose(ordered(theirs), turned, atol=1e-5)
    atlasfit.save(f"{where}/b.ply", points, normals=normals)
    up(filepath=f"{where}/b.ply", up="Y")
    found = mesh.get(bpy.context.object.data.attributes[mesh.NORMAL].data, "vector", 3, np.float32)
    assert np.allclose(found, [0, 0, 1]), "normals turn too"


def cloud(n=3000):
    """A sphere of points as a point cloud object."""
    ob = scan(n)
    co = mesh.positions(ob.data)
    mesh.add_attribute(ob.data, "Paint", "FLOAT_COLOR", np.c_[0.5 + 0.5 * np.clip(co, -1, 1), np.ones(n)])
    mesh.add_attribute(ob.data, "label", "INT", (co[:, 2] > 0) * 7)
    bpy.context.view_layer.update()
    select(ob)
    bpy.ops.object.convert(target="POINTCLOUD")
    return bpy.context.object


def test_point_cloud_objects_are_scans():
    if bpy.app.version < (5, 0, 0):  # it has none
        return
    ob = cloud()
    assert ob.type == "POINTCLOUD"
    before = mesh.positions(ob.data)
    assert bpy.ops.object.atlasfit_reconstruct() == {"FINISHED"}
    new = bpy.context.object
    assert new.type == "MESH" and ob.hide_get()
    p = mesh.positions(new.data)
    assert np.abs(np.linalg.norm(p, axis=1) - 1).max() < 0.05 and len(new.data.polygons) < 1.5 * 2 * 3000
    colors = mesh.get(new.data.color_attributes["Paint"].data, "color", 4, np.float32)
    assert np.abs(colors[:, :3] - (0.5 + 0.5 * p)).mean() < 0.03
    assert set(mesh.get(new.data.attributes["label"].data, "value", 1, np.int32)) == {0, 7}
    ob.hide_set(False)
    select(ob)
    assert bpy.ops.object.atlasfit_denoise() == {"FINISHED"}
    moved = bpy.context.object
    assert moved.type == "POINTCLOUD" and moved != ob and (mesh.positions(ob.data) == before).all()
    off = lambda points: np.abs(np.linalg.norm(points, axis=1) - 1).mean()
    assert off(mesh.positions(moved.data)) < 0.6 * off(before)
    assert moved.data[mesh.REPORT]["title"] == "Denoise Scan"
    select(moved)
    bpy.ops.object.atlasfit_denoise(result="PLACE")
    refused(lambda: bpy.ops.object.atlasfit_denoise(result="SHAPE"), "convert it to a mesh first")
    refused(lambda: bpy.ops.object.atlasfit_denoise(drop=True), "convert it to a mesh first")


def test_files_that_are_none_are_refused_and_nothing_is_made():
    where = folder()
    with open(f"{where}/bad.las", "wb") as file:
        file.write(b"LASF" + bytes(300))
    before = len(bpy.data.objects)
    refused(lambda: bpy.ops.import_mesh.atlasfit_scan(filepath=f"{where}/bad.las"), "bad.las")
    refused(lambda: bpy.ops.import_mesh.atlasfit_scan(filepath=f"{where}/none.ply"), "cannot open it")
    refused(lambda: bpy.ops.import_mesh.atlasfit_scan(), "no file is named")
    assert len(bpy.data.objects) == before and len(bpy.data.meshes) == before


def test_normals_and_the_scanners_place_turn_the_surface():
    where, points = folder(), sphere_points(6000)
    points = points[points[:, 2] > 0]  # what a scanner above sees
    atlasfit.save(f"{where}/in.ply", points, normals=-points / np.linalg.norm(points, axis=1, keepdims=True))
    bpy.ops.import_mesh.atlasfit_scan(filepath=f"{where}/in.ply")
    ob = bpy.context.object

    def outward():
        bpy.ops.object.atlasfit_reconstruct(bake=False)
        me = bpy.context.object.data
        return np.mean(np.sum(mesh.get(me.vertices, "normal", 3, np.float32) * mesh.positions(me), 1) > 0)

    assert outward() < 0.1, "the file's normals point inward"
    select(ob)
    ob.data[mesh.VIEWPOINT] = [0.0, 0.0, 50.0]
    assert outward() > 0.9, "the scanner stood outside"


# ---- the first look


def test_the_result_stands_where_the_scan_is_hidden():
    for operator in (bpy.ops.object.atlasfit_reconstruct, bpy.ops.object.atlasfit_denoise):
        ob = scan()
        operator()
        assert ob.hide_get() and not bpy.context.object.hide_get() and bpy.context.object != ob
        ob = scan()
        operator(hide=False)
        assert not ob.hide_get()
    ob = scan()
    bpy.ops.object.atlasfit_denoise(result="PLACE")
    assert not ob.hide_get()


def image_of(ob):
    (material,) = {slot.material for slot in ob.material_slots}
    return next(n.image for n in material.node_tree.nodes if n.type == "TEX_IMAGE")


def test_a_surface_without_colors_shows_a_checker_and_what_is_baked_later_takes_its_place():
    scan()
    bpy.ops.object.atlasfit_reconstruct()
    first = bpy.context.object
    assert image_of(first).generated_type == "UV_GRID"
    scan()
    bpy.ops.object.atlasfit_reconstruct()
    assert bpy.context.object.material_slots[0].material == first.material_slots[0].material, "one is enough"
    scan()
    bpy.ops.object.atlasfit_reconstruct(bake=False)
    assert not bpy.context.object.material_slots


def test_images_lie_beside_a_saved_file_and_exports_name_them():
    where = folder()
    bpy.ops.wm.save_as_mainfile(filepath=f"{where}/scene.blend")
    ob = monkey()
    mesh.add_attribute(ob.data, "Paint", "FLOAT_COLOR", np.full((len(ob.data.vertices), 4), 0.5))
    ob.data.color_attributes.active_color = ob.data.color_attributes["Paint"]
    with open(f"{where}/Suzanne_Color.png", "w") as mine:
        mine.write("mine")
    for _ in range(2):
        bpy.ops.uv.atlasfit_unwrap(bake=True, texture_size=64)
        assert image_of(ob).packed_file is not None and image_of(ob).filepath_raw == "//Suzanne_Color_1.png"
    assert sorted(os.listdir(where)) == ["Suzanne_Color.png", "Suzanne_Color_1.png", "scene.blend"]
    if hasattr(bpy.ops.wm, "obj_export"):
        bpy.ops.wm.obj_export(filepath=f"{where}/out.obj")
        with open(f"{where}/out.mtl") as library:
            assert "Suzanne_Color_1.png" in library.read()


def test_the_page_grows_with_the_scan():
    ob = scan(100_000)
    mesh.add_attribute(ob.data, "Paint", "FLOAT_COLOR", np.full((100_000, 4), 0.5))
    ob.data.color_attributes.active_color = ob.data.color_attributes["Paint"]
    bpy.ops.object.atlasfit_reconstruct()
    assert tuple(image_of(bpy.context.object).size) == (1024, 1024)
    assert len(bpy.context.object.data.polygons) < 1.2 * 100_000, "about as many faces as points"
    assert [atlasfit.texture_side(n) for n in (3000, 209_000, 10**7)] == [512, 2048, 8192]


def test_the_page_for_blender_works_to_the_letter():
    folder, here, arguments = tempfile.mkdtemp(), os.getcwd(), sys.argv
    vase = atlasfit.load(os.path.join(os.path.dirname(DOCS), "examples", "vase.ply"))
    os.mkdir(f"{folder}/examples")
    atlasfit.save(f"{folder}/examples/vase.ply", vase.points[::5], colors=vase.colors[::5])
    os.chdir(folder)
    sys.argv = ["blender", "--", "examples"]
    try:
        exec(compile(code("blender.md"), "docs/blender.md", "exec"), {})
    finally:
        os.chdir(here)
        sys.argv = arguments
    assert os.path.exists(f"{folder}/vase.blend") and bpy.context.object.name == "vase Surface"
    labels = {
        getattr(bpy.types, name).bl_label for name in dir(bpy.types) if "atlasfit" in name and "_OT_" in name
    }
    assert bold("blender.md") - {"Scan (.e57, .las, .laz, .pcd, .ply, .xyz)"} <= labels
