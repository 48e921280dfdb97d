//! Compiles src/kernels.cu with CUDA's compiler, which candle needs too, where the feature `cuda` is on.

use std::{env, path::PathBuf, process::Command};

/// The oldest GPUs that CUDA 13 knows; newer ones compile this form for themselves when it is loaded.
const ARCHITECTURE: &str = "-arch=compute_75";

fn main() {
    println!("cargo::rerun-if-changed=src/kernels.cu");
    if env::var_os("CARGO_FEATURE_CUDA").is_none() {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo names OUT_DIR")).join("kernels.ptx");
    let mut nvcc = Command::new("nvcc");
    let status = nvcc.args(["-ptx", ARCHITECTURE, "-o"]).arg(&out).arg("src/kernels.cu").status();
    match status {
        Ok(status) if status.success() => {}
        other => panic!("nvcc must be on the path for the feature cuda: {other:?}"),
    }
}
