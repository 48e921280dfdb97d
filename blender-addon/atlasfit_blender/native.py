# SPDX-License-Identifier: GPL-3.0-or-later
"""The package `atlasfit`: inside this folder in the legacy zip, from its wheel in the extension."""

import importlib
import importlib.util

if importlib.util.find_spec(f"{__package__}.atlasfit"):
    atlasfit = importlib.import_module(f"{__package__}.atlasfit")
else:
    atlasfit = importlib.import_module("atlasfit")
