//! Who imports whom: the files of a crate as nodes, their `use` lines and inline paths as arrows.
//!
//! In: the crate's root file and a way to read files. Out: a [`Crate`] with its modules, and the arrows
//! between files.
//!
//! An arrow goes to the file that defines the thing, through re-exports: a child's `use super::x` goes to the
//! parent's file when x is defined there, else to the file that x comes from. No arrows are a parent's `mod
//! child;` and `pub use child::x`, and a `use` that only names a module: the paths through that name are.
//! Test-only code has none.

use super::tokens::{Token, end_of_group, tokens};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Reads a file; `None` where there is none.
pub type ReadFile<'a> = &'a dyn Fn(&Path) -> Option<String>;

/// A crate's modules; the first is its root.
pub struct Crate {
    pub modules: Vec<Module>,
}

/// A module: a file, or inline in one.
pub struct Module {
    /// Names from the crate's root, which has none.
    pub path: Vec<String>,
    pub file: PathBuf,
    parent: usize,
    /// Child modules, in the order in which they are declared.
    pub children: Vec<(String, usize)>,
    /// Declared as `pub mod`.
    pub public: bool,
    /// Names of what is defined here.
    items: BTreeSet<String>,
    imports: Vec<Import>,
    /// Paths in the code itself, of two names or more.
    mentions: Vec<(Vec<String>, usize)>,
}

/// One leaf of a `use` line.
struct Import {
    path: Vec<String>,
    /// The name that it has here; `*` for all.
    name: String,
    public: bool,
    line: usize,
}

/// An import of one file by another.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrow {
    pub from: usize,
    /// The module that defines the thing; in another file than `from`.
    pub to: usize,
    pub line: usize,
    pub path: String,
}

impl Crate {
    /// Reads a crate from its root file (`lib.rs` or `main.rs`) on.
    pub fn read(root: &Path, read: ReadFile<'_>) -> Self {
        let mut out = Self { modules: Vec::new() };
        let source = read(root).unwrap_or_else(|| panic!("cannot read {}", root.display()));
        out.add(Vec::new(), root, 0, &tokens(&source), read);
        out
    }

    fn add(
        &mut self,
        path: Vec<String>,
        file: &Path,
        parent: usize,
        body: &[Token],
        read: ReadFile<'_>,
    ) -> usize {
        let id = self.modules.len();
        self.modules.push(Module {
            path,
            file: file.to_owned(),
            parent,
            children: Vec::new(),
            public: false,
            items: BTreeSet::new(),
            imports: Vec::new(),
            mentions: Vec::new(),
        });
        let (mut i, mut depth) = (0, 0_usize);
        while i < body.len() {
            let (word, next) = (body[i].text.as_str(), body.get(i + 1).map_or("", |t| t.text.as_str()));
            match word {
                "{" | "(" | "[" => depth += 1,
                "}" | ")" | "]" => depth = depth.saturating_sub(1),
                "use" if next != "<" => {
                    i = self.add_use(id, body, i);
                    continue;
                }
                "mod" if depth == 0 => {
                    i = self.add_module(id, body, i, read);
                    continue;
                }
                "fn" | "struct" | "enum" | "trait" | "type" | "const" | "static" | "union" if depth == 0 => {
                    self.modules[id].items.insert(next.to_owned());
                }
                "macro_rules" => {
                    let name = body.get(i + 2).map_or("", |t| t.text.as_str());
                    self.modules[id].items.insert(name.to_owned());
                }
                _ if body[i].is_word() && next == "::" => {
                    let (path, end) = path_at(body, i);
                    let before = |n: usize| i.checked_sub(n).map_or("", |at| body[at].text.as_str());
                    // `pub(in path)` imports nothing.
                    if before(1) != "::" && (before(2), before(1)) != ("(", "in") {
                        self.modules[id].mentions.push((path, body[i].line));
                    }
                    i = end;
                    continue;
                }
                _ => {}
            }
            i += 1;
        }
        id
    }

    /// The `use` line at `i`; where it is over.
    fn add_use(&mut self, id: usize, body: &[Token], i: usize) -> usize {
        let end = i + body[i..].iter().take_while(|t| t.text != ";").count();
        let public = i > 0 && (body[i - 1].text == "pub" || body[i - 1].text == ")");
        let line = body[i].line;
        let mut found = Vec::new();
        leaves(&body[i + 1..end], &[], &mut found);
        let imports = found.into_iter().map(|(path, name)| Import { path, name, public, line });
        self.modules[id].imports.extend(imports);
        end + 1
    }

    /// The `mod` at `i`, in a file or inline; where it is over.
    fn add_module(&mut self, id: usize, body: &[Token], i: usize, read: ReadFile<'_>) -> usize {
        let name = body[i + 1].text.clone();
        let parent = &self.modules[id];
        let path: Vec<String> = parent.path.iter().cloned().chain([name.clone()]).collect();
        let here = parent.file.clone();
        let (child, end) = if body[i + 2].text == "{" {
            let end = end_of_group(body, i + 2);
            (self.add(path, &here, id, &body[i + 3..end - 1], read), end)
        } else {
            let src = self.modules[0].file.parent().expect("the root lies in a folder").to_owned();
            let stem = path.iter().fold(src, |folder, name| folder.join(name));
            let files = [stem.with_extension("rs"), stem.join("mod.rs")];
            let found = files.iter().find_map(|f| read(f).map(|source| (f, tokens(&source))));
            let (file, body) =
                found.unwrap_or_else(|| panic!("no file for mod {name} of {}", here.display()));
            (self.add(path, file, id, &body, read), i + 3)
        };
        self.modules[child].public = i > 0 && body[i - 1].text == "pub";
        self.modules[id].children.push((name, child));
        end
    }

    /// All imports of one file by another, each once.
    pub fn arrows(&self) -> Vec<Arrow> {
        let mut out = BTreeSet::new();
        for (from, module) in self.modules.iter().enumerate() {
            let used = module.imports.iter().filter_map(|u| {
                let to = self.resolve(from, &u.path, 0)?;
                let names_a_module = u.name != "*" && self.is_module(from, &u.path);
                let passes_on_a_child = u.public && self.modules[to.module].path.starts_with(&module.path);
                (!names_a_module && !passes_on_a_child).then_some((to, &u.path, u.line))
            });
            let mentioned =
                module.mentions.iter().filter_map(|(p, line)| Some((self.resolve(from, p, 0)?, p, *line)));
            for (to, path, line) in used.chain(mentioned) {
                if self.modules[to.module].file != module.file {
                    out.insert(Arrow { from, to: to.module, line, path: path.join("::") });
                }
            }
        }
        out.into_iter().collect()
    }

    /// Where a path leads that is written in `from`; `None` for other crates.
    fn resolve(&self, from: usize, path: &[String], depth: usize) -> Option<Found> {
        const DEEPEST: usize = 32; // a circle of re-exports
        if depth > DEEPEST {
            return None;
        }
        let mut at = from;
        let mut rest = path;
        let mut relative = true;
        while let Some((first, others)) = rest.split_first() {
            at = match first.as_str() {
                "crate" => 0,
                "self" => at,
                "super" => self.modules[at].parent,
                _ => break,
            };
            relative = false;
            rest = others;
        }
        while let Some((name, others)) = rest.split_first() {
            let module = &self.modules[at];
            if let Some(&(_, child)) = module.children.iter().find(|(n, _)| n == name) {
                (at, rest, relative) = (child, others, false);
                continue;
            }
            if module.items.contains(name) {
                return Some(Found { module: at, whole: false });
            }
            let through = |import: &Import, tail: &[String]| {
                let further: Vec<String> = import.path.iter().chain(tail).cloned().collect();
                // A path that begins with its own name leads to another crate.
                (further != path || at != from).then(|| self.resolve(at, &further, depth + 1)).flatten()
            };
            if let Some(import) = module.imports.iter().find(|u| &u.name == name) {
                let found = through(import, others);
                return if relative { found } else { found.or(Some(Found { module: at, whole: false })) };
            }
            let globs = module.imports.iter().filter(|u| u.name == "*");
            let found =
                globs.filter_map(|u| through(u, rest)).find(|f| f.module != at && self.knows(f.module, rest));
            return if relative { found } else { found.or(Some(Found { module: at, whole: false })) };
        }
        Some(Found { module: at, whole: true })
    }

    /// Whether a module itself defines the thing at the end of a path.
    fn knows(&self, module: usize, path: &[String]) -> bool {
        path.iter().any(|name| self.modules[module].items.contains(name))
    }

    fn is_module(&self, from: usize, path: &[String]) -> bool {
        self.resolve(from, path, 0).is_some_and(|f| f.whole)
    }
}

/// Where a path leads.
#[derive(Clone, Copy)]
struct Found {
    module: usize,
    /// To the module itself, not to something in it.
    whole: bool,
}

/// The names from `i` on that `::` joins, and where they are over.
fn path_at(body: &[Token], mut i: usize) -> (Vec<String>, usize) {
    let mut path = vec![body[i].text.clone()];
    i += 1;
    while i + 1 < body.len() && body[i].text == "::" && body[i + 1].is_word() {
        path.push(body[i + 1].text.clone());
        i += 2;
    }
    (path, i)
}

/// The leaves of a `use` tree: path, and the name it has here.
fn leaves(tree: &[Token], before: &[String], out: &mut Vec<(Vec<String>, String)>) {
    let mut path = before.to_vec();
    for (i, token) in tree.iter().enumerate() {
        match token.text.as_str() {
            "::" => {}
            "{" => {
                let inside = &tree[i + 1..end_of_group(tree, i) - 1];
                return branches(inside).for_each(|branch| leaves(branch, &path, out));
            }
            "as" => {
                return out.push((path, tree[i + 1].text.clone()));
            }
            "*" => return out.push((path, "*".to_owned())),
            "self" if !path.is_empty() => {}
            name => path.push(name.to_owned()),
        }
    }
    if let Some(name) = path.last().cloned() {
        out.push((path, name));
    }
}

/// The parts of a group between its own commas.
fn branches(group: &[Token]) -> impl Iterator<Item = &[Token]> {
    let mut depth = 0;
    group
        .split(move |t| {
            depth += i32::from(t.text == "{") - i32::from(t.text == "}");
            depth == 0 && t.text == ","
        })
        .filter(|branch| !branch.is_empty())
}
