"""Old textures are drawn anew for new UVs, at no lower density."""

import atlasfit
import numpy as np
import pytest
from made import torus, triangles


def looked_up(image, uv):
    """Texels of an image at UVs inside it, the nearest one."""
    height, width = image.shape[:2]
    at = np.clip((uv * [width, height]).astype(int), 0, [width - 1, height - 1])
    return image[height - 1 - at[:, 1], at[:, 0]].astype(int)


@pytest.fixture(scope="module")
def textured():
    """A torus whose old UVs are angles, and a smooth image of them."""
    vertices, quads = torus(48, 24)
    faces, of = triangles(quads)
    grid = np.stack(np.divmod(np.arange(48 * 24), 24), 1)
    corner = grid[faces] / [48, 24]
    # A face across the cut goes on beyond 1: images repeat.
    corner += np.where(corner.max(axis=1, keepdims=True) - corner > 0.5, 1.0, 0.0)
    y, x = np.mgrid[0:256, 0:512] / [[[256]], [[512]]]
    image = np.stack([x, y, 0.5 + 0.5 * np.sin(2 * np.pi * x) * np.sin(2 * np.pi * y)], 2)
    image = np.sin(np.pi * image) ** 2  # the same at both edges
    return vertices, faces, corner.astype(np.float32), np.round(255 * image).astype(np.uint8)


def test_colors_of_a_textured_mesh_are_the_same_after_unwrapping(textured):
    vertices, faces, old, image = textured
    page = atlasfit.texture_page(vertices, faces, [image], old)
    uv = atlasfit.unwrap(vertices, faces, page_size=page.side, padding=page.padding)
    size = page.side * (2 if uv.info.texels_per_unit < page.density else 1)
    new = atlasfit.bake_textures(vertices, faces, uv.corner_uv, [image], old, page_size=size)
    rng = np.random.default_rng(0)
    face = rng.integers(len(faces), size=10_000)
    weight = rng.dirichlet([1, 1, 1], 10_000)[:, :, None]
    before = looked_up(image, (old[face] * weight).sum(axis=1) % 1)
    after = looked_up(new, (uv.corner_uv[face] * weight).sum(axis=1))[:, :3]
    assert np.abs(before - after).mean() < 4, "looked up without filtering"


def test_each_face_has_its_image(textured):
    vertices, faces, old, _ = textured
    red, green = np.uint8([[[255, 0, 0]]]), np.uint8([[[0, 255, 0, 255]]])
    of = np.arange(len(faces)) % 2
    uv = atlasfit.unwrap(vertices, faces, face_groups=of, padding=4)
    new = atlasfit.bake_textures(
        vertices, faces, uv.corner_uv, [red, green], old, face_images=of, page_size=1024
    )
    middle = looked_up(new, uv.corner_uv.mean(axis=1))
    assert (middle[of == 0] == [255, 0, 0, 255]).mean() > 0.99 and (
        middle[of == 1] == [0, 255, 0, 255]
    ).mean() > 0.99
    only = np.where(of == 0, 0, atlasfit.NO_IMAGE)
    assert atlasfit.texture_page(vertices, faces, [red], old, face_images=only).density > 0


@pytest.mark.parametrize(
    "images, uv, text",
    [
        ([np.zeros((2, 2), np.uint8)], None, "an image is uint8"),
        ([np.zeros((2, 2, 3))], None, "an image is float64"),
        ([np.zeros((2, 2, 3), np.uint8)], np.zeros((1, 3, 2)), "corner_uv has shape"),
    ],
)
def test_what_is_no_texture_is_refused(textured, images, uv, text):
    vertices, faces, old, _ = textured
    with pytest.raises(ValueError, match=text):
        atlasfit.bake_textures(vertices, faces, old, images, old if uv is None else uv)
    with pytest.raises(atlasfit.Error, match="no old texture"):
        atlasfit.bake_textures(vertices, faces, old, [], old)
