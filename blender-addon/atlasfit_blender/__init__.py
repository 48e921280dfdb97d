# SPDX-License-Identifier: GPL-3.0-or-later
"""Atlasfit for Blender: low-stretch chart UVs for any mesh, denoised scans, reconstructed surfaces.

The add-on holds no algorithm: it reads meshes into arrays (mesh.py), hands them to the package `atlasfit` in
a thread (long.py), and writes what comes back. One source serves Blender 3.4 to 4.1 (legacy add-on: bl_info
below) and 4.2 and later (extension: blender_manifest.toml).
"""

bl_info = {
    "name": "Atlasfit",
    "author": "The atlasfit developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import; UV and Object menus; sidebar of 3D view and UV editor, tab Atlasfit",
    "description": "Low-stretch chart UVs for any mesh; denoising and reconstruction of scans",
    "category": "UV",
}

from . import files, menus, pack, scan, seams, stretch, uv

_parts = (uv, seams, pack, stretch, scan, files, menus)


def register():
    for part in _parts:
        part.register()


def unregister():
    for part in reversed(_parts):
        part.unregister()
