//! Any bytes called "a.off".
#![no_main]

mod common;

libfuzzer_sys::fuzz_target!(init: common::quiet(), |data: &[u8]| common::run("a.off", data));
