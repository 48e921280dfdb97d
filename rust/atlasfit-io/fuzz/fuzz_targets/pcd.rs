//! Any bytes called "a.pcd".
#![no_main]

mod common;

libfuzzer_sys::fuzz_target!(init: common::quiet(), |data: &[u8]| common::run("a.pcd", data));
