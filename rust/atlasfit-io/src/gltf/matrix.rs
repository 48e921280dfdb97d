//! The transforms of nodes.

use atlasfit::Vec3;
use serde_json::Value;

/// The upper three rows of a 4 by 4 matrix whose last row is 0 0 0 1.
pub(super) type Matrix = [[f64; 4]; 3];

pub(super) const IDENTITY: Matrix = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// A node's own transform.
pub(super) fn of_node(node: &Value) -> Matrix {
    let numbers = |key: &str, n: usize| -> Option<Vec<f64>> {
        let v: Vec<f64> = node[key].as_array()?.iter().filter_map(Value::as_f64).collect();
        (v.len() == n).then_some(v)
    };
    if let Some(m) = numbers("matrix", 16) {
        // Column after column.
        return [0, 1, 2].map(|r| [0, 1, 2, 3].map(|c| m[4 * c + r]));
    }
    let t = numbers("translation", 3).unwrap_or(vec![0.0; 3]);
    let s = numbers("scale", 3).unwrap_or(vec![1.0; 3]);
    let q = numbers("rotation", 4).unwrap_or(vec![0.0, 0.0, 0.0, 1.0]);
    let [x, y, z, w] = [q[0], q[1], q[2], q[3]];
    let r = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    [0, 1, 2].map(|i| [r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], t[i]])
}

/// The transform by `b`, then by `a`.
pub(super) fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|r| {
        [0, 1, 2, 3].map(|c| {
            let last = if c == 3 { a[r][3] } else { 0.0 };
            a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c] + last
        })
    })
}

/// How a transform moves normals.
pub(super) struct NormalTransform {
    /// The cofactors of the matrix: the inverse transposed, up to a factor.
    pub cofactor: [Vec3; 3],
    /// Whether the transform turns the surface inside out.
    pub mirrored: bool,
    /// Whether the transform does more than shift.
    pub moved: bool,
}

impl NormalTransform {
    pub fn of(world: &Matrix) -> Self {
        let [a, b, c] = [0, 1, 2].map(|r| Vec3([world[r][0], world[r][1], world[r][2]]));
        let cofactor = [b.cross(c), c.cross(a), a.cross(b)];
        let mirrored = a.dot(cofactor[0]) < 0.0;
        let moved = [a.0, b.0, c.0] != [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self { cofactor, mirrored, moved }
    }
}

/// How much a transform grows volumes; negative where it mirrors.
pub(super) fn volume(world: &Matrix) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|r| Vec3([world[r][0], world[r][1], world[r][2]]));
    a.dot(b.cross(c))
}
