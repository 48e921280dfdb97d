//! What `atlasfit --version` says.
//!
//! In: what the program was compiled with. Out: the text, also used by `doctor`.

use std::sync::OnceLock;

/// The version, and the licence where it is another: `-V`.
pub const SHORT: &str = if cfg!(feature = "cgal") {
    concat!(env!("CARGO_PKG_VERSION"), " (with CGAL: GPL 3 or later)")
} else {
    env!("CARGO_PKG_VERSION")
};

/// The licence of this program as an SPDX expression: CGAL's where it is inside.
pub const LICENCE: &str = if cfg!(feature = "cgal") { "GPL-3.0-or-later" } else { env!("CARGO_PKG_LICENSE") };

/// Cargo's features that change what the program can do, and whether they are in.
pub const FEATURES: [(&str, bool); 5] = [
    ("learn", cfg!(feature = "learn")),
    ("cuda", cfg!(feature = "cuda")),
    ("metal", cfg!(feature = "metal")),
    ("xatlas", cfg!(feature = "xatlas")),
    ("cgal", cfg!(feature = "cgal")),
];

/// For which machine, how, and of which commit the program was built. Builds that are handed out give the
/// commit in the environment variable `ATLASFIT_COMMIT`.
pub fn build() -> String {
    let c_library = match () {
        () if cfg!(target_env = "musl") => "-musl",
        () if cfg!(target_env = "gnu") => "-gnu",
        () if cfg!(target_env = "msvc") => "-msvc",
        () => "",
    };
    format!(
        "{}-{}{c_library}, {}{}",
        std::env::consts::ARCH,
        std::env::consts::OS,
        if cfg!(debug_assertions) { "with debug assertions" } else { "optimised" },
        option_env!("ATLASFIT_COMMIT").map_or(String::new(), |c| format!(", commit {c}"))
    )
}

/// Version, build, features and licence, a line each: `--version`.
pub fn long() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        let inside: Vec<&str> = FEATURES.iter().filter(|f| f.1).map(|f| f.0).collect();
        format!(
            "{}\nbuild          {}\nfeatures       {}\nlicence        {LICENCE}",
            env!("CARGO_PKG_VERSION"),
            build(),
            if inside.is_empty() {
                "none of those that are off by default".into()
            } else {
                inside.join(", ")
            },
        )
    })
}
