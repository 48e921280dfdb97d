//! Gives the shared library its soname, the name that programs ask for at run time, and keeps it in the
//! process when it is closed.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let var = |name: &str| std::env::var(name).unwrap_or_default();
    if var("CARGO_CFG_TARGET_OS") == "linux" {
        // Before 1.0 a minor version may change the ABI.
        let (major, minor) = (var("CARGO_PKG_VERSION_MAJOR"), var("CARGO_PKG_VERSION_MINOR"));
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libatlasfit.so.{major}.{minor}");
        // Rust's thread-local values have destructors in the library: dlclose() would pull them away.
        println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
