//! Compiles the C++ behind the features that are on.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    #[cfg(feature = "cgal")]
    cgal();
}

/// src/cgal.cpp, with the flag that CGAL's own CMake target sets for compilers like GCC: its interval
/// arithmetic changes the rounding mode. Debian's CGAL is headers only; its numbers are GMP's.
#[cfg(feature = "cgal")]
fn cgal() {
    for file in ["cgal.rs", "cgal.hpp", "cgal.cpp"] {
        println!("cargo:rerun-if-changed=src/{file}");
    }
    cxx_build::bridge("src/cgal.rs")
        .file("src/cgal.cpp")
        .std("c++17")
        .opt_level(2)
        .define("NDEBUG", None)
        .flag_if_supported("-frounding-math")
        // Templates of that depth tell nobody anything.
        .warnings(false)
        .compile("atlasfit_cgal");
    println!("cargo:rustc-link-lib=gmp");
    println!("cargo:rustc-link-lib=mpfr");
}
