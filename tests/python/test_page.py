"""The pages of --report: what they hold, and that a browser shows it. Chromium draws them where it is
installed (Debian: chromium; tests/run installs it where it may)."""

import base64
import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image

from conftest import ROOT

VASE = ROOT / "examples" / "vase.ply"
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def pages(program, tmp_path_factory):
    """The pages of denoising the vase and of unwrapping its surface."""
    folder = tmp_path_factory.mktemp("pages")
    surface, denoised, unwrapped = folder / "vase.ply", folder / "denoise.html", folder / "unwrap.html"
    for command in (
        ["denoise", VASE, "-o", surface, "--uncertainty", "--report", denoised],
        ["unwrap", surface, "-o", folder / "unwrapped.obj", "--report", unwrapped],
    ):
        subprocess.run([program, *command, "--quiet"], check=True)
    return {"denoise": denoised, "unwrap": unwrapped}


def scene(page):
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', page.read_text(), re.S)
    return json.loads(found[1])


def test_a_page_is_one_file_that_asks_nobody_for_anything(pages):
    for page in pages.values():
        text = page.read_text()
        assert page.stat().st_size < 2_000_000
        assert not re.search(r"https?://|//[a-z]+\.|src=|href=|@import|fetch\(|XMLHttp|url\(", text)
        assert "{{" not in text.replace(re.search(r"<script>(.*)</script>", text, re.S)[1], "")


def test_the_arrays_of_a_page_belong_together(pages):
    for name, page in pages.items():
        what = scene(page)
        mesh = what["mesh"]
        vertices = len(base64.b64decode(mesh["xyz"])) // 6
        corners = np.frombuffer(base64.b64decode(mesh["triangles"]), "<u4")
        assert corners.max() < vertices and len(corners) % 3 == 0, name
        assert len(base64.b64decode(mesh["uv"]["of_corners"])) == 4 * len(corners)
        counts = {"vertices": vertices, "faces": len(corners) // 3, "uvs": len(corners) // 3}
        for show in what["shows"]:
            colors = len(base64.b64decode(show["rgb"])) // 3
            n = counts.get(show["of"])
            if show["of"] == "cloud":
                n = len(base64.b64decode(what["clouds"][show["cloud"]]["xyz"])) // 6
            assert colors in (0, n), (name, show["name"])


def test_a_page_says_in_words_and_numbers_what_was_found(pages):
    text = pages["denoise"].read_text()
    for words in ("outliers", "boundary", "Noise", "Time of the stages", "20,000 points denoised"):
        assert words in text
    assert "Stretch" in pages["unwrap"].read_text()


def drawn(page, start, folder):
    """The picture of a page that opens with these two shows, and what the browser complained about."""
    picture = folder / "page.png"
    done = subprocess.run(
        [
            CHROMIUM, "--headless", "--no-sandbox", "--no-first-run", "--disable-background-networking",
            "--disable-component-update", "--disable-sync", "--disable-quic", "--hide-scrollbars",
            f"--user-data-dir={folder / 'profile'}", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            "--enable-logging=stderr", "--window-size=1000,700", "--virtual-time-budget=8000",
            f"--screenshot={picture}", f"{page.as_uri()}#{start[0]},{start[1]}",
        ],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return np.asarray(Image.open(picture).convert("RGB")).astype(int), said


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_a_browser_draws_every_show_without_a_complaint(pages, tmp_path):
    for name, page in pages.items():
        shows = scene(page)["shows"]
        for left in range(0, len(shows), 2):
            right = min(left + 1, len(shows) - 1)
            picture, said = drawn(page, [left, right], tmp_path)
            assert not said, (name, said)
            # The canvas lies below the heading; its middle parts the shows.
            canvas = picture[120:480]
            for side, half in ((left, canvas[:, 40:490]), (right, canvas[:, 510:960])):
                not_white = (half < 240).any(axis=2).mean()
                assert not_white > 0.05, f"{name}: {shows[side]['name']} is not drawn"
