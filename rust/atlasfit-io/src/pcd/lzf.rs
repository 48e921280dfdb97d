//! Unpacks LZF (Lehmann 2000): literal runs and back references.

/// A back reference of 3 bytes gives at most 264: more than so many bytes per byte cannot be there.
const MOST_RATIO: usize = 88;

/// The most bytes that `packed` gives, if it says that these are `claimed`.
pub(super) fn most(packed: &[u8], claimed: usize) -> usize {
    claimed.min(packed.len().saturating_mul(MOST_RATIO))
}

/// Unpacks `claimed` bytes. `Err`: at this byte of `packed` it is damaged.
pub(super) fn unpack(packed: &[u8], claimed: usize) -> Result<Vec<u8>, usize> {
    let mut out: Vec<u8> = Vec::with_capacity(most(packed, claimed).min(8 * packed.len()));
    let mut i = 0;
    while i < packed.len() && out.len() < claimed {
        let control = usize::from(packed[i]);
        i += 1;
        if control < 32 {
            out.extend_from_slice(packed.get(i..i + control + 1).ok_or(i)?);
            i += control + 1;
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += usize::from(*packed.get(i).ok_or(i)?);
                i += 1;
            }
            let low = usize::from(*packed.get(i).ok_or(i)?);
            i += 1;
            let back = ((control & 31) << 8) + low + 1;
            let start = out.len().checked_sub(back).ok_or(i)?;
            let length = length + 2;
            if length <= back {
                out.extend_from_within(start..start + length);
            } else {
                // The run repeats bytes that it writes itself.
                for k in start..start + length {
                    out.push(out[k]);
                }
            }
        }
    }
    if out.len() == claimed { Ok(out) } else { Err(i) }
}
