"""The add-on in a Blender with a window: drives itself, takes pictures, checks Esc, undo and the interface,
and quits.

    xvfb-run ... blender --factory-startup --enable-event-simulate --window-geometry 0 0 1366 768
        --python gui.py

ADDON_ZIP names the legacy zip, PICTURES the folder for pictures (taken with scrot). Prints one line per
check, "GUI ok" at the end.
"""

import os
import struct
import subprocess
import sys
import time
import traceback
import zlib

import bpy
import numpy as np

bpy.ops.preferences.addon_install(filepath=os.environ["ADDON_ZIP"], overwrite=True)
bpy.ops.preferences.addon_enable(module="atlasfit_blender")
import atlasfit_blender as addon

mesh, Status = addon.mesh, addon.long.Status
PICTURES = os.environ["PICTURES"]
WAIT_S = 180  # for one run, on a loaded machine
failed = []
# Where the mouse must click, from a corner of the 3D view: neither the sidebar's tab nor the redo panel can be
# opened by script in 3.4.
TAB = (-12, -219)  # from the right and the top
REDO_PANEL = (75, 15)  # from the left and the bottom
SEAMS_OF_REDO_PANEL = (187, 252)
ROWS_OF_REDO_PANEL = 456  # its height when it is open


def window():
    return bpy.context.window_manager.windows[0]


def area(kind):
    return next(a for a in window().screen.areas if a.type == kind)


def within(kind):
    a = area(kind)
    region = next(r for r in a.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window(), screen=window().screen, area=a, region=region)


def place(x, y):
    """A place in the 3D view, from the window's bottom left: negative ones are from the right and the top."""
    a = area("VIEW_3D")
    return a.x + (x if x > 0 else a.width + x), a.y + (y if y > 0 else a.height + y)


def key(kind, value="PRESS", x=300, y=400):
    window().event_simulate(type=kind, value=value, x=x, y=y)


def picture(name):
    """The whole screen. With 256 colours a picture is a third of its size, and looks the same."""
    path = os.path.join(PICTURES, name)
    subprocess.run(["scrot", "-o", path], check=True)
    image = bpy.data.images.load(path)
    width, height = image.size
    rgb = np.array(image.pixels[:], np.float32).reshape(height, width, 4)[::-1, :, :3]
    bpy.data.images.remove(image)
    rgb = np.round(255 * rgb).astype(np.uint32).reshape(-1, 3)
    coarse = rgb // 8  # 32 steps a channel, then the most frequent 256 of them
    keys, which, count = np.unique(coarse @ np.uint32([1024, 32, 1]), return_inverse=True, return_counts=True)
    kept = np.argsort(-count)[:256]
    mean = np.stack([np.bincount(which, rgb[:, k]) / count for k in range(3)], 1)
    nearest = (
        np.argmin(((mean[:, None] - mean[None, kept]) ** 2).sum(-1), 1)
        if len(keys) < 20000
        else np.zeros(len(keys), int)
    )
    rows = np.zeros((height, width + 1), np.uint8)
    rows[:, 1:] = nearest[which].reshape(height, width)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    palette = np.round(mean[kept]).astype(np.uint8).tobytes()
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"PLTE", palette))
        file.write(chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b""))


def check(what, good):
    print("GUI", "ok  " if good else "FAIL", what)
    sys.stdout.flush()
    if not good:
        failed.append(what)


def active():
    return bpy.context.view_layer.objects.active


def layers():
    return [layer.name for layer in active().data.uv_layers]


def remove_all():
    for ob in list(bpy.data.objects):
        bpy.data.objects.remove(ob)


def waited():
    """Yields until no run of the add-on is under way."""
    until = time.monotonic() + WAIT_S
    while Status.label and time.monotonic() < until:
        yield 0.1
    check("the run ended", not Status.label)


def click(x, y):
    """A click on a place of the 3D view."""
    x, y = place(x, y)
    key("MOUSEMOVE", "NOTHING", x, y)
    yield 0.5
    key("LEFTMOUSE", "PRESS", x, y)
    key("LEFTMOUSE", "RELEASE", x, y)
    yield 1.0


def uvs():
    return mesh.uv_get(active().data.uv_layers.active).tobytes()


def changed_in_the_redo_panel():
    """Switches Seams in the panel of Atlas Unwrap, and waits until the run has begun."""
    x, y = place(*SEAMS_OF_REDO_PANEL)
    key("MOUSEMOVE", "NOTHING", x, y)
    yield 0.5
    key("LEFTMOUSE", "PRESS", x, y)
    key("LEFTMOUSE", "RELEASE", x, y)
    until = time.monotonic() + WAIT_S
    while not Status.label and time.monotonic() < until:
        yield 0.01


class Held:
    """The library's unwrap() that does not begin before it is let go, so that no check races with it."""

    def __init__(self):
        self.atlasfit, self.held = addon.layout.atlasfit, True
        self.unwrap, self.atlasfit.unwrap = self.atlasfit.unwrap, self

    def __call__(self, *given, progress, **options):
        until = time.monotonic() + WAIT_S
        while self.held and time.monotonic() < until and progress("held", 0.0):
            time.sleep(0.01)
        return self.unwrap(*given, progress=progress, **options)

    def let_go(self):
        self.held, self.atlasfit.unwrap = False, self.unwrap


def redo_is_modal():
    """A setting that is changed in the redo panel: the view turns meanwhile, Esc keeps the earlier result."""
    first, view, held = uvs(), area("VIEW_3D").spaces[0].region_3d, Held()
    yield from changed_in_the_redo_panel()
    check("redo works in a thread", Status.label == "Atlas Unwrap")
    check("and the scene is as before the first run meanwhile", layers() == [])
    turned = view.view_rotation.copy()
    key("MIDDLEMOUSE", "PRESS", 500, 400)
    for x in range(500, 600, 10):
        key("MOUSEMOVE", "NOTHING", x, 420)
    key("MIDDLEMOUSE", "RELEASE", 600, 420)
    until = time.monotonic() + WAIT_S
    while view.view_rotation == turned and time.monotonic() < until:
        yield 0.05
    check("the view turns meanwhile", view.view_rotation != turned and Status.label == "Atlas Unwrap")
    held.let_go()
    yield from waited()
    yield 0.5
    check("redo leaves one UV map", layers() == ["Atlas"])
    check("with the new setting", not bpy.context.window_manager.operators[-1].seams)
    second = uvs()
    check("and other UVs", second != first)
    held = Held()
    yield from changed_in_the_redo_panel()
    check("redo works again", Status.label == "Atlas Unwrap" and layers() == [])
    key("ESC")
    key("ESC", "RELEASE")
    yield from waited()
    held.let_go()
    yield 1.0
    check("Esc in redo keeps the earlier result", layers() == ["Atlas"] and uvs() == second)
    with within("VIEW_3D"):
        bpy.ops.view3d.view_axis(type="FRONT")


def first_look():
    """A scan comes in by its file and becomes a surface: what one sees then, with nothing else pressed."""
    remove_all()
    scan = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "vase.ply")
    with within("VIEW_3D"):
        bpy.ops.import_mesh.atlasfit_scan("INVOKE_DEFAULT", filepath=scan)
    yield from waited()
    yield 1.0
    check("the scan is there", active().name == "vase")
    check("with its colors", len(active().data.color_attributes) == 1)
    with within("VIEW_3D"):
        bpy.ops.object.atlasfit_reconstruct("INVOKE_DEFAULT")
    yield from waited()
    yield 2.0
    check("the surface is there", active().name == "vase Surface")
    check("and the scan hidden", bpy.data.objects["vase"].hide_get())
    check("the view shows its texture", area("VIEW_3D").spaces[0].shading.color_type == "TEXTURE")
    picture("reconstruct.png")
    area("VIEW_3D").spaces[0].shading.color_type = "MATERIAL"


def script():
    """Each yield lets Blender live for that many seconds. Over 80 lines: one walk through the window, in
    order.
    """
    area("VIEW_3D").spaces[0].show_region_ui = True
    yield 1.0
    yield from click(*TAB)
    yield from first_look()
    remove_all()
    with within("VIEW_3D"):
        bpy.ops.mesh.primitive_monkey_add()
        for layer in list(active().data.uv_layers):
            active().data.uv_layers.remove(layer)
        bpy.ops.object.modifier_add(type="SUBSURF")
        active().modifiers[0].levels = 1
        bpy.ops.object.modifier_apply(modifier=active().modifiers[0].name)
        bpy.ops.object.shade_smooth()
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()
        for edge in active().data.edges:  # for a setting to change
            edge.use_seam = all(abs(active().data.vertices[v].co.x) < 1e-4 for v in edge.vertices)
        bpy.ops.ed.undo_push(message="scene made")

    with within("VIEW_3D"):
        bpy.ops.uv.atlasfit_unwrap("INVOKE_DEFAULT", name="Atlas", target="NEW")
    check("invoke returns at once and works in a thread", Status.label == "Atlas Unwrap" and layers() == [])
    yield from waited()
    yield 1.0
    check("the UV map is written", layers() == ["Atlas"])
    yield from click(*REDO_PANEL)
    check(
        f"the redo panel is whole at {window().width} x {window().height}",
        ROWS_OF_REDO_PANEL < area("VIEW_3D").height,
    )
    yield 2.0  # a large window is drawn slowly
    picture("panel.png")
    yield from redo_is_modal()
    bpy.ops.ed.undo()
    yield 0.5
    check("undo takes it back in one step", layers() == [])
    bpy.ops.ed.redo()
    yield 0.5
    check("redo brings it again", layers() == ["Atlas"])

    with within("VIEW_3D"):
        bpy.ops.uv.atlasfit_stretch("INVOKE_DEFAULT", full_scale=1.2)
    yield from waited()
    yield 1.0
    picture("stretch.png")

    with within("VIEW_3D"):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="FACE")
        bpy.ops.mesh.select_all(action="SELECT")
    with within("VIEW_3D"):
        bpy.ops.uv.atlasfit_unwrap("INVOKE_DEFAULT", max_stretch=1.5)
    yield from waited()
    yield 0.5
    check("Edit mode stays", bpy.context.mode == "EDIT_MESH")
    with within("VIEW_3D"):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    yield 0.5
    [a for a in window().screen.areas if a.type == "VIEW_3D"][-1].ui_type = "UV"
    yield 0.7
    with within("IMAGE_EDITOR"):
        bpy.ops.image.view_all(fit_view=True)
    yield 1.0
    picture("uv_editor.png")
    with within("IMAGE_EDITOR"):
        bpy.ops.wm.call_menu(name="IMAGE_MT_uvs_unwrap")
    yield 0.7
    picture("menu.png")
    key("ESC")
    key("ESC", "RELEASE")
    yield 0.5
    with within("VIEW_3D"):
        bpy.ops.object.mode_set(mode="OBJECT")

    remove_all()
    rng = np.random.default_rng(1)
    p = rng.normal(size=(300_000, 3))
    p *= (1 + 0.005 * rng.normal(size=(len(p), 1))) / np.linalg.norm(p, axis=1)[:, None]
    me = bpy.data.meshes.new("scan")
    me.vertices.add(len(p))
    mesh.put(me.vertices, "co", p.astype(np.float32))
    me.update()
    ob = bpy.data.objects.new("scan", me)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    before = mesh.positions(me)
    started = time.perf_counter()
    with within("VIEW_3D"):
        bpy.ops.object.atlasfit_denoise("INVOKE_DEFAULT", result="PLACE")
    check(f"reading 300,000 points took {1000 * (time.perf_counter() - started):.0f} ms", True)
    yield 2.0
    turns, until = 0, time.monotonic() + 1.0
    while time.monotonic() < until:
        turns += 1
        yield 0.01
    check(f"the interface lives meanwhile ({turns} turns in a second)", turns > 0)
    picture("progress.png")
    # From the key's event to the end of the run: what goes before is Blender's own drawing.
    operator = addon.scan.OBJECT_OT_atlasfit_denoise
    original, took = addon.long.LongOperator.modal, []

    def timed(self, context, event):
        started = time.perf_counter()
        out = original(self, context, event)
        if event.type == "ESC" and out == {"CANCELLED"}:
            took.append(time.perf_counter() - started)
        return out

    operator.modal = timed
    key("ESC")
    key("ESC", "RELEASE")
    yield from waited()
    del operator.modal
    check(f"Esc ended the run within {1000 * took[0] if took else -1:.0f} ms", len(took) == 1)
    check(
        "and left the points alone",
        (mesh.positions(active().data) == before).all() and mesh.REPORT not in active().data,
    )
    check("the file is as it was", active().name == "scan" and len(bpy.data.objects) == 1)


def end():
    print("GUI ok" if not failed else f"GUI {len(failed)} failed")
    sys.stdout.flush()
    os._exit(1 if failed else 0)


steps = script()


def tick():
    try:
        return next(steps)
    except StopIteration:
        end()
    except Exception:
        traceback.print_exc(file=sys.stdout)
        failed.append("exception")
        end()


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=2.0)
