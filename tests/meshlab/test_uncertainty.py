"""How sure a result is, as the vertices' quality: what the program says, and only where it is asked for."""
import numpy as np
import pytest

from test_pymeshlab import DENOISE, RECONSTRUCT, opened

pytestmark = pytest.mark.usefixtures("plugin")
TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1"}


def column(path, name):
    """A column of the vertices of a binary PLY file."""
    raw = path.read_bytes()
    header = raw[: raw.index(b"end_header\n") + len(b"end_header\n")]
    lines = header.decode().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("element vertex"))
    fields = []
    for line in lines[start + 1 :]:
        if not line.startswith("property"):
            break
        fields.append((line.split()[2], TYPES[line.split()[1]]))
    count = int(lines[start].split()[2])
    return np.frombuffer(raw, fields, count, len(header))[name]


@pytest.fixture(scope="module")
def said(scan, folder, atlasfit):
    """What the program writes and says of the scan."""
    points, surface = folder / "sure_points.ply", folder / "sure_surface.ply"
    values = atlasfit("denoise", scan, "--points", points, "-o", surface, "--uncertainty")
    return points, surface, values


def test_the_points_quality_is_the_programs_uncertainty(scan, said):
    plain, sure = opened(scan), opened(scan)
    without = plain.apply_filter(DENOISE)
    values = sure.apply_filter(DENOISE, uncertainty=True)
    m = sure.current_mesh()
    assert np.array_equal(m.vertex_matrix(), plain.current_mesh().vertex_matrix())
    assert np.array_equal(m.vertex_scalar_array().astype(np.float32), column(said[0], "uncertainty"))
    assert values["uncertainty_factor"] == pytest.approx(said[2]["uncertainty_factor"], rel=1e-6)
    assert "uncertainty_factor" not in without
    assert values["displacement_rms"] == without["displacement_rms"] > 0
    sure.apply_filter("compute_color_from_scalar_per_vertex")
    assert len(np.unique(m.vertex_color_matrix(), axis=0)) > 10


def test_vertices_that_are_not_moved_keep_their_noise(scan, said):
    ms = opened(scan)
    ms.apply_filter("compute_selection_by_condition_per_vertex", condselect="x < 0")
    chosen = ms.current_mesh().vertex_selection_array().copy()
    ms.apply_filter(DENOISE, uncertainty=True, onlyselected=True)
    quality = ms.current_mesh().vertex_scalar_array().astype(np.float32)
    sd, noise = column(said[0], "uncertainty"), column(said[0], "noise")
    stray = noise == 0
    assert stray.sum() < 20 < chosen.sum() < len(chosen)
    assert np.array_equal(quality, np.where(chosen | stray, sd, noise))


def test_the_surfaces_quality_is_the_programs_uncertainty(scan, said):
    plain, sure = opened(scan), opened(scan)
    plain.apply_filter(RECONSTRUCT)
    values = sure.apply_filter(RECONSTRUCT, uncertainty=True)
    ours, other = sure.current_mesh(), plain.current_mesh()
    assert np.array_equal(ours.vertex_matrix(), other.vertex_matrix())
    assert np.array_equal(ours.face_matrix(), other.face_matrix())
    assert np.array_equal(ours.wedge_tex_coord_matrix(), other.wedge_tex_coord_matrix())
    assert np.array_equal(ours.vertex_scalar_array().astype(np.float32), column(said[1], "uncertainty"))
    assert values["uncertainty_factor"] >= 1 and not other.has_vertex_scalar()


def test_a_solid_and_a_scan_with_quality_get_the_uncertainty_all_the_same(scan):
    ms = opened(scan)
    ms.apply_filter("compute_scalar_by_function_per_vertex", q="1000")
    ms.apply_filter(RECONSTRUCT, uncertainty=True, watertight=True, uv=False)
    quality = ms.current_mesh().vertex_scalar_array()
    assert quality.min() > 0 and np.median(quality) < 1
