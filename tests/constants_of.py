"""The numeric constants of the core's sources, and sources in which one is changed.

In: the checkout. Out: each number that a constant holds, with its place; the text of a file with the number
halved, doubled, or read when the program starts. For constants.py.
"""

import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[1]
SOURCES = pathlib.Path("rust/atlasfit/src")
# What a build needs of the tree.
COPIED = ["Cargo.toml", "Cargo.lock", ".cargo", "rust", "include"]
FLOATS = {"f32", "f64"}
INTEGERS = {"usize", "u8", "u16", "u32", "u64", "i8", "i16", "i32", "i64", "isize"}


def blanked(source):
    """The source with comments, texts and test-only code as blanks: all else stays at its place."""
    blank = lambda m: re.sub(r"[^\n]", " ", m[0])
    token = r"//[^\n]*|/\*.*?\*/|\bb?r(#*)\".*?\"\1|\"(?:\\.|[^\"\\])*\"|'(?:\\[^']+|[^'\\\n])'"
    out = re.sub(token, blank, source, flags=re.S)
    for test in reversed(list(re.finditer(r"#\[cfg\(test\)\]\s*mod\s+\w+\s*\{", out))):
        end = closing(out, test.end() - 1)
        out = out[: test.start()] + blank([out[test.start() : end]]) + out[end:]
    return out


def closing(text, at):
    """Where the bracket that opens at `at` is closed, one further."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] in "([{") - (text[i] in ")]}")
        if depth == 0:
            return i + 1
    return len(text)


def until(text, at, ends):
    """The first of `ends` outside of brackets."""
    while at < len(text) and text[at] not in ends:
        at = closing(text, at) if text[at] in "([{" else at + 1
    return at


def parts(text, start, end):
    """Spans between the commas of text[start:end], without blanks around."""
    while start < end:
        stop = min(until(text, start, ","), end)
        inner = text[start:stop]
        if inner.strip():
            left = start + len(inner) - len(inner.lstrip())
            yield left, left + len(inner.strip())
        start = stop + 1


def structs(text):
    """The fields of each struct with their types."""
    out = {}
    for m in re.finditer(r"\bstruct\s+(\w+)\s*\{", text):
        body = text[m.end() : closing(text, m.end() - 1) - 1]
        fields = (body[a:b].rpartition("pub")[2].partition(":") for a, b in parts(body, 0, len(body)))
        out[m[1]] = {name.strip(): kind.strip() for name, _, kind in fields}
    return out


def places(text, name, kind, start, end):
    """Numbers inside text[start:end], a value of type `kind` (None: not known).

    Each is (name, spans, is a float), or (name, reason) where it is left out.
    """
    value = text[start:end]
    if kind in FLOATS | INTEGERS or kind is None and re.fullmatch(r"-?[\d._]+(e-?\d+)?(_?[fiu]\w+)?", value):
        integer = kind in INTEGERS or kind is None and not re.search(r"[.e]|f\d", value)
        if re.search(r"MAX|MIN\b|INFINITY|EPSILON|NAN", value):
            yield name, "a sentinel"
        elif re.search(r"0x|0b|[|&^!]", value):
            yield name, "a pattern of bits"
        elif re.fullmatch(r"0(\.0*)?", value):
            yield name, "0"
        else:
            yield name, [(start, end)], not integer
    elif value.startswith("(") and (kind or "(").startswith("("):
        kinds = [kind[a:b] for a, b in parts(kind, 1, len(kind) - 1)] if kind else []
        for i, (a, b) in enumerate(parts(text, start + 1, end - 1)):
            yield from places(text, f"{name}.{i}", kinds[i] if kinds else None, a, b)
    elif value.startswith("[") and (kind or "").startswith("["):
        element = kind[1 : until(kind, 1, ";")].strip()
        columns = {}
        for a, b in parts(text, start + 1, end - 1):
            for found in places(text, f"{name}[..]", element, a, b):
                columns.setdefault(found[0], []).append(found)
        if (
            not columns
            or any(len(f) < 3 for fs in columns.values() for f in fs)
            or not any(fs[0][2] for fs in columns.values())
        ):
            yield name, "a table"
        else:
            yield from ((column, [f[1][0] for f in fs], fs[0][2]) for column, fs in columns.items())
    elif brace := re.match(r"[\w:]+\s*\{", value):
        kinds = structs(text).get(kind, {})
        for a, b in parts(text, start + brace.end(), end - 1):
            if field := re.match(r"(\w+)\s*:\s*", text[a:b]):
                yield from places(text, f"{name}.{field[1]}", kinds.get(field[1]), a + field.end(), b)
    else:
        yield name, f"no number: {' '.join(value.split())[:40]}"


def sizes_an_array(name, texts):
    return any(
        not m[1]
        for t in texts
        for m in re.finditer(r"(vec!\s*)?\[[^\[\]]*;[^\[\];]*\b%s\b[^\[\];]*\]" % name, t)
    )


def constants(words):
    """Every number that a constant of the core holds: dicts; those left out have a `reason`."""
    texts = {
        f: blanked((ROOT / f).read_text())
        for f in listed()
        if f.is_relative_to(SOURCES) and f.suffix == ".rs"
    }
    texts = {f: t for f, t in texts.items() if f.name != "tests.rs"}
    for file, text in texts.items():
        seen = {}
        for m in re.finditer(r"(\bpub\b[^;{}\n]*)?\bconst\s+([A-Z][A-Z0-9_]*)\s*:", text):
            equals = until(text, m.end(), "=;,>")  # a parameter of a generic ends otherwise
            stop = until(text, equals, ";")
            if text[equals : equals + 1] != "=" or stop >= len(text):
                continue
            seen[m[2]] = seen.get(m[2], 0) + 1
            name = m[2] + (f"#{seen[m[2]]}" if seen[m[2]] > 1 else "")
            kind = text[m.end() : equals].strip()
            start = equals + 1 + len(text[equals + 1 : stop]) - len(text[equals + 1 : stop].lstrip())
            structural = sizes_an_array(m[2], texts.values() if m[1] else [text])
            for found in places(text, name, kind, start, start + len(text[start:stop].strip())):
                one = {"file": str(file.relative_to(SOURCES)), "name": found[0]}
                if not all(any(w in field for field in one.values()) for w in words):
                    continue
                if structural or len(found) == 2:
                    yield one | {"reason": "the size of an array" if structural else found[1]}
                else:
                    values = [text[a:b] for a, b in found[1]]
                    yield one | {"spans": found[1], "float": found[2], "value": ", ".join(values)}


def listed():
    """Files of the checkout, those not yet committed too."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *COPIED]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    return [pathlib.Path(n) for n in sorted(set(names)) if n and (ROOT / n).is_file()]


def at_start(constant):
    """Whether the copy of the tree reads this number when the program starts."""
    return constant["file"].endswith("constants.rs") and "." in constant["name"]


# What the copy's constants are read with. In: a number's name and value. Out: the value, times what the
# environment says.
KNOB = """//! Reads the one number that is to be changed from the environment.

pub(crate) trait Number {
    fn half(self) -> Self;
    fn double(self) -> Self;
}

macro_rules! number {
    ($($t:ty),*) => {
        $(impl Number for $t {
            fn half(self) -> Self { self / (2 as $t) }
            fn double(self) -> Self { self * (2 as $t) }
        })*
    };
}

number!(f32, f64, usize, u8, u16, u32, u64, i8, i16, i32, i64, isize);

pub(crate) fn of<N: Number>(name: &str, value: N) -> N {
    match std::env::var("ATLASFIT_CONSTANT") {
        Ok(s) if s.strip_suffix(" half") == Some(name) => value.half(),
        Ok(s) if s.strip_suffix(" double") == Some(name) => value.double(),
        _ => value,
    }
}
"""


def read_at_start(source, constants):
    """The source of a constants.rs whose structs read their numbers when the program starts."""
    edits = [
        (a, b, f'crate::knob::of("{c["file"]} {c["name"]}", {source[a:b]})')
        for c in constants
        for a, b in c["spans"]
    ]
    for m in re.finditer(r"const (\w+): (\w+) =\s*\2 \{", source):
        lazy = f"static {m[1]}: std::sync::LazyLock<{m[2]}> = std::sync::LazyLock::new(|| {m[2]} {{"
        end = closing(blanked(source), m.end() - 1)
        edits += [(m.start(), m.end(), lazy), (end, end, ")")]
    for a, b, new in sorted(edits, reverse=True):
        source = source[:a] + new + source[b:]
    return source


def changed(source, constant, factor):
    """The source with the constant times the factor; None where that is no other number."""
    for a, b in reversed(constant["spans"]):
        value = source[a:b]
        if not constant["float"] and factor < 1 and re.fullmatch(r"[01]", value):
            return None
        by = f"* {factor:.1f}" if constant["float"] else "/ 2" if factor < 1 else f"* {factor}"
        source = f"{source[:a]}({value}) {by}{source[b:]}"
    return source
