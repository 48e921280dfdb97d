//! Compiles the C++ behind the features that are on.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    #[cfg(feature = "cgal")]
    cgal();
    #[cfg(feature = "openmesh")]
    openmesh();
}

/// The bridge src/NAME.rs and its C++, optimised whatever the profile.
#[cfg(any(feature = "cgal", feature = "openmesh"))]
fn bridge(name: &str) -> cc::Build {
    println!("cargo:rerun-if-changed=src/behavior.hpp");
    for end in ["rs", "hpp", "cpp"] {
        println!("cargo:rerun-if-changed=src/{name}.{end}");
    }
    let mut build = cxx_build::bridge(format!("src/{name}.rs"));
    build.file(format!("src/{name}.cpp")).std("c++17").opt_level(2).define("NDEBUG", None);
    // Templates of that depth tell nobody anything.
    build.warnings(false);
    build
}

/// With the flag that CGAL's own CMake target sets for compilers like GCC: its interval arithmetic changes
/// the rounding mode. Debian's CGAL is headers only; its numbers are GMP's.
#[cfg(feature = "cgal")]
fn cgal() {
    bridge("cgal").flag_if_supported("-frounding-math").compile("atlasfit_cgal");
    println!("cargo:rustc-link-lib=gmp");
    println!("cargo:rustc-link-lib=mpfr");
}

#[cfg(feature = "openmesh")]
fn openmesh() {
    bridge("openmesh").compile("atlasfit_openmesh");
    println!("cargo:rustc-link-lib=OpenMeshCore");
}
