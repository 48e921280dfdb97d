"""What the add-on adds to the library's own time on one mesh of 500,000 faces, in one process:

    ADDON_ZIP=... python overhead.py [FACES]          with the package bpy

The operator is timed whole, and the call into the library inside it; the rest is the add-on and the package.
"""

import os
import sys
import time

import bpy

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from made import torus, triangles

bpy.ops.extensions.package_install_files(
    filepath=os.environ["ADDON_ZIP"], repo="user_default", enable_on_install=True
)
import bl_ext.user_default.atlasfit_blender as addon

mesh, package = addon.mesh, sys.modules[addon.native.atlasfit.unwrap.__module__]
spent = []


def seconds():
    return time.perf_counter(), time.process_time()


class Timed:
    """The library with its unwrap timed."""

    def __getattr__(self, name):
        function = getattr(addon.native.atlasfit._abi.lib(), name)
        if name != "atlasfit_unwrap":
            return function

        def timed(*arguments):
            before = seconds()
            out = function(*arguments)
            spent.append([b - a for a, b in zip(before, seconds())])
            return out

        return timed


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 500_000
    around = int((count / 8) ** 0.5)
    vertices, quads = torus(count // (2 * around), around, 1, 3)
    faces, _ = triangles(quads)
    ob = bpy.data.objects.new("large", mesh.new_mesh("large", vertices, faces))
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    library = Timed()
    package.lib = lambda: library
    before = seconds()
    bpy.ops.uv.atlasfit_unwrap()
    whole = [b - a for a, b in zip(before, seconds())]
    for name, all_of_it, inside in zip(("wall clock", "processor"), whole, spent[0]):
        print(
            f"{len(faces)} faces, {name}: operator {all_of_it:.2f} s, library {inside:.2f} s, "
            f"overhead {100 * (all_of_it / inside - 1):.1f} %"
        )
    sys.stdout.flush()
    os._exit(0)


main()
