//! The body-centred cubic lattice and its tetrahedra.
//!
//! In: the numbers of a cube. Out: the vertices of the twelve tetrahedra that belong to it, and which cubes
//! the tetrahedra next to them belong to. Vertices are numbered in half sides of the cubes: all three numbers
//! even, or all odd. All tetrahedra are congruent; each has one axis-parallel edge between two even vertices,
//! and belongs to the lower of these.

use super::constants::SOLID;
use crate::numeric::vec3::Vec3;

/// Where a vertex lies, in half sides of the lattice's cubes.
pub(super) type Site = [i32; 3];

/// Bits of one number in a key.
const BITS: u32 = 21;

/// The site as a number: sites in the order of their keys lie near each other.
pub(super) fn key(site: Site) -> u64 {
    site.iter().fold(0, |key, &i| key << BITS | (i + SOLID.range) as u64)
}

/// The site of a key.
pub(super) fn site(key: u64) -> Site {
    [2, 1, 0].map(|k| (key >> (k * BITS) & ((1 << BITS) - 1)) as i32 - SOLID.range)
}

pub(super) fn plus(a: Site, b: Site) -> Site {
    [0, 1, 2].map(|k| a[k] + b[k])
}

/// One tetrahedron of a cube.
#[derive(Debug, Clone)]
pub(super) struct Tet {
    /// Its corners as entries of [`Lattice::corners`], positively oriented.
    pub(super) corners: [usize; 4],
    /// For each corner, the cube of the tetrahedron across the face opposite to it, from this one.
    pub(super) across: [Site; 4],
}

/// The tetrahedra of one cube; those of all others are the same, moved.
#[derive(Debug, Clone)]
pub(super) struct Lattice {
    /// The sites that they use.
    pub(super) corners: Vec<Site>,
    /// The twelve tetrahedra.
    pub(super) tets: Vec<Tet>,
}

impl Lattice {
    pub(super) fn new() -> Self {
        let mut corners: Vec<Site> = tets_of([0; 3]).into_iter().flatten().collect();
        corners.sort_unstable();
        corners.dedup();
        let around: Vec<Site> = (0..27).map(|i| [i / 9, i / 3 % 3, i % 3].map(|x| 2 * (x - 1))).collect();
        let tets = tets_of([0; 3])
            .into_iter()
            .map(|tet| Tet {
                corners: tet.map(|c| corners.binary_search(&c).unwrap_or(0)),
                across: [0, 1, 2, 3].map(|k| {
                    let meets = |other: &[Site; 4]| {
                        !other.contains(&tet[k]) && (0..4).all(|j| j == k || other.contains(&tet[j]))
                    };
                    let found = around.iter().find(|&&cube| tets_of(cube).iter().any(meets));
                    found.copied().unwrap_or([0; 3])
                }),
            })
            .collect();
        Self { corners, tets }
    }
}

/// The tetrahedra that belong to the even site `at`: about each axis-parallel edge that goes up from it.
fn tets_of(at: Site) -> Vec<[Site; 4]> {
    let mut tets = Vec::with_capacity(12);
    for axis in 0..3 {
        let (l, m) = ((axis + 1) % 3, (axis + 2) % 3);
        let up = |by: i32| {
            let mut to = at;
            to[axis] += by;
            to
        };
        let odd = |(i, j): (i32, i32)| {
            let mut to = up(1);
            to[l] += i;
            to[m] += j;
            to
        };
        let ring = [(1, 1), (-1, 1), (-1, -1), (1, -1)].map(odd);
        for k in 0..4 {
            tets.push([at, ring[k], ring[(k + 1) % 4], up(2)]);
        }
    }
    tets
}

/// Where a site lies, for cubes of side `side`.
pub(super) fn position(site: Site, side: f64) -> Vec3 {
    Vec3::from_fn(|k| 0.5 * side * f64::from(site[k]))
}

/// [`position`], off by up to `SOLID.jitter` along each axis: always the same for a site, another for each.
pub(super) fn jittered(site: Site, side: f64) -> Vec3 {
    // The high bits of a product with an odd number are as good as random (Knuth's multiplicative hashing).
    let mixed = (key(site) ^ key(site) >> 29).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
    let off = |k: usize| (mixed >> (20 * k) & 0xfffff) as f64 / f64::from(1 << 19) - 1.0;
    position(site, side) + Vec3::from_fn(|k| SOLID.jitter * side * off(k))
}

/// The cube whose tetrahedra lie about `p`: its even site is the nearest below or at `p`. `None` out of
/// range.
pub(super) fn cube_at(p: Vec3, side: f64) -> Option<Site> {
    let at = [0, 1, 2].map(|k| 2.0 * (p[k] / side).floor());
    let limit = f64::from(SOLID.range - 4);
    at.iter().all(|x| x.abs() < limit).then(|| at.map(|x| x as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tetrahedra_fill_space_once_and_face_the_same_way() {
        let lattice = Lattice::new();
        let volume: f64 = lattice
            .tets
            .iter()
            .map(|t| {
                let [a, b, c, d] = t.corners.map(|k| position(lattice.corners[k], 1.0));
                (b - a).cross(c - a).dot(d - a) / 6.0
            })
            .inspect(|v| assert!((v - 1.0 / 12.0).abs() < 1e-15, "{v}"))
            .sum();
        assert!((volume - 1.0).abs() < 1e-12 && lattice.corners.len() == 11);
        for t in &lattice.tets {
            assert!(t.across.iter().all(|c| c.iter().all(|x| x.abs() <= 2 && x % 2 == 0)));
        }
        assert_eq!(site(key([-5, 7, 12])), [-5, 7, 12]);
    }
}
