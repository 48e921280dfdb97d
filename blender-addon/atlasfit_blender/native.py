# SPDX-License-Identifier: GPL-3.0-or-later
"""The package `atlasfit`: inside this folder in the legacy zip, from its wheel in the extension."""

import importlib
import importlib.util

import bpy

EXTENSIONS = (4, 2, 0)  # the first Blender that knows them
REFUSAL = (
    "This is Atlasfit's extension for Blender 4.2 and later: in this Blender install the zip with \"legacy\""
    " in its name (atlasfit_blender-VERSION-legacy-PLATFORM.zip) instead"
)


def _refuse():
    """Ends the import of the add-on with one sentence: in a window where there is one, and on the console."""

    def show():
        draw = lambda menu, context: menu.layout.label(text=REFUSAL)
        bpy.context.window_manager.popup_menu(draw, title="Atlasfit", icon="ERROR")

    if not bpy.app.background:
        bpy.app.timers.register(show, first_interval=0.1)  # there is no context while add-ons are imported
    raise ImportError(REFUSAL, name=__package__)  # of this name Blender prints no traceback


if importlib.util.find_spec(f"{__package__}.atlasfit"):
    atlasfit = importlib.import_module(f"{__package__}.atlasfit")
elif bpy.app.version < EXTENSIONS:
    _refuse()
else:
    atlasfit = importlib.import_module("atlasfit")
