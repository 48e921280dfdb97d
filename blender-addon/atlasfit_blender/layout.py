# SPDX-License-Identifier: GPL-3.0-or-later
"""What Atlas Unwrap and Pack Islands share: meshes and their textures are read, the library lays out UVs, and
UVs, images and reports are written.
"""

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty, IntProperty

from . import bake, mesh, textures
from .long import LongOperator, Refused, within
from .native import atlasfit

UDIM_ROW = 10
LAID_OUT = 0.8  # share of a job's progress that its layout takes where colours are baked after it


class Layout(LongOperator):
    """What both operators have in common."""

    margin: IntProperty(
        name="Margin", description="Free pixels between charts", default=2, min=0, soft_max=64
    )
    texture_size: bake.TEXTURE_SIZE
    density: FloatProperty(
        name="Density",
        description=(
            "Pixels per unit of length, as scaled in the scene. 0 fills the texture; more than fits goes on"
            " to further UDIM tiles"
        ),
        default=0.0,
        min=0.0,
    )
    pages: IntProperty(
        name="Tiles",
        description=(
            "Most UDIM tiles. 0 is one, or with a density as many as it needs; where a density needs more"
            " than these it is lowered. Baking and images that are drawn anew make one"
        ),
        default=0,
        min=0,
        max=100,
    )
    keep_clear: BoolProperty(
        name="Keep Clear",
        description=(
            "In Edit mode charts keep clear of the UVs of the faces that are not selected. Without a density"
            " they get that of these faces, or less where that does not fit"
        ),
        default=True,
    )
    together: BoolProperty(
        name="One Texture",
        description="Several objects are packed on one texture, else on one each",
        default=True,
    )
    textures: BoolProperty(
        name="Keep Textures",
        description=(
            "Images that the materials show through the UV map are drawn anew for the new UVs, at no lower"
            " density"
        ),
        default=True,
    )

    @classmethod
    def poll(cls, context):
        return mesh.poll(context)

    def prepare(self, context):
        """Reads the meshes; the work lays out each group of them."""
        obs = mesh.objects(context)
        self._told = mesh.other_scales(context, obs)
        only_selected = context.mode == "EDIT_MESH"
        groups = [obs] if self.together else [[ob] for ob in obs]
        with mesh.object_mode(context, obs):
            jobs = [self.read(mesh.triangles(group, only_selected)) for group in groups]
            clear = only_selected and self.keep_clear and self.keeps_others()
            kept = [self.beside(group) if clear else {} for group in groups]
        options = self.library_options() | {
            "page_size": self.texture_size,
            "padding": self.margin,
            "pages": self.pages,
            "texels_per_unit": self.density,
        }
        lay_out = type(self).lay_out

        def work(progress, cancel):
            n = len(jobs)
            return [
                lay_out(*job, options | kept[i], progress=within(progress, i / n, (i + 1) / n), cancel=cancel)
                for i, job in enumerate(jobs)
            ]

        return work

    def beside(self, obs):
        """What the library is told of the faces that are not selected."""
        uvs, scale = mesh.not_selected(obs)
        if not len(uvs):
            return {}
        if self.density or not scale:
            return {"occupied_uv": uvs}
        return {"occupied_uv": uvs, "texels_per_unit": scale * self.texture_size, "pages": self.pages or 1}

    def keeps_others(self):
        """Whether the other faces keep their UVs in the UV map that is written."""
        return True

    def old_textures(self, obs, given, obstacle=None):
        """What the triangles show through their UVs, to be drawn anew; None where there is nothing."""
        obstacle = obstacle if self.textures else "Keep Textures is off"
        if any(len(part.loops) < len(ob.data.loop_triangles) for ob, part in zip(obs, given.parts)):
            obstacle = obstacle or "some of the faces that show it keep their UVs"
        old, said = textures.read(obs, given.parts, obstacle)
        if old is not None and self.pages > 1:
            raise Refused(
                "images are drawn anew on one tile: set Tiles to 0 or 1, or turn Keep Textures off"
            )
        self._told += said
        return old

    def finish(self, context, result):
        """Writes the UVs, images and reports."""
        notes, charts, faces = list(self._told), 0, 0
        obs = [ob for laid in result for ob in mesh.meshes_of(laid.given.parts)]
        self.check_room(obs)
        with mesh.object_mode(context, obs):
            for laid in result:
                info = laid.uv.info
                charts, faces = charts + info.charts, faces + info.triangles
                notes += self._notes(info)
                notes += self._write_group(laid)
                for part in laid.given.parts:
                    self._tell(bpy.data.objects[part.object].data, laid.uv, notes)
        text = f"{charts} charts for {faces} triangles in {self.seconds():.1f} s"
        self.report({"WARNING"} if notes else {"INFO"}, "; ".join([text, *notes]))

    def check_room(self, obs):
        """Refuses where the UVs have no place to be written to."""

    def layer(self, me):
        """The UV map to write to."""
        return me.uv_layers.active

    def wrote(self, part, me):
        """Called when the UVs of a part are written."""

    def _write_group(self, laid):
        notes, at, folded, pins = list(laid.notes), 0, 0, 0
        corner_uv = laid.uv.corner_uv
        if laid.uv.info.pages > 1 or laid.tiles.any():
            tile = laid.tiles[laid.uv.face_pages]
            shift = np.stack([tile % UDIM_ROW, tile // UDIM_ROW], -1)[:, None]
            corner_uv = corner_uv + shift.astype(np.float32)
            if laid.uv.info.pages > 1:
                notes.append(f"{laid.uv.info.pages} UDIM tiles")
        for part in laid.given.parts:
            me = bpy.data.objects[part.object].data
            torn, moved = self._write(me, part, corner_uv[at : at + len(part.loops)])
            at += len(part.loops)
            folded, pins = folded + torn, pins + moved
            self.wrote(part, me)
        written = [bpy.data.objects[part.object] for part in laid.given.parts]
        if laid.image is not None:
            notes += bake.write(laid.image, written)
        if laid.old is not None:
            notes += textures.write(laid.old, laid.drawn, written)
        if folded:
            notes.append(
                f"{folded} faces are too bent to lie flat in one piece and overlap in the UV map:"
                " triangulate them"
            )
        if pins:
            notes.append(f"{pins} pinned UVs were laid out anew")
        return notes

    def _write(self, me, part, corner_uv):
        """Writes one mesh's UVs; returns how many polygons could not stay in one piece, and how many pins
        were moved.
        """
        layer = self.layer(me)
        pins = mesh.pinned(layer)
        moved = int(pins[np.unique(part.loops)].sum()) if pins.any() else 0
        values = mesh.uv_get(layer)
        values[part.loops.ravel()] = corner_uv.reshape(-1, 2)
        torn = (values[part.loops] != corner_uv).any(axis=(1, 2))
        mesh.uv_put(layer, values)
        me.update()
        return len(np.unique(part.polygons[torn])), moved

    def _notes(self, info):
        out = []
        if info.degenerate_faces:
            out.append(f"{info.degenerate_faces} triangles have no area")
        if info.duplicate_faces:
            out.append(f"{info.duplicate_faces} triangles repeat another")
        if info.non_manifold_edges:
            out.append(f"{info.non_manifold_edges} edges are not manifold and were cut")
        return out + list(info.warnings)

    def _tell(self, me, uv, notes):
        mesh.set_report(
            me,
            self.bl_label,
            notes,
            charts=uv.info.charts,
            triangles=uv.info.triangles,
            **self.figures(uv.info),
            texture_filled=f"{100 * uv.info.coverage:.0f} %",
            pixels_per_unit=f"{uv.info.texels_per_unit:.4g}",
            seconds=f"{self.seconds():.2f}",
        )

    def figures(self, info):
        """What the report says besides."""
        return {}


class Laid:
    """A group that is laid out."""

    def __init__(self, given, uv):
        self.given, self.uv = given, uv
        self.image, self.old, self.drawn = None, None, []
        self.tiles = np.arange(uv.info.pages)  # the UDIM tile of each page
        self.notes = []


def unwrapped(given, options, progress, cancel, **constraints):
    """The UVs of a group."""
    return atlasfit.unwrap(
        given.vertices,
        given.faces,
        face_polygons=given.face_polygons,
        **constraints,
        **options,
        progress=progress,
        cancel=cancel,
    )


def laid_out(given, unwrap, options, old, progress, cancel, painted=False):
    """One group in the library: its UVs, by `unwrap`, and its old textures drawn anew. `painted`: colours are
    baked after it.
    """
    page = None
    if old is not None:
        page = old.page(given.vertices, given.faces, cancel=cancel)
        side, padding = max(options["page_size"], page.side), max(options["padding"], page.padding)
        options = options | {"page_size": side, "padding": padding, "pages": 1}
    share = LAID_OUT if painted or old is not None else 1.0
    part = within(progress, 0.0, share)
    try:
        laid = Laid(given, unwrap(given, options, part, cancel))
    except atlasfit.Error as error:
        if options.get("occupied_uv") is None or error.status_name != "invalid argument":
            raise
        laid = Laid(given, unwrap(given, options | {"occupied_uv": None}, part, cancel))
        laid.notes.append("the faces that are not selected leave no room: charts lie over theirs")
    uv = laid.uv
    if old is not None:
        laid.old = old
        laid.drawn = old.draw(
            given.vertices, given.faces, uv, page, progress=within(progress, share, 1.0), cancel=cancel
        )
    return laid
