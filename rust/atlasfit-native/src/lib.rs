//! C++ libraries behind the core's interfaces. Each is a feature; without it no C++ compiler is needed.

#[cfg(feature = "cgal")]
mod cgal;
mod interface;
mod shell;
#[cfg(feature = "xatlas")]
mod xatlas;

pub use interface::Cgal;
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

/// The libraries that are built in, with a space between them; those under the GPL say so. Empty without any.
#[must_use]
pub fn features() -> &'static std::ffi::CStr {
    match (cfg!(feature = "cgal"), cfg!(feature = "xatlas")) {
        (false, false) => c"",
        (false, true) => c"xatlas",
        (true, false) => c"cgal(GPL)",
        (true, true) => c"cgal(GPL) xatlas",
    }
}
