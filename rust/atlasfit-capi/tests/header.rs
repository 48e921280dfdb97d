//! include/atlasfit.h is what cbindgen writes from this crate. `ATLASFIT_BLESS=1 cargo test -p atlasfit-capi
//! --test header` rewrites it.

use std::path::Path;

#[test]
fn the_committed_header_is_the_generated_one() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(here.join("cbindgen.toml")).expect("cbindgen.toml is valid");
    let mut new = Vec::new();
    cbindgen::Builder::new()
        .with_crate(here)
        .with_config(config)
        .generate()
        .expect("the header is generated")
        .write(&mut new);
    let new = String::from_utf8(new).expect("the header is UTF-8");
    let path = here.join("../../include/atlasfit.h");
    if std::env::var_os("ATLASFIT_BLESS").is_some() {
        std::fs::write(&path, &new).expect("the header is written");
    }
    let old = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        old == new,
        "include/atlasfit.h is out of date: ATLASFIT_BLESS=1 cargo test -p atlasfit-capi --test header"
    );
}
