//! What every target does: load, and check what the type of the result promises.

use atlasfit_io::{LoadOptions, load_bytes};
use std::path::Path;

/// Panics inside of the LAZ and E57 crates are caught and become errors: only those that escape are findings.
pub fn quiet() {
    std::panic::set_hook(Box::new(|_| {}));
}

pub fn run(name: &str, data: &[u8]) {
    let options = LoadOptions::default().with_max_memory_bytes(Some(1 << 28));
    if let Ok(l) = load_bytes(Path::new(name), data, &options) {
        let n = l.cloud.len();
        assert!(l.faces.iter().flatten().all(|&v| (v as usize) < n));
        assert!(l.cloud.attributes.iter().all(|a| a.values.len() == n * a.width));
        assert!(l.cloud.normals.is_none_or(|c| c.len() == n));
        assert!(l.cloud.colors.is_none_or(|c| c.len() == n));
        assert!(l.corner_uv.is_none_or(|c| c.len() == l.faces.len()));
    }
}
