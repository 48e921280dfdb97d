//! Claims about the shape of the code: the core's layers import one way, and no files import each other in a
//! circle.
//!
//! The order of the layers stands in one place, the block with arrows in ARCHITECTURE.md.

mod modules;
mod tokens;

use modules::{Arrow, Crate};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The core's modules as ARCHITECTURE.md orders them.
struct Layers {
    /// Each imports only what stands before it.
    line: Vec<String>,
    /// Modules beside the line, and all that they may import. Only the last of the line imports them.
    beside: Vec<(String, Vec<String>)>,
}

impl Layers {
    /// From the block: `a, b ← c ← d`, then lines such as `e, f on a, c`.
    fn read(text: &str) -> Self {
        let mut blocks = text.split("```").skip(1).step_by(2);
        let block = blocks.find(|b| b.contains('←'));
        let block = block.expect("a fenced block of ARCHITECTURE.md orders the layers by arrows");
        let words = |part: &str| -> Vec<String> {
            part.split([',', '←']).map(|w| w.trim().to_owned()).filter(|w| !w.is_empty()).collect()
        };
        let (mut line, mut beside) = (Vec::new(), Vec::new());
        for row in block.lines() {
            if let Some((who, on)) = row.split_once(" on ") {
                beside.extend(words(who).into_iter().map(|w| (w, words(on))));
            } else {
                line.extend(words(row));
            }
        }
        Self { line, beside }
    }

    /// All names, in an order in which each imports only names before it: the last of the line comes last.
    fn names(&self) -> Vec<&str> {
        let (last, before) = self.line.split_last().expect("a line of layers");
        before
            .iter()
            .chain(self.beside.iter().map(|(name, _)| name))
            .chain([last])
            .map(String::as_str)
            .collect()
    }

    fn allows(&self, from: &str, to: &str) -> bool {
        let place = |name: &str| self.line.iter().position(|w| w == name);
        if from == to {
            return true;
        }
        match self.beside.iter().find(|(name, _)| name == from) {
            Some((_, on)) => on.iter().any(|w| w == to),
            None => match place(to) {
                Some(to) => place(from).is_some_and(|from| to < from),
                None => self.line.last().is_some_and(|last| last == from),
            },
        }
    }
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn layers() -> Layers {
    Layers::read(&std::fs::read_to_string(workspace().join("ARCHITECTURE.md")).unwrap())
}

fn on_disk(root: &Path) -> Crate {
    Crate::read(root, &|file| std::fs::read_to_string(file).ok())
}

fn core() -> Crate {
    on_disk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs"))
}

/// An arrow for people: file, line, path, file.
fn told(krate: &Crate, arrow: &Arrow) -> String {
    let short = |id: usize| {
        let file = krate.modules[id].file.to_string_lossy().into_owned();
        file.rsplit_once("/src/").map_or(file.clone(), |(_, name)| name.to_owned())
    };
    format!("{}:{} names {}, of {}", short(arrow.from), arrow.line, arrow.path, short(arrow.to))
}

/// Arrows that no order of the layers allows.
fn to_the_right(krate: &Crate, layers: &Layers) -> Vec<String> {
    let arrows = krate.arrows();
    let wrong = arrows.iter().filter(|a| {
        let layer = |id: usize| krate.modules[id].path.first();
        matches!((layer(a.from), layer(a.to)), (Some(from), Some(to)) if !layers.allows(from, to))
    });
    wrong.map(|a| told(krate, a)).collect()
}

/// All files that arrows lead to from one.
fn reached<'a>(next: &BTreeMap<&'a Path, BTreeSet<&'a Path>>, from: &'a Path) -> BTreeSet<&'a Path> {
    let (mut seen, mut todo) = (BTreeSet::new(), vec![from]);
    while let Some(at) = todo.pop() {
        todo.extend(next.get(at).into_iter().flatten().copied().filter(|&f| seen.insert(f)));
    }
    seen
}

/// Sets of files that all reach each other, each with an arrow for each two files that import one another.
fn circles(krate: &Crate) -> Vec<Vec<String>> {
    let arrows = krate.arrows();
    let file = |id: usize| krate.modules[id].file.as_path();
    let mut next: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
    for a in &arrows {
        next.entry(file(a.from)).or_default().insert(file(a.to));
    }
    let reach: BTreeMap<&Path, BTreeSet<&Path>> = next.keys().map(|&f| (f, reached(&next, f))).collect();
    let both = |a: &Path, b: &Path| {
        reach.get(a).is_some_and(|r| r.contains(b)) && reach.get(b).is_some_and(|r| r.contains(a))
    };
    let mut out: Vec<Vec<String>> = Vec::new();
    let mut told_of = BTreeSet::new();
    for &first in reach.keys().filter(|&&f| both(f, f)) {
        if !told_of.insert(first) {
            continue;
        }
        told_of.extend(reach.keys().filter(|&&f| both(first, f)));
        let inside = arrows.iter().filter(|a| both(first, file(a.from)) && both(first, file(a.to)));
        // One arrow stands for all from one file to another.
        let mut pairs = BTreeSet::new();
        let shown = inside.filter(|a| pairs.insert((file(a.from), file(a.to))));
        out.push(shown.map(|a| told(krate, a)).collect());
    }
    out
}

#[test]
fn each_layer_of_the_core_imports_only_what_stands_to_its_left() {
    let wrong = to_the_right(&core(), &layers());
    assert!(
        wrong.is_empty(),
        "{} imports against ARCHITECTURE.md's order:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

#[test]
fn lib_rs_names_the_layers_in_the_order_of_architecture_md() {
    let (krate, layers) = (core(), layers());
    let found = &krate.modules[0].children;
    let names: BTreeSet<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, layers.names().into_iter().collect(), "left: lib.rs; right: ARCHITECTURE.md");
    let public = found.iter().filter(|&&(_, id)| krate.modules[id].public);
    let public: Vec<&str> = public.map(|(name, _)| name.as_str()).collect();
    let mut order = layers.names();
    order.retain(|name| public.contains(name));
    // rustfmt sorts neighbouring lines: a blank line or a comment keeps two layers apart.
    assert_eq!(public, order, "left: the public modules of lib.rs; right: ARCHITECTURE.md");
}

#[test]
fn no_files_of_a_crate_import_each_other_in_a_circle() {
    let mut found = Vec::new();
    let mut crates: Vec<PathBuf> =
        std::fs::read_dir(workspace().join("rust")).unwrap().map(|d| d.unwrap().path()).collect();
    crates.sort();
    let roots = crates.iter().flat_map(|c| ["src/lib.rs", "src/main.rs"].map(|f| c.join(f)));
    let roots: Vec<PathBuf> = roots.filter(|f| f.exists()).collect();
    assert!(roots.len() > 1, "the crates of the workspace");
    for root in roots {
        let name = root.iter().rev().nth(2).unwrap().to_string_lossy().into_owned();
        found.extend(
            circles(&on_disk(&root)).iter().map(|c| format!("circle in {name}:\n  {}", c.join("\n  "))),
        );
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// A crate of made-up files.
fn made(files: &[(&str, &str)]) -> Crate {
    let files: BTreeMap<PathBuf, String> =
        files.iter().map(|(name, text)| (Path::new("/c/src").join(name), (*text).to_owned())).collect();
    Crate::read(Path::new("/c/src/lib.rs"), &|file| files.get(file).cloned())
}

fn arrows(files: &[(&str, &str)]) -> Vec<String> {
    let krate = made(files);
    krate.arrows().iter().map(|a| told(&krate, a)).collect()
}

#[test]
fn an_arrow_goes_to_the_file_that_defines_the_thing() {
    let found = arrows(&[
        ("lib.rs", "pub mod a; pub mod b; pub use a::deep::Thing;"),
        ("a/mod.rs", "mod deep; mod side; pub use deep::{Thing, inner::make}; pub struct Own;"),
        (
            "a/deep.rs",
            "pub struct Thing;\n pub mod inner { use super::super::side::f as g; pub fn make() {} }",
        ),
        ("a/side.rs", "use super::Own;\nuse super::Thing;\npub fn f() { super::deep::inner::make() }"),
        ("b.rs", "use crate::{\n  a::{self, Own},\n  Thing};\nfn f() { a::make(); std::mem::take(x) }"),
    ]);
    assert_eq!(
        found,
        [
            "a/deep.rs:2 names super::super::side::f, of a/side.rs",
            "a/side.rs:1 names super::Own, of a/mod.rs",
            "a/side.rs:2 names super::Thing, of a/deep.rs",
            "a/side.rs:3 names super::deep::inner::make, of a/deep.rs",
            "b.rs:1 names crate::a::Own, of a/mod.rs",
            "b.rs:1 names crate::Thing, of a/deep.rs",
            "b.rs:4 names a::make, of a/deep.rs",
        ]
        .map(str::to_owned)
    );
}

#[test]
fn tests_comments_and_texts_are_no_arrows() {
    let found = arrows(&[
        ("lib.rs", "mod a; mod b; #[cfg(test)] mod tests;"),
        (
            "a.rs",
            r##"// use crate::b::x;
            /* crate::b::x() /* nested */ crate::b::x() */
            const T: (&str, char, &str) = ("crate::b::x() \" use crate::b::x;", '"', r#"" crate::b::x "#);
            fn f<'a>(s: &'a str) -> &'a str { s }
            #[cfg(test)]
            use crate::b::{x, y};
            #[cfg(test)]
            #[allow(dead_code)]
            mod tests { use crate::b::x; fn g() -> [u8; 2] { crate::b::x() } }
            pub(in crate::b) struct S;"##,
        ),
        ("b.rs", "pub fn x() {} pub fn y() {}"),
    ]);
    assert_eq!(found, Vec::<String>::new());
}

#[test]
fn circles_and_imports_to_the_right_are_found() {
    let layers = Layers::read("text\n```\na ← b, c ← top\nu on a\n```\n");
    let krate = made(&[
        ("lib.rs", "mod a; mod b; mod c; mod top; mod u;"),
        ("a.rs", "pub fn f() { crate::b::f() }"),
        ("b.rs", "use crate::a; pub fn f() { a::f() }"),
        ("c.rs", "use crate::b::f; pub fn g() { crate::u::h() }"),
        ("top.rs", "use crate::{c::g, u::h};"),
        ("u.rs", "use crate::a::f; use crate::b::f as g; pub fn h() {}"),
    ]);
    assert_eq!(
        to_the_right(&krate, &layers),
        [
            "a.rs:1 names crate::b::f, of b.rs",
            "c.rs:1 names crate::u::h, of u.rs",
            "u.rs:1 names crate::b::f, of b.rs",
        ]
    );
    let both = ["a.rs:1 names crate::b::f, of b.rs", "b.rs:1 names a::f, of a.rs"];
    assert_eq!(circles(&krate), [both.map(str::to_owned).to_vec()]);
    assert_eq!(layers.names(), ["a", "b", "c", "u", "top"]);
}
