"""What people expect of a Python package: types come back, NumPy's numbers go in, colours of any kind,
results
that pickle, copy and print, bars, examples that run.
"""

import copy
import doctest
import inspect
import io
import os
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import atlasfit
import numpy as np
import pytest
from atlasfit import _atlas, _bake, _call, _denoise, _files, _measure, _simplify, _unwrap
from made import torus, triangles
from pages import code


@pytest.fixture(scope="module")
def mesh():
    vertices, quads = torus()
    return vertices, triangles(quads)[0]


@pytest.fixture(scope="module")
def denoised(sphere):
    return atlasfit.denoise(sphere, attributes={"label": np.arange(len(sphere))})


@pytest.mark.parametrize(
    "kind",
    ["bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"],
)
def test_attributes_come_back_in_the_type_that_they_were_given_in(sphere, kind):
    given = (sphere[:, 2] > 0).astype(kind)
    wide = np.stack([given, given], 1)
    out = atlasfit.denoise(sphere, attributes={"a": given, "wide": wide}, uv=False).surface.attributes
    assert out["a"].dtype == out["wide"].dtype == np.dtype(kind)
    assert out["wide"].shape == (len(out["a"]), 2) and (out["wide"][:, 0] == out["a"]).all()
    if np.dtype(kind).kind != "f":
        assert set(out["a"]) == {0, 1}, "labels are copied"


def test_numbers_of_numpy_are_options(sphere, mesh):
    one, two = np.int64(1), np.int32(2)
    out = atlasfit.denoise(
        sphere, noise=np.float32(0.01), charts=np.int64(0), uv=np.bool_(False), threads=one
    )
    assert out.surface.corner_uv is None and out.report.noise == pytest.approx(0.01)
    uv = atlasfit.unwrap(
        *mesh, page_size=np.int64(256), padding=two, seed=np.uint8(3), max_stretch=np.float64(1.2)
    )
    assert uv.info.width == 256 and uv.info.padding == 2
    atlasfit.measure_uv(*mesh, uv.corner_uv, page_size=(np.int16(2), np.int16(1)))
    assert len(out.atlas.evaluate(np.int64(0), [[0.0, 0.0]]).positions) == 1


def test_colors_of_8_bits_are_known_whatever_their_type(mesh):
    uv = atlasfit.unwrap(*mesh)
    plain = np.uint8([[250, 128, 3]] * len(mesh[0]))
    baked = lambda colors: atlasfit.bake(*mesh, uv.corner_uv, colors, page_size=64)
    expected = baked(plain)
    assert (expected[32, 32] == [250, 128, 3, 255]).all()
    for kind in (np.int64, np.int32, np.uint16, np.float32, np.float64):
        assert (baked(plain.astype(kind)) == expected).all(), kind
    assert (baked(plain / 255.0) == expected).all()
    assert (baked(plain.tolist()) == expected).all()


def test_colors_that_cannot_be_what_they_should_be_are_refused(sphere):
    for colors, text in (
        (np.full((len(sphere), 3), 127.5), "go up to 127.5. Give 0 to 1"),
        (np.full((len(sphere), 3), 65535, np.uint16), "Divide colors of 16 bits by 65535"),
        (np.full((len(sphere), 3), -1), "from -1 to -1. Give 0 to 255"),
    ):
        with pytest.raises(ValueError, match=text):
            atlasfit.denoise(sphere, colors=colors)
    bright = np.full((len(sphere), 3), 1.5)
    assert atlasfit.denoise(sphere, colors=bright, uv=False).surface.colors is not None, "light above white"


def same(a, b):
    """Whether two results say the same, arrays and all."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, atlasfit.Atlas):
        return a.to_bytes() == b.to_bytes()
    if hasattr(a, "__dataclass_fields__"):
        return all(
            same(getattr(a, k), getattr(b, k)) for k in a.__dataclass_fields__ if not k.startswith("_")
        )
    return a == b


def test_results_are_pickled_and_copied(denoised, mesh):
    uv = atlasfit.unwrap(*mesh)
    results = [
        denoised,
        uv,
        denoised.atlas.project(denoised.points[:5]),
        denoised.atlas.evaluate(0, [[0.0, 0.0]]),
        atlasfit.measure_uv(*mesh, uv.corner_uv),
        atlasfit.measure_topology(*mesh),
        atlasfit.measure_points(mesh[0], *mesh),
    ]
    for result in results:
        for again in (pickle.loads(pickle.dumps(result)), copy.copy(result), copy.deepcopy(result)):
            assert same(result, again), type(result)
    again = pickle.loads(pickle.dumps(uv))
    assert all(np.array_equal(a, b) for a, b in zip(uv.split(), again.split()))
    assert copy.deepcopy(again).split()[0].shape == (len(mesh[1]), 3)


def test_errors_are_pickled_as_pools_of_processes_do():
    with pytest.raises(atlasfit.TimedOut) as caught:
        atlasfit.denoise(np.random.default_rng(0).normal(size=(5000, 3)), time_limit=1e-6)
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is atlasfit.TimedOut and str(again) == str(caught.value)
    assert (again.status, again.status_name) == (caught.value.status, caught.value.status_name)


def test_results_print_what_they_are_and_how_many_in_a_line(denoised, mesh):
    uv = atlasfit.unwrap(*mesh)
    n = len(denoised.points)
    assert repr(denoised).startswith(f"Denoised({n:,} points, Surface(")
    assert f"{len(denoised.surface.triangles):,} triangles, UVs, label)" in repr(denoised.surface)
    assert repr(denoised.report).startswith(f"Report({n:,} points, ") and "noise 0.0" in repr(denoised.report)
    assert repr(uv).startswith(f"Uv(UvInfo({uv.info.charts} charts, {len(mesh[1]):,} triangles, 1024 x 1024")
    for result in (
        denoised,
        uv,
        denoised.atlas.project(denoised.points),
        denoised.atlas.evaluate(0, [[0.0, 0.0]]),
        atlasfit.measure_uv(*mesh, uv.corner_uv),
        atlasfit.measure_points(mesh[0], *mesh),
    ):
        assert len(repr(result)) < 500 and "\n" not in repr(result) and "array" not in repr(result)


class FakeBar:
    """What tqdm has."""

    def __init__(self, total):
        self.n, self.total, self.seen, self.stages = 0, total, [], []

    def update(self, n):
        self.n += n
        self.seen.append(self.n)

    def set_description_str(self, stage, refresh):
        self.stages.append(stage)


@pytest.mark.parametrize("total", [100, 1, 7.5])
def test_a_bar_of_tqdm_is_filled_once_and_never_falls(sphere, total):
    bar = FakeBar(total)
    atlasfit.denoise(sphere, progress=bar)
    assert bar.seen == sorted(bar.seen) and bar.seen[0] < 0.5 * total and bar.seen[-1] == pytest.approx(total)
    assert "fitting charts" in bar.stages


def test_a_bar_of_our_own_is_shown_where_there_is_no_tqdm(sphere, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    shown = io.StringIO()
    shown.isatty = lambda: True
    monkeypatch.setattr(sys, "stderr", shown)
    atlasfit.denoise(sphere, progress=True)
    lines = [line.strip() for line in shown.getvalue().split("\r") if line.strip()]
    shares = [int(line.split(":")[1].split("%")[0]) for line in lines]
    assert shares == sorted(shares) and shares[-1] == 100 and any("s left" in line for line in lines)
    shown.isatty = lambda: False
    shown.truncate(0)
    atlasfit.denoise(sphere, progress=True)
    assert not shown.getvalue().strip("\0"), "nothing where it goes to a file"


def test_every_function_has_an_example_and_all_of_them_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    finder = doctest.DocTestFinder(exclude_empty=True)
    names = {"atlasfit": atlasfit, "np": np}
    with_example = set()
    for module in (_atlas, _bake, _call, _denoise, _files, _measure, _simplify, _unwrap):
        for test in finder.find(module, globs=dict(names)):
            said = []
            result = doctest.DocTestRunner().run(test, out=said.append)
            assert result.failed == 0, "".join(said)
            if test.examples:
                with_example.add(test.name.split(".")[-1])
    functions = {n for n in atlasfit.__all__ if inspect.isfunction(getattr(atlasfit, n))}
    assert functions <= with_example, functions - with_example


def test_the_page_for_python_works_to_the_letter(tmp_path, monkeypatch):
    folder = Path(__file__).resolve().parents[2]
    (tmp_path / "examples").mkdir()
    vase = atlasfit.load(folder / "examples" / "vase.ply")
    atlasfit.save(tmp_path / "examples" / "vase.ply", vase.points[::5], colors=vase.colors[::5])
    monkeypatch.chdir(tmp_path)
    exec(compile(code("python.md"), "docs/python.md", "exec"), {})
    made = {path.name for path in tmp_path.iterdir()}
    assert made == {"examples", "clean.ply", "sure.ply", "vase.glb", "unwrapped.obj", "textured.glb"}
    assert atlasfit.load("textured.glb").texture is not None


def test_charts_are_plotted(mesh):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    uv = atlasfit.unwrap(*mesh)
    axes = uv.plot()
    (drawn,) = axes.collections
    assert len(drawn.get_paths()) == len(mesh[1]) and len(np.unique(drawn.get_facecolors(), axis=0)) > 1
    assert uv.plot(axes) is axes


def test_an_editable_install_imports_the_package_where_it_lies(tmp_path):
    folder = Path(__file__).resolve().parents[1]
    script = (
        "import package, sys, pathlib; package.cargo_library = lambda: pathlib.Path(sys.argv[2]);"
        "package.LIBRARY = 'test-' + package.LIBRARY; print(package.build_editable(sys.argv[1]))"
    )
    library = os.environ["ATLASFIT_LIBRARY"]
    made = subprocess.run(
        [sys.executable, "-c", script, tmp_path, library],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    for left in (folder / "atlasfit").glob("test-*"):
        left.unlink()
    site = tmp_path / "site"
    zipfile.ZipFile(tmp_path / made).extractall(site)
    where = "import site, sys; site.addsitedir(sys.argv[1]); import atlasfit; print(atlasfit.__file__)"
    found = subprocess.run(
        [sys.executable, "-c", where, site], check=True, capture_output=True, text=True, cwd=tmp_path
    ).stdout.strip()
    assert Path(found) == folder / "atlasfit" / "__init__.py"
