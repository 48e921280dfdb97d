use super::*;
use atlasfit::run::Run;
use std::collections::BTreeSet;

#[test]
fn shapes_fill_the_unit_box_and_no_two_parts_share_a_slot() {
    for family in Family::ALL {
        for seed in 0..200 {
            let (shape, again) = (Shape::new(family, seed), Shape::new(family, seed));
            assert_eq!(shape, again);
            let slots: BTreeSet<u8> = shape.parts.iter().map(|p| p.slot).collect();
            assert_eq!(slots.len(), shape.parts.len(), "{} {seed}", family.name());
            let (mesh, places) = shape.mesh();
            mesh.validate().unwrap();
            assert_eq!(places.len(), mesh.positions.len());
            let most = mesh.positions.iter().flatten().fold(0.0f64, |a, x| a.max(x.abs()));
            assert!((most - 0.5).abs() < 1e-3, "{} {seed} reaches {most}", family.name());
        }
    }
}

#[test]
fn topology_varies_within_each_family() {
    for family in Family::ALL {
        let kinds: BTreeSet<Vec<u8>> =
            (0..100).map(|seed| Shape::new(family, seed).parts.iter().map(|p| p.slot).collect()).collect();
        assert!(kinds.len() >= 4, "{}: {} kinds", family.name(), kinds.len());
    }
}

#[test]
fn a_point_is_found_again_by_its_place() {
    for family in Family::ALL {
        let shape = Shape::new(family, 3);
        let samples = Run::default().execute(|ctx| shape.sample(500, 1, ctx)).unwrap();
        // Round parts are made of flat faces: a place lies within their height above a chord.
        let off = samples.iter().map(|(p, place)| shape.find(*place).unwrap().dist2(*p).sqrt());
        let worst = off.fold(0.0, f64::max);
        assert!(worst < 0.03, "{}: {worst}", family.name());
    }
}

#[test]
fn closed_parts_face_outward() {
    // Bodies, seats, legs, wings; vessels and shades are open.
    for family in [Family::Chair, Family::Table, Family::Aircraft] {
        for seed in 0..20 {
            for part in Shape::new(family, seed).parts {
                let (points, _, triangles) = part.loft.mesh();
                let corner = |v: u32| points[v as usize] - points[0];
                let volume = triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))));
                let volume: f64 = volume.sum();
                assert!(volume > 0.0, "{} {seed}: part {} has volume {volume}", family.name(), part.slot);
            }
        }
    }
}
