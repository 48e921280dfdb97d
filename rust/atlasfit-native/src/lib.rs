//! C++ libraries behind the core's interfaces. Each is a feature; without it no C++ compiler is needed.

#[cfg(feature = "cgal")]
mod cgal;
#[cfg(any(feature = "cgal", feature = "openmesh"))]
mod checks;
mod interface;
#[cfg(feature = "openmesh")]
mod openmesh;
mod shell;
#[cfg(feature = "xatlas")]
mod xatlas;

pub use interface::{Cgal, OpenMesh, Subdivision};
pub use shell::wrap;

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

/// CGAL; `None` where it is not built in (feature `cgal`).
#[must_use]
pub fn cgal() -> Option<&'static dyn Cgal> {
    #[cfg(feature = "cgal")]
    return Some(&cgal::Library);
    #[cfg(not(feature = "cgal"))]
    None
}

/// OpenMesh; `None` where it is not built in (feature `openmesh`).
#[must_use]
pub fn openmesh() -> Option<&'static dyn OpenMesh> {
    #[cfg(feature = "openmesh")]
    return Some(&openmesh::Library);
    #[cfg(not(feature = "openmesh"))]
    None
}

/// The libraries that are built in, with a space between them; those under the GPL say so. Empty without any.
#[must_use]
pub fn features() -> &'static std::ffi::CStr {
    match (cfg!(feature = "cgal"), cfg!(feature = "openmesh"), cfg!(feature = "xatlas")) {
        (false, false, false) => c"",
        (false, false, true) => c"xatlas",
        (false, true, false) => c"openmesh",
        (false, true, true) => c"openmesh xatlas",
        (true, false, false) => c"cgal(GPL)",
        (true, false, true) => c"cgal(GPL) xatlas",
        (true, true, false) => c"cgal(GPL) openmesh",
        (true, true, true) => c"cgal(GPL) openmesh xatlas",
    }
}
