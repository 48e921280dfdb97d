# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of one shape that are unwrapped together: one is laid out, and the others get the same charts."""

import numpy as np

from . import mesh
from .layout import unwrapped
from .long import within

SAME = 1e-5  # share of its scale by which that of a copy may differ: what single precision leaves of a turn
SHAPES = 0.6  # share of the progress that they take; then all are packed
OF_ALL = {"stack": "none", "max_charts": 0, "straighten": "off"}  # with other values all are laid out at once
BY_FACE = ("face_groups", "corner_uv")


def firsts(obs, given, constraints):
    """For each part the number of the first one of its shape, whatever their turns and sizes. `constraints`
    are those of unwrap().
    """
    known, out, face, vertex = {}, [], 0, 0
    for i, (ob, part) in enumerate(zip(obs, given.parts)):
        own = slice(face, face + len(part.loops))
        of = slice(vertex, vertex + len(ob.data.vertices))
        face, vertex = own.stop, of.stop
        same = [mesh.positions(ob.data), given.faces[own] - of.start, part.polygons]
        edges = constraints.get("seam_edges")
        if edges is not None:
            same.append(edges[(edges[:, 0] >= of.start) & (edges[:, 0] < of.stop)] - of.start)
        if "face_groups" in constraints:
            same.append(constraints["face_groups"][own] - constraints["face_groups"][own].min())
        if "corner_uv" in constraints:
            same.append(constraints["corner_uv"][own])
        if "seam_price" in constraints:
            same.append(constraints["seam_price"][of])
        scale = mesh.linear(ob)
        scale = scale.T @ scale / np.sum(scale**2)  # the same for all turns and sizes
        alike = known.setdefault(tuple(array.tobytes() for array in same), [])
        first = next((j for j, other in alike if np.allclose(scale, other, atol=SAME)), i)
        if first == i:
            alike.append((i, scale))
        out.append(first)
    return out


def unwrap(given, options, progress, cancel, first, **constraints):
    """UVs of a group; `first` is what firsts() found."""
    shapes = sorted(set(first))
    if len(shapes) == len(first) or any(options[name] != plain for name, plain in OF_ALL.items()):
        return unwrapped(given, options, progress, cancel, **constraints)
    counts = [len(part.loops) for part in given.parts]
    of_part = np.repeat(np.arange(len(counts)), counts)
    one_each = np.isin(of_part, shapes)
    of_shapes = {
        name: values[one_each] if name in BY_FACE else values for name, values in constraints.items()
    }
    quick = options | {"packer": "boxes", "occupied_uv": None}  # they are packed once more
    uv = unwrapped(given.some(one_each), quick, within(progress, 0.0, SHAPES), cancel, **of_shapes)
    # Beside each other, so that charts of two pages do not meet.
    laid = uv.corner_uv + uv.face_pages[:, None, None].astype(np.float32)
    ends = np.cumsum([counts[i] for i in shapes])
    laid = dict(zip(shapes, np.split(laid, ends[:-1])))
    kept = {"corner_uv": np.concatenate([laid[i] for i in first]), "keep_uvs": True}
    if "seam_edges" in constraints:
        kept["seam_edges"] = constraints["seam_edges"]
    # What hid the seams of the first ones counts for their copies, however these are turned.
    return unwrapped(given, options | {"seams_hidden": 0}, within(progress, SHAPES, 1.0), cancel, **kept)
