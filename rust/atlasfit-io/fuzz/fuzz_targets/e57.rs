//! Any bytes called "a.e57".
#![no_main]

mod common;

libfuzzer_sys::fuzz_target!(init: common::quiet(), |data: &[u8]| common::run("a.e57", data));
