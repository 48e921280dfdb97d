//! Any bytes called "a.stl".
#![no_main]

mod common;

libfuzzer_sys::fuzz_target!(init: common::quiet(), |data: &[u8]| common::run("a.stl", data));
