//! Any bytes called "a.e57", once as they are and once as whole pages with right checksums: else a checksum
//! would stop nearly every change.
#![no_main]

mod common;

/// Bytes of a page; the last four are the CRC-32C of the rest, big-endian.
const PAGE: usize = 1024;

/// CRC-32C (Castagnoli), bit by bit.
fn crc(data: &[u8]) -> u32 {
    !data.iter().fold(!0u32, |sum, &byte| {
        (0..8).fold(sum ^ u32::from(byte), |s, _| s >> 1 ^ if s & 1 == 1 { 0x82F6_3B78 } else { 0 })
    })
}

libfuzzer_sys::fuzz_target!(init: common::quiet(), |data: &[u8]| {
    common::run("a.e57", data);
    let mut pages = data.to_vec();
    pages.resize(data.len().next_multiple_of(PAGE), 0);
    for page in pages.chunks_exact_mut(PAGE) {
        let sum = crc(&page[..PAGE - 4]);
        page[PAGE - 4..].copy_from_slice(&sum.to_be_bytes());
    }
    common::run("a.e57", &pages);
});
