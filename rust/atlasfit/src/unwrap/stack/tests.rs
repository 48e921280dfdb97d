//! Parts of one shape are found and lie on each other exactly; what only looks alike is not.

use crate::Run;
use crate::geometry::{Motion, TriMesh};
use crate::numeric::Rng;
use crate::numeric::vec3::Vec3;
use crate::unwrap::{Stack, UnwrapOptions, UvLayout, unwrap};

/// A bent strip without any symmetry, `n` by 3 squares.
fn strip(n: u32) -> TriMesh {
    let at = |i: u32, j: u32| {
        let (x, y) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
        [x, y * (1.0 + 0.3 * x), 0.2 * x * x + 0.1 * (5.0 * x * y).sin() + 0.3 * y * y]
    };
    let positions = (0..=n).flat_map(|i| (0..4).map(move |j| at(i, j))).collect();
    let quads = (0..n).flat_map(|i| (0..3).map(move |j| 4 * i + j));
    TriMesh::new(positions, quads.flat_map(|v| [[v, v + 4, v + 5], [v, v + 5, v + 1]]).collect())
}

/// Parts as one mesh. Faces and vertices of each are shuffled, and faces begin at another corner.
fn joined(parts: &[TriMesh]) -> TriMesh {
    let mut rng = Rng::new(4);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let n = part.positions.len();
        let mut order: Vec<usize> = (0..n).collect();
        (1..n).for_each(|i| order.swap(i, rng.below(i + 1)));
        let mut place = vec![0; n];
        order.iter().enumerate().for_each(|(i, &v)| place[v] = (positions.len() + i) as u32);
        positions.extend(order.iter().map(|&v| part.positions[v]));
        let mut own: Vec<[u32; 3]> = part.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
        (1..own.len()).for_each(|i| own.swap(i, rng.below(i + 1)));
        own.iter_mut().for_each(|t| t.rotate_left(rng.below(3)));
        triangles.extend(own);
    }
    TriMesh::new(positions, triangles)
}

fn moved(part: &TriMesh, turn: [f64; 3], shift: [f64; 3]) -> TriMesh {
    let motion = Motion::new(Vec3(turn), Vec3(shift));
    let positions = part.positions.iter().map(|&p| motion.of(Vec3(p)).0).collect();
    TriMesh::new(positions, part.triangles.clone())
}

fn mirrored(part: &TriMesh) -> TriMesh {
    let positions = part.positions.iter().map(|&[x, y, z]| [-1.0 - x, y, z]).collect();
    TriMesh::new(positions, part.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect())
}

fn stacked(mesh: &TriMesh, stack: Stack) -> UvLayout {
    let options = UnwrapOptions::default().with_stack(stack);
    Run::default().execute(|ctx| unwrap(mesh, &options, ctx)).expect("the mesh is sound")
}

/// The UV of each corner by the corner's place in the frame of the first part.
fn uv_at(
    mesh: &TriMesh,
    layout: &UvLayout,
    faces: std::ops::Range<usize>,
    back: impl Fn(Vec3) -> Vec3,
) -> Vec<([i64; 3], [f32; 2])> {
    let mut out: Vec<_> = faces
        .flat_map(|f| {
            [0, 1, 2].map(|k| (mesh.positions[mesh.triangles[f][k] as usize], layout.corner_uv[f][k]))
        })
        .map(|(p, uv)| (back(Vec3(p)).0.map(|x| (x * 1e6).round() as i64), uv))
        .collect();
    out.sort_by(|a, b| a.0.cmp(&b.0).then(a.1[0].total_cmp(&b.1[0])).then(a.1[1].total_cmp(&b.1[1])));
    out
}

#[test]
fn moved_and_turned_parts_get_the_same_uvs_at_the_same_places() {
    let part = strip(12);
    let n = part.triangles.len();
    let (turn, shift) = ([0.3, -2.0, 0.9], [5.0, 1.0, -2.0]);
    let mesh = joined(&[part.clone(), moved(&part, turn, shift), strip(11)]);
    let layout = stacked(&mesh, Stack::Identical);
    assert_eq!(layout.stacked_parts, 1);
    let motion = Motion::new(Vec3(turn), Vec3(shift));
    let back = Motion::new(Vec3(turn) * -1.0, Vec3::ZERO);
    let first = uv_at(&mesh, &layout, 0..n, |p| p);
    let second = uv_at(&mesh, &layout, n..2 * n, |p| back.of(p - motion.shift));
    assert_eq!(first, second, "corner on corner");
    assert!(layout.face_chart[..n].iter().all(|c| layout.face_chart[n..2 * n].contains(c)));
    let plain = stacked(&mesh, Stack::None);
    assert_eq!(plain.stacked_parts, 0);
    assert!(layout.charts < plain.charts && layout.texels_per_unit > plain.texels_per_unit);
}

#[test]
fn mirror_images_are_stacked_only_where_that_is_asked_for() {
    let part = strip(10);
    let n = part.triangles.len();
    let mesh = joined(&[part.clone(), mirrored(&part)]);
    assert_eq!(stacked(&mesh, Stack::Identical).stacked_parts, 0);
    let layout = stacked(&mesh, Stack::Mirrored);
    assert_eq!(layout.stacked_parts, 1);
    let first = uv_at(&mesh, &layout, 0..n, |p| p);
    let second = uv_at(&mesh, &layout, n..2 * n, |p| Vec3([-1.0 - p[0], p[1], p[2]]));
    assert_eq!(first, second);
}

#[test]
fn a_part_with_one_place_moved_or_bent_the_other_way_is_another_shape() {
    let part = strip(10);
    let mut dented = moved(&part, [0.0; 3], [0.0, 3.0, 0.0]);
    dented.positions[21][2] += 0.003;
    // Faces of the same lengths: only folded up instead of down.
    let fold = |z: f64| {
        let at = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.3, 0.0], [0.2, -0.7, z]];
        TriMesh::new(at.to_vec(), vec![[0, 1, 2], [0, 2, 3], [1, 0, 4]])
    };
    let folded = [fold(0.6), moved(&fold(-0.6), [0.0; 3], [5.0, 0.0, 0.0])];
    assert_eq!(stacked(&joined(&[part, dented]), Stack::Mirrored).stacked_parts, 0);
    assert_eq!(stacked(&joined(&folded), Stack::Identical).stacked_parts, 0);
}

#[test]
fn parts_of_two_groups_are_not_stacked_and_kept_uvs_refuse() {
    let part = strip(6);
    let n = part.triangles.len();
    let mut mesh = joined(&[part.clone(), moved(&part, [1.0, 0.0, 0.0], [3.0, 0.0, 0.0])]);
    let groups = (0..2 * n).map(|f| u32::from(f >= n)).collect();
    let options = UnwrapOptions::default().with_stack(Stack::Identical);
    let apart = options.clone().with_face_group(Some(groups));
    let layout =
        |options: &UnwrapOptions, mesh: &TriMesh| Run::default().execute(|ctx| unwrap(mesh, options, ctx));
    assert_eq!(layout(&options, &mesh).unwrap().stacked_parts, 1);
    assert_eq!(layout(&apart, &mesh).unwrap().stacked_parts, 0);
    mesh.corner_uv = Some(vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; 2 * n]);
    let error = layout(&options.with_keep_uvs(true), &mesh).unwrap_err().to_string();
    assert!(error.contains("stack"), "{error}");
}
