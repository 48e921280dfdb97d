"""Pictures of results by libraries that a user may have: matplotlib, pyvista, trimesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def plot(
    corner_uv: NDArray[np.float32], charts: NDArray[np.uint32], pages: NDArray[np.uint32], ax: Any
) -> Any:
    """Draws UVs, charts in colours of their own, pages side by side."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    if ax is None:
        ax = plt.subplots(figsize=(6, 6))[1]
    shift = np.zeros((len(pages), 1, 2))
    shift[:, 0, 0] = pages
    # Charts beside each other have numbers beside each other: these steps give them unlike colours.
    colors = plt.get_cmap("hsv")((charts * 0.618034) % 1.0)
    colors[:, :3] = 0.5 + 0.5 * colors[:, :3]
    ax.add_collection(
        PolyCollection(list(corner_uv + shift), facecolors=colors, edgecolors=(0, 0, 0, 0.25), linewidths=0.2)
    )
    count = int(pages.max(initial=0)) + 1
    for page in range(count):
        ax.plot([page, page + 1, page + 1, page, page], [0, 0, 1, 1, 0], color="black", linewidth=0.8)
    ax.set(aspect="equal", xlim=(-0.02, count + 0.02), ylim=(-0.02, 1.02), xlabel="u", ylabel="v")
    return ax


def show(
    vertices: NDArray[np.float64], triangles: NDArray[np.uint32], colors: NDArray[np.float32] | None
) -> None:
    """Opens a view of a mesh."""
    try:
        import pyvista  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        pass
    else:
        faces = np.column_stack([np.full(len(triangles), 3, np.int64), triangles])
        mesh = pyvista.PolyData(vertices, faces.ravel())
        if colors is None:
            mesh.plot(smooth_shading=True)
        else:
            mesh.plot(scalars=colors[:, :3], rgb=True, smooth_shading=True)
        return
    try:
        import trimesh
    except ImportError:
        raise ImportError("show() needs pyvista or trimesh: pip install pyvista") from None
    trimesh.Trimesh(vertices, triangles, vertex_colors=colors, process=False).show()
