//! Values of options that several commands have.

/// A place, from three numbers.
pub fn position(s: &str) -> Result<[f64; 3], String> {
    let coordinates: Option<Vec<f64>> = s.split(',').map(|c| c.trim().parse().ok()).collect();
    (coordinates.and_then(|c| c.try_into().ok()))
        .filter(|c: &[f64; 3]| c.iter().all(|x| x.is_finite()))
        .ok_or_else(|| "give three numbers with commas between them, such as 1.2,0,-3".into())
}

/// A direction, from three numbers that are not all 0.
pub fn direction(s: &str) -> Result<[f64; 3], String> {
    let found = position(s)?;
    if found == [0.0; 3] { Err("give a direction: not all of it 0".into()) } else { Ok(found) }
}

/// A share of a whole.
pub fn share(s: &str) -> Result<f64, String> {
    s.parse::<f64>().ok().filter(|x| (0.0..=1.0).contains(x)).ok_or_else(|| "give a share, 0 to 1".into())
}
