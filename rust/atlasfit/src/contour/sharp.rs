//! The vertex of a voxel through which a crease passes: dual contouring (Ju et al. 2002).
//!
//! In: places of the surface in a voxel, each with its normal. Out: the place nearest to all planes through
//! them: on the crease where two meet, at the corner where three do.

use super::constants::CONTOUR;
use crate::numeric::dense::eigen3;
use crate::numeric::vec3::Vec3;

/// A place of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tangent {
    pub(super) position: Vec3,
    /// Unit normal.
    pub(super) normal: Vec3,
}

/// The place nearest to all tangent planes. Along directions that they leave open it is as near to `middle`
/// as can be.
pub(super) fn meeting_place(tangents: &[Tangent], middle: Vec3) -> Vec3 {
    let (mut matrix, mut right) = ([0.0; 6], Vec3::ZERO);
    for t in tangents {
        let [x, y, z] = t.normal.0;
        for (m, product) in matrix.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *m += product;
        }
        right += t.normal * t.normal.dot(t.position - middle);
    }
    let (values, vectors) = eigen3(matrix);
    let least = CONTOUR.determined * values[2];
    let steps = values.into_iter().zip(vectors).filter(|(value, _)| *value > least);
    steps.fold(middle, |place, (value, along)| place + along * (along.dot(right) / value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    fn unit(rng: &mut Rng) -> Vec3 {
        Vec3::from_fn(|_| rng.normal()).normalized()
    }

    /// Places on planes through `corner`.
    fn around(corner: Vec3, normals: &[Vec3], rng: &mut Rng) -> Vec<Tangent> {
        let on = |&normal: &Vec3| {
            let off = Vec3::from_fn(|_| rng.normal());
            Tangent { position: corner + off - normal * off.dot(normal), normal }
        };
        normals.iter().map(on).collect()
    }

    #[test]
    fn three_planes_meet_in_their_corner() {
        let mut rng = Rng::new(1);
        let axes = unit(&mut rng).tangents();
        let normals = [axes.0, axes.1, axes.0.cross(axes.1)];
        let corner = Vec3([0.3, -2.0, 5.0]);
        let place = meeting_place(&around(corner, &normals, &mut rng), Vec3::ZERO);
        assert!((place - corner).norm() < 1e-12, "{place:?}");
    }

    #[test]
    fn two_planes_meet_on_their_line_nearest_to_the_middle_and_one_plane_under_it() {
        let mut rng = Rng::new(2);
        let (a, b) = unit(&mut rng).tangents();
        let along = a.cross(b);
        let corner = Vec3([0.3, -2.0, 5.0]);
        let middle = corner + a * 0.2 - b * 0.4 + along * 0.7;
        let place = meeting_place(&around(corner, &[a, b, a], &mut rng), middle);
        assert!((place - (corner + along * 0.7)).norm() < 1e-12, "{place:?}");
        let place = meeting_place(&around(corner, &[a, a], &mut rng), middle);
        assert!((place - (middle - a * 0.2)).norm() < 1e-12, "{place:?}");
    }
}
