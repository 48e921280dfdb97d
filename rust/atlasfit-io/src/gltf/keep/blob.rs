//! The bytes behind a file's buffer views, laid out anew in one buffer.
//!
//! In: the buffers of a file, its views, and the bytes of those that are new. Out: one buffer. What no view
//! shows is left out; what several views show is there once. A place keeps its remainder by eight, which is
//! all that alignment asks for.

use super::refs::VIEWS;
use crate::gltf::document::{Document, list, number};
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Result, Write};

/// The largest alignment that anything asks for, in bytes.
const ALIGNED: usize = 8;

/// Bytes at a place of the buffer.
struct Piece<'k> {
    at: usize,
    bytes: Cow<'k, [u8]>,
}

/// The buffer.
#[derive(Default)]
pub(super) struct Blob<'k> {
    pieces: Vec<Piece<'k>>,
    /// Its length, a multiple of four.
    pub len: usize,
}

/// What a view of the file shows.
#[derive(Clone, Copy)]
struct Shown {
    buffer: usize,
    from: usize,
    to: usize,
    view: usize,
}

/// What a view shows; `None` where it leaves its buffer.
fn shown(file: &Document<'_>, json: &Value, view: usize) -> Option<Shown> {
    let value = &list(json, "bufferViews")[view];
    let bytes = file.view(value)?;
    let from = number(&value["byteOffset"]).unwrap_or(0);
    Some(Shown { buffer: number(&value["buffer"])?, from, to: from + bytes.len(), view })
}

/// The number of a view that leaves its buffer.
pub(super) fn outside(file: &Document<'_>) -> Option<usize> {
    (0..list(&file.json, "bufferViews").len()).find(|&i| shown(file, &file.json, i).is_none())
}

impl<'k> Blob<'k> {
    /// Lays out the views of `json`, which learns their places; `new` has the bytes of some.
    pub fn of(json: &mut Value, file: &'k Document<'_>, mut new: BTreeMap<usize, Vec<u8>>) -> Self {
        let mut out = Self::default();
        let views = list(json, "bufferViews").len();
        let mut old: Vec<Shown> =
            (0..views).filter(|i| !new.contains_key(i)).filter_map(|i| shown(file, json, i)).collect();
        old.sort_unstable_by_key(|s| (s.buffer, s.from, s.to));
        let mut rest = &old[..];
        while let [first, ..] = rest {
            // Views that overlap or touch stay together.
            let (mut to, mut count) = (first.to, 0);
            while let Some(s) = rest.get(count).filter(|s| s.buffer == first.buffer && s.from <= to) {
                to = to.max(s.to);
                count += 1;
            }
            let bytes = &file.buffers()[first.buffer][first.from..to];
            let at = out.push(first.from % ALIGNED, Cow::Borrowed(bytes));
            rest[..count].iter().for_each(|s| place(json, s.view, at + s.from - first.from));
            rest = &rest[count..];
        }
        while let Some((view, bytes)) = new.pop_first() {
            let length = bytes.len();
            let at = out.push(0, Cow::Owned(bytes));
            place(json, view, at);
            if let Some(value) = json["bufferViews"].get_mut(view) {
                value["byteLength"] = length.into();
            }
        }
        out.len = out.len.next_multiple_of(4);
        out
    }

    /// Adds bytes at the next place of this remainder.
    fn push(&mut self, remainder: usize, bytes: Cow<'k, [u8]>) -> usize {
        let at = self.len + (remainder + ALIGNED - self.len % ALIGNED) % ALIGNED;
        self.len = at + bytes.len();
        self.pieces.push(Piece { at, bytes });
        at
    }

    pub fn write(&self, out: &mut impl Write) -> Result<()> {
        let mut at = 0;
        for piece in &self.pieces {
            out.write_all(&[0; ALIGNED][..piece.at - at])?;
            out.write_all(&piece.bytes)?;
            at = piece.at + piece.bytes.len();
        }
        out.write_all(&[0; ALIGNED][..self.len - at])
    }
}

/// Says where a view starts.
fn place(json: &mut Value, view: usize, at: usize) {
    let Some(view) = VIEWS.entries(json).and_then(|v| v.get_mut(view)).and_then(Value::as_object_mut) else {
        return;
    };
    view.insert("buffer".into(), 0.into());
    if at > 0 || view.contains_key("byteOffset") {
        view.insert("byteOffset".into(), at.into());
    }
}
