# SPDX-License-Identifier: GPL-3.0-or-later
"""What Denoise Scan and Reconstruct share: their options, what they read beside the points, the report."""

import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from . import mesh
from .long import LongOperator, Refused


def active(context):
    ob = context.view_layer.objects.active
    if not mesh.is_scan(ob):
        raise Refused("the active object is no mesh and no point cloud")
    return ob


def normals_of(me, matrix):
    """Which side is outside, of meshes that have faces, in the frame that the matrix leads to.

    Of points without faces those that they were imported with; None without."""
    if mesh.has_faces(me):
        normals = mesh.get(me.vertices, "normal", 3, np.float32)
    else:
        known = me.attributes.get(mesh.NORMAL)
        if known is None or known.domain != "POINT" or known.data_type != "FLOAT_VECTOR":
            return None
        normals = mesh.get(known.data, "vector", 3, np.float32)
    return unit(normals @ np.linalg.inv(matrix)).astype(np.float32)


def viewpoint_of(me, matrix):
    """Where the scanner stood, in the frame that the matrix leads to; None where that is not known."""
    known = me.get(mesh.VIEWPOINT)
    return None if known is None else np.array(known, np.float64) @ matrix.T


def sweeps_of(me, name):
    """Which sweep each point is of, by the attribute that tells."""
    known = me.attributes.get(name)
    if known is None or known.domain != "POINT" or known.data_type not in {"INT", "INT8"}:
        whole = [a.name for a in me.attributes if a.domain == "POINT" and a.data_type in {"INT", "INT8"}]
        have = f"it has {', '.join(whole)}" if whole else "it has none"
        raise Refused(f"sweeps are told by an attribute of points, of integers: {name} is none ({have})")
    return mesh.get(known.data, "value", 1, mesh.KINDS[known.data_type][2])


def unit(vectors):
    """Of length 1; zeros stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def keep_report(me, title, report, seconds, notes):
    found = {
        "points": report.points,
        "outliers": report.outliers,
        "followed_outliers": report.followed_outliers,
        "noise": f"{report.noise:.4g}",
        "spacing": f"{report.spacing:.4g}",
        "fitted_charts": report.charts,
        "surface_triangles": report.triangles,
        "parts": report.parts,
        "dropped_parts": report.dropped_parts,
        "dropped_points": report.dropped_points,
        "boundary_loops": report.boundary_loops,
        "filled_holes": report.filled_holes,
        "uv_charts": report.uv_charts,
        "uncertainty_factor": 0 if report.uncertainty_factor is None else f"{report.uncertainty_factor:.3g}",
        "sweeps": len(report.sweeps),
        "sweeps_apart_before": f"{report.apart_before:.3g}",
        "sweeps_apart_after": f"{report.apart_after:.3g}",
        "seconds": f"{seconds:.2f}",
    }
    mesh.set_report(me, title, notes, **{key: value for key, value in found.items() if value not in (0, "0")})


def notes_of(report):
    out = []
    if report.not_finite:
        out.append(f"{report.not_finite} points have no finite position")
    if report.outliers:
        follow = report.followed_outliers
        between = f", {follow} put between their neighbours" if follow else ""
        out.append(f"{report.outliers} outliers{between}")
    if report.dropped_parts:
        parts = "1 part" if report.dropped_parts == 1 else f"{report.dropped_parts} parts"
        out.append(f"{parts} left out with {report.dropped_points} points")
    if report.one_sided:
        out.append("some part is one-sided")
    return out + list(report.warnings)


class Fit(LongOperator):
    """What both operators have in common."""

    noise: FloatProperty(
        name="Noise",
        description=(
            "Standard deviation of the noise along the normal, as scaled in the scene. 0 estimates it"
        ),
        default=0.0,
        min=0.0,
        precision=4,
    )
    strength: FloatProperty(
        name="Strength",
        description=(
            "How strongly to denoise: 1 is as much as the scan asks for, 2 is smoother, 0 leaves the points "
            "where they are"
        ),
        default=1.0,
        min=0.0,
        soft_max=4.0,
    )
    charts: IntProperty(
        name="Charts",
        description="Number of charts to aim for. 0 is as many as the shape needs",
        default=0,
        min=0,
    )
    prior: EnumProperty(
        name="Prior",
        description="What smooth means",
        items=(
            ("gp", "Gaussian Process", "As smooth as the limit of the paper's networks"),
            (
                "mlp",
                "Networks",
                "The paper's fully connected networks, trained on the scan first: many times slower",
            ),
            ("conv", "Convolutional Networks", "The paper's convolutional networks: many times slower"),
            ("level-set", "Level Set", "The paper's level set, closed surfaces only: many times slower"),
        ),
        default="gp",
    )
    uncertainty: BoolProperty(
        name="Uncertainty",
        description=(
            "Say how sure the result is, by attributes: uncertainty is the standard deviation along the"
            " normal, as scaled in the scene. Points also get noise and outlier_probability, a surface"
            " extrapolated, which is 1 where it was invented"
        ),
        default=False,
    )

    sweeps: StringProperty(
        name="Sweeps",
        description=(
            "Name of an integer attribute of the points that tells apart the sweeps of which the scan was"
            " merged: they are moved together first, each by a small rigid motion. Empty moves none"
        ),
    )

    @classmethod
    def poll(cls, context):
        ob = context.view_layer.objects.active
        return mesh.is_scan(ob) and context.mode in {"OBJECT", "EDIT_MESH"}

    def fit_options(self):
        """Of the fit: the operator must not be touched from the thread that works."""
        names = ("strength", "noise", "charts", "prior", "uncertainty")
        return {name: getattr(self, name) for name in names} | {"sweeps": self.sweeps or None}
