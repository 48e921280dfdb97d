"""Where rays from one point first meet a triangle mesh. Needs numpy only.

Directions that lie near each other are a pinhole camera's picture; others are the six faces of a cube about
the point. In a picture rays are points and triangles are triangles: both are sorted into the cells of a grid,
and what shares a cell is tested exactly (Moeller and Trumbore 1997).
"""
import numpy as np

# Pairs of a ray and a triangle that are tested at a time.
PAIRS = 1 << 17
# Rays in a cell of the grid, on average.
RAYS_PER_CELL = 2


def cast(V, F, origin, directions):
    """For each direction the first triangle in it (-1 for none), and how often the direction fits between
    (infinite for none).
    """
    distance, face = np.full(len(directions), np.inf), np.full(len(directions), -1)
    for camera, of in pictures(directions):
        d = directions[of] @ camera.T
        depth, face[of] = first(((V - origin) @ camera.T)[F], d[:, :2] / d[:, 2:])
        distance[of] = depth / d[:, 2]
    return distance, face


def pictures(directions):
    """Cameras (rows: right, up, forward), and the directions that lie in the picture of each."""
    if len(directions) == 0:
        return []
    unit = directions / np.linalg.norm(directions, axis=1)[:, None]
    middle = unit.mean(0) / max(np.linalg.norm(unit.mean(0)), 1e-300)
    if (unit @ middle).min() > 0.5:
        rest, _ = np.linalg.qr(np.c_[middle, np.eye(3)])
        return [(np.stack([rest[:, 1], rest[:, 2], middle]), np.arange(len(unit)))]
    axis = np.abs(unit).argmax(1)
    forward = unit[np.arange(len(unit)), axis] > 0
    turned = [
        (k, sign, np.where((axis == k) & (forward == (sign > 0)))[0]) for k in range(3) for sign in (1, -1)
    ]
    return [(np.roll(np.eye(3), k + 1, 1) * [[1], [1], [sign]], of) for k, sign, of in turned if len(of)]


def first(corners, rays):
    """Depth and number of the first of the triangles (t, 3, 3) on each ray (x, y, 1), in a camera that looks
    along z.
    """
    low, high = rays.min(0) - 1e-9, rays.max(0) + 1e-9
    z = corners[:, :, 2]
    # Half-spaces through the camera's centre: a triangle beyond one of them is not in the picture.
    beyond = (
        [z <= 0]
        + [corners[:, :, a] < low[a] * z for a in (0, 1)]
        + [corners[:, :, a] > high[a] * z for a in (0, 1)]
    )
    of = np.where(~np.any([b.all(1) for b in beyond], 0))[0]
    if len(of) == 0:
        return np.full(len(rays), np.inf), np.full(len(rays), -1)
    side = max(1, int(np.sqrt(len(rays) / RAYS_PER_CELL)))
    cell = lambda xy: np.clip((xy - low) / (high - low) * side, 0, side - 1).astype(int)
    of_ray = cell(rays) @ [side, 1]
    order = np.argsort(of_ray, kind="stable")
    start = np.searchsorted(of_ray[order], np.arange(side * side + 1))
    C = corners[of]
    before = (C[:, :, 2] > 1e-12).all(1)
    xy = C[:, :, :2] / np.where(before[:, None], C[:, :, 2], 1)[:, :, None]
    # A triangle that reaches behind the camera may be anywhere in the picture.
    left, right = (
        np.where(before[:, None], xy.min(1) - 1e-9, low),
        np.where(before[:, None], xy.max(1) + 1e-9, high),
    )
    first_cell = cell(left)
    size = cell(right) - first_cell + 1
    rays_of, triangles, depths = [], [], []
    for t, cells in cells_of(first_cell, size, side):
        count = start[cells + 1] - start[cells]
        r = order[np.repeat(start[cells], count) + steps(count)]
        t = np.repeat(t, count)
        near = ((rays[r] >= left[t]) & (rays[r] <= right[t])).all(1)
        r, t = r[near], t[near]
        depth = meet(C[t], rays[r])
        good = np.isfinite(depth)
        rays_of.append(r[good]), triangles.append(t[good]), depths.append(depth[good])
    r, t, d = (np.concatenate(x) for x in (rays_of, triangles, depths))
    nearest = np.lexsort((d, r))
    seen, at = np.unique(r[nearest], return_index=True)
    depth, face = np.full(len(rays), np.inf), np.full(len(rays), -1)
    depth[seen], face[seen] = d[nearest[at]], of[t[nearest[at]]]
    return depth, face


def steps(count):
    """0, 1, ... n - 1 for each n of the counts, one after the other."""
    return np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)


def cells_of(first_cell, size, side):
    """Pairs of a triangle and a cell of its bounding box, some triangles at a time."""
    cells = size.prod(1)
    chunk = np.cumsum(cells * RAYS_PER_CELL) // PAIRS
    for c in np.unique(chunk):
        which = np.where(chunk == c)[0]
        t, k = np.repeat(which, cells[which]), steps(cells[which])
        yield t, (first_cell[t, 0] + k // size[t, 1]) * side + first_cell[t, 1] + k % size[t, 1]


def meet(C, rays):
    """Depth at which each ray (x, y, 1) meets its triangle; infinite where it does not."""
    d = np.c_[rays, np.ones(len(rays))]
    one, two = C[:, 1] - C[:, 0], C[:, 2] - C[:, 0]
    dot = lambda a, b: np.einsum("ij,ij->i", a, b)
    across = np.cross(d, two)
    volume = dot(one, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = dot(-C[:, 0], across) / volume
        other = np.cross(-C[:, 0], one)
        v, depth = dot(d, other) / volume, dot(two, other) / volume
        # A little beyond the edges, so that no ray slips through between two triangles.
        inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (depth > 1e-9)
    return np.where(inside, depth, np.inf)
