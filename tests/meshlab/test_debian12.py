"""The plugin in Debian 12's MeshLab 2020.09, by meshlabserver under Xvfb."""
import os
import re
import subprocess

import numpy as np
import pytest

BIN = os.environ.get("ATLASFIT_MESHLAB")
pytestmark = pytest.mark.skipif(
    not BIN, reason="ATLASFIT_MESHLAB is not set: run tests/meshlab/run with MeshLab 2020.09 installed"
)

# meshlabserver wants every parameter that the dialog has, and no other.
FIT = {
    "onlySelected": ("Bool", "false"), "strength": ("Float", 1), "noise": ("AbsPerc", 0),
    "uncertainty": ("Bool", "false"),
}
PARAMETERS = {
    "Surface Reconstruction: Atlas": {
        "visibleLayers": ("Bool", "false"), **FIT, "detail": ("Float", 1), "fillHoles": ("AbsPerc", 0),
        "largest": ("Bool", "false"), "faces": ("Int", 0),
        "watertight": ("Bool", "false"), "uv": ("Bool", "true"), "textureSize": ("Int", 1024),
        "texture": ("Enum", 0),
    },
    "Denoise: Atlas": {**FIT, "selectOutliers": ("Bool", "false")},
    "Parametrization: Atlas": {
        "preset": ("Enum", 1), "maxStretch": ("Float", 0), "maxCharts": ("Int", 0),
        "keepSeams": ("Bool", "false"), "hardEdges": ("Float", 180), "textureSize": ("Int", 1024),
        "texture": ("Enum", 0),
    },
    "Parametrization: Pack Charts": {"textureSize": ("Int", 1024), "texture": ("Enum", 0)},
    "UV Distortion": {"colorize": ("Bool", "true")},
}


def serve(folder, scan, out, *filters, mask="vn vc wt"):
    """Runs filters, each (name, changed parameters), and gives (exit code, everything that was printed)."""
    text = "<!DOCTYPE FilterScript>\n<FilterScript>\n"
    for name, changed in filters:
        parameters = {
            k: (kind, changed.get(k, value)) for k, (kind, value) in PARAMETERS[name].items()
        }
        text += f' <filter name="{name}">\n'
        for k, (kind, value) in parameters.items():
            choices = (
                'enum_cardinality="3" enum_val0="0" enum_val1="1" enum_val2="2"' if kind == "Enum" else ""
            )
            if kind == "AbsPerc":
                choices = 'min="0" max="1"'
            text += f'  <Param type="Rich{kind}" value="{value}" name="{k}" {choices}/>\n'
        text += " </filter>\n"
    (folder / "script.mlx").write_text(text + "</FilterScript>\n")
    (folder / "xdg").mkdir(mode=0o700, exist_ok=True)
    done = subprocess.run(
        [
            "xvfb-run", "-a", "-s", "-screen 0 1280x960x24 +extension GLX", f"{BIN}/meshlabserver", "-l",
            folder / "log.txt", "-i", scan, "-o", out, "-m", *mask.split(), "-s", "script.mlx",
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "XDG_RUNTIME_DIR": str(folder / "xdg")},
    )
    log = (folder / "log.txt").read_text(errors="replace") if (folder / "log.txt").exists() else ""
    return done.returncode, done.stdout + done.stderr + log


def vertices(path):
    """Positions and faces' vertices of an OBJ file."""
    text = path.read_text()
    v = np.array(re.findall(r"^v (\S+) (\S+) (\S+)", text, re.M), float)
    return v, np.array(
        [[int(c.split("/")[0]) for c in f] for f in re.findall(r"^f (\S+) (\S+) (\S+)", text, re.M)]
    ) - 1


def test_reconstruction_is_what_the_program_makes(folder, scan, atlasfit):
    code, said = serve(folder, scan, "old.obj", ("Surface Reconstruction: Atlas", {}))
    assert code == 0, said
    atlasfit("denoise", scan, "-o", folder / "cli.obj")
    (ours, faces), (theirs, expected) = vertices(folder / "old.obj"), vertices(folder / "cli.obj")
    assert np.array_equal(faces, expected) and np.allclose(ours, theirs, atol=1e-5)
    text = (folder / "old.obj").read_text()
    uv = np.array(re.findall(r"^vt (\S+) (\S+)", text, re.M), float)
    assert len(uv) and uv.min() >= 0 and uv.max() <= 1
    page = re.search(r"map_Kd (\S+)", (folder / "old.obj.mtl").read_text()).group(1)
    assert (folder / page).stat().st_size > 1000 and page.startswith("scan_atlas")


def test_unwrapping_and_measuring(folder, scan, atlasfit):
    atlasfit("denoise", scan, "--no-uv", "-o", folder / "plain.ply")
    code, said = serve(
        folder, folder / "plain.ply", "unwrapped.obj",
        ("Parametrization: Atlas", {"texture": 1}), ("Parametrization: Pack Charts", {}),
        ("UV Distortion", {}),
    )
    assert code == 0, said
    uv = atlasfit("measure", folder / "unwrapped.obj")["uv"]
    assert uv["flips"] == 0 and uv["stretch_p95"] < 1.2


def test_denoising(folder, scan, atlasfit):
    code, said = serve(
        folder, scan, "points.xyz", ("Denoise: Atlas", {}), mask="vn"
    )
    assert code == 0, said
    atlasfit("denoise", scan, "--points", folder / "points_cli.xyz")
    read = lambda name: np.array(
        [line.split()[:3] for line in (folder / name).read_text().splitlines() if line[:1] not in "#"], float
    )
    assert np.allclose(read("points.xyz"), read("points_cli.xyz"), atol=1e-5)


def test_a_failure_is_an_exit_code_and_our_text(folder, scan):
    code, said = serve(
        folder, scan, "none.obj", ("Surface Reconstruction: Atlas", {"detail": 99})
    )
    assert code != 0 and "atlasfit: " in said and "detail" in said
    assert not (folder / "none.obj").exists()
