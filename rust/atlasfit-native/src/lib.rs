//! C++ libraries behind the core's interfaces. Each is a feature; without it no C++ compiler is needed.

#[cfg(feature = "xatlas")]
mod xatlas;

use atlasfit::unwrap::PagePacker;

/// xatlas as a packer for [`unwrap_with`](atlasfit::unwrap::unwrap_with), on square pages; `None` where it is
/// not built in (feature `xatlas`).
#[must_use]
pub fn xatlas() -> Option<&'static dyn PagePacker> {
    #[cfg(feature = "xatlas")]
    return Some(&xatlas::Xatlas);
    #[cfg(not(feature = "xatlas"))]
    None
}
