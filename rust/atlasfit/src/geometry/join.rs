//! Clouds of several scans made one.
//!
//! In: clouds. Out: all their points, one cloud's after the other's, with the columns that all of them have
//! and the number of its cloud for each point; and which columns had to be left out.

use super::cloud::{Attribute, PointCloud, ScalarKind, Scanners};
use super::names::FILE;

/// Joins clouds. The attribute [`FILE`] numbers them, 0, 1, and so on; one that they have of that name is
/// left out. An attribute of several types becomes f64. Returns the names of the columns left out, too.
///
/// ```
/// use atlasfit::geometry::{Attribute, PointCloud, join::join, names::FILE};
/// let mut a = PointCloud::from_positions(vec![[0.0; 3], [1.0; 3]]);
/// a.normals = Some(vec![[0.0, 0.0, 1.0]; 2]);
/// let (both, left_out) = join(vec![a, PointCloud::from_positions(vec![[2.0; 3]])]);
/// assert_eq!((both.len(), left_out), (3, vec!["normals".to_string()]));
/// assert_eq!(Attribute::named(&both.attributes, FILE).unwrap().values, [0.0, 0.0, 1.0]);
/// ```
#[must_use]
pub fn join(clouds: Vec<PointCloud>) -> (PointCloud, Vec<String>) {
    let total: usize = clouds.iter().map(PointCloud::len).sum();
    let mut left_out = Vec::new();
    let mut keep = |name: &str, here: &dyn Fn(&PointCloud) -> bool| -> bool {
        let count = clouds.iter().filter(|c| here(c)).count();
        if count > 0 && count < clouds.len() {
            left_out.push(name.to_string());
        }
        count > 0 && count == clouds.len()
    };
    let normals = keep("normals", &|c| c.normals.is_some());
    let colors = keep("colors", &|c| c.colors.is_some());
    let mut names: Vec<(String, usize)> = Vec::new();
    for a in clouds.iter().flat_map(|c| &c.attributes) {
        if !names.iter().any(|(name, _)| *name == a.name) {
            names.push((a.name.clone(), a.width));
        }
    }
    names.retain(|(name, width)| {
        let same = |c: &PointCloud| Attribute::named(&c.attributes, name).is_some_and(|a| a.width == *width);
        name != FILE && keep(name, &same)
    });
    if clouds.iter().any(|c| Attribute::named(&c.attributes, FILE).is_some()) {
        left_out.push(FILE.to_string());
    }
    let mut all = PointCloud { positions: Vec::with_capacity(total), ..PointCloud::default() };
    all.normals = normals.then(|| Vec::with_capacity(total));
    all.colors = colors.then(|| Vec::with_capacity(total));
    all.attributes = (names.into_iter())
        .map(|(name, width)| {
            let kinds: Vec<ScalarKind> =
                clouds.iter().filter_map(|c| Some(Attribute::named(&c.attributes, &name)?.kind)).collect();
            let kind = if kinds.iter().all(|k| *k == kinds[0]) { kinds[0] } else { ScalarKind::F64 };
            Attribute { name, width, kind, values: Vec::with_capacity(width * total) }
        })
        .collect();
    let mut scanners = Scanners::default();
    let mut file = Vec::with_capacity(total);
    for (number, cloud) in clouds.into_iter().enumerate() {
        let count = cloud.len();
        file.extend(std::iter::repeat_n(number as f64, count));
        all.positions.extend(cloud.positions);
        all.normals.iter_mut().for_each(|n| n.extend(cloud.normals.iter().flatten()));
        all.colors.iter_mut().for_each(|c| c.extend(cloud.colors.iter().flatten()));
        for a in &mut all.attributes {
            a.values.extend(Attribute::named(&cloud.attributes, &a.name).iter().flat_map(|a| &a.values));
        }
        let before = scanners.positions.len() as u32;
        match cloud.scanners {
            None => scanners.of_point.extend(std::iter::repeat_n(u32::MAX, count)),
            Some(own) => {
                let known = own.positions.len();
                let there = |s: u32| if (s as usize) < known { before + s } else { u32::MAX };
                scanners.of_point.extend(own.of_point.into_iter().map(there));
                scanners.positions.extend(own.positions);
            }
        }
    }
    all.scanners = (!scanners.positions.is_empty()).then_some(scanners);
    all.attributes.push(Attribute { name: FILE.into(), width: 1, kind: ScalarKind::U32, values: file });
    (all, left_out)
}

#[cfg(test)]
mod tests {
    use super::{FILE, join};
    use crate::geometry::{Attribute, PointCloud, ScalarKind, Scanners};

    fn cloud(at: f64, kind: ScalarKind, scanner: Option<u32>) -> PointCloud {
        let mut cloud = PointCloud::from_positions(vec![[at; 3]; 2]);
        cloud.colors = Some(vec![[at as f32; 4]; 2]);
        cloud.scanners =
            scanner.map(|s| Scanners { positions: vec![[10.0 + at; 3]], of_point: vec![s, u32::MAX] });
        cloud.attributes = vec![
            Attribute { name: "age".into(), width: 1, kind, values: vec![at, at + 0.5] },
            Attribute { name: FILE.into(), width: 1, kind, values: vec![9.0, 9.0] },
        ];
        cloud
    }

    #[test]
    fn columns_that_all_have_are_kept_and_scanners_keep_their_points() {
        let clouds = [
            cloud(0.0, ScalarKind::U8, Some(0)),
            cloud(1.0, ScalarKind::F32, None),
            cloud(2.0, ScalarKind::U8, Some(0)),
        ];
        let (all, left_out) = join(clouds.to_vec());
        assert_eq!(left_out, [FILE]);
        let age = Attribute::named(&all.attributes, "age").unwrap();
        assert_eq!((age.kind, &age.values[..]), (ScalarKind::F64, &[0.0, 0.5, 1.0, 1.5, 2.0, 2.5][..]));
        let scanners = all.scanners.unwrap();
        assert_eq!(scanners.positions, [[10.0; 3], [12.0; 3]]);
        assert_eq!(scanners.of_point, [0, u32::MAX, u32::MAX, u32::MAX, 1, u32::MAX]);
        let file: Vec<&Attribute> = all.attributes.iter().filter(|a| a.name == FILE).collect();
        assert_eq!((file.len(), &file[0].values[..]), (1, &[0.0, 0.0, 1.0, 1.0, 2.0, 2.0][..]));
        assert_eq!(all.colors.unwrap().len(), 6);
    }
}
