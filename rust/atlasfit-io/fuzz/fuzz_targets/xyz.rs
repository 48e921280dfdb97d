//! Any bytes called "a.xyz".
#![no_main]

mod common;

libfuzzer_sys::fuzz_target!(init: common::quiet(), |data: &[u8]| common::run("a.xyz", data));
