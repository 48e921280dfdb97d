"""_abi.py says what include/atlasfit.h says: every constant, struct and function, no more and no less."""

import ctypes
import re
from pathlib import Path

import pytest
from atlasfit import _abi

HEADER = (Path(__file__).resolve().parents[2] / "include" / "atlasfit.h").read_text()
CODE = re.sub(r"/\*.*?\*/", "", HEADER, flags=re.S)

SCALARS = {
    "size_t": ctypes.c_size_t,
    "uint32_t": ctypes.c_uint32,
    "int32_t": ctypes.c_int32,
    "uint64_t": ctypes.c_uint64,
    "int64_t": ctypes.c_int64,
    "double": ctypes.c_double,
    "atlasfit_status": _abi.status,
    "atlasfit_progress_fn": _abi.progress_fn,
    "atlasfit_log_fn": _abi.log_fn,
}
HANDLES = set(re.findall(r"typedef struct (\w+) \1;", CODE))
STRUCTS = {name: body for body, name in re.findall(r"typedef struct \{(.*?)\} (\w+);", CODE, flags=re.S)}
FUNCTIONS = {
    name: (result.strip(), arguments)
    for result, name, arguments in re.findall(r"ATLASFIT_API\s+([\w\s]+?\*?)(atlasfit_\w+)\(([^)]*)\);", CODE)
}


def ctype(text):
    """The ctypes type of a C type."""
    text = text.replace("const ", "").strip()
    stars = text.count("*")
    base = text.rstrip("* ").strip()
    if stars == 0:
        return SCALARS[base] if base in SCALARS else getattr(_abi, base)
    if base in HANDLES:
        return ctypes.c_void_p if stars == 1 else ctypes.POINTER(ctypes.c_void_p)
    assert stars == 1, text
    if base in STRUCTS:
        return ctypes.POINTER(getattr(_abi, base))
    return ctypes.c_void_p


def declaration(text):
    """(name, type) of a C declaration, arrays included."""
    kind, name, length = re.fullmatch(r"(.*?)(\w+)(?:\[(\w+)\])?", text.strip(), flags=re.S).groups()
    kind = ctype(kind)
    if length is None:
        return name, kind
    return name, kind * (int(length) if length.isdigit() else getattr(_abi, length.removeprefix("ATLASFIT_")))


def test_the_header_was_understood():
    assert len(STRUCTS) >= 13 and len(FUNCTIONS) >= 40 and len(HANDLES) >= 4


def test_constants_are_the_headers():
    defines = {name: int(value) for name, value in re.findall(r"#define ATLASFIT_(\w+) (\d+)", CODE)}
    version = tuple(defines.pop(f"VERSION_{part}") for part in ("MAJOR", "MINOR", "PATCH"))
    assert _abi.VERSION == version
    ours = {name: value for name, value in vars(_abi).items() if name.isupper() and isinstance(value, int)}
    assert ours == defines


@pytest.mark.parametrize("name", STRUCTS)
def test_struct_has_the_headers_fields(name):
    fields = [declaration(line) for line in STRUCTS[name].split(";") if line.strip()]
    # Texts are char pointers in both worlds.
    ours = [
        (field, ctypes.c_void_p if kind is ctypes.c_char_p else kind)
        for field, kind in getattr(_abi, name)._fields_
    ]
    assert ours == fields


def test_there_is_no_struct_that_the_header_lacks():
    ours = {
        name for name, value in vars(_abi).items() if name.startswith("atlasfit_") and isinstance(value, type)
    }
    assert ours == set(STRUCTS)


def test_functions_are_the_headers():
    assert set(_abi.FUNCTIONS) == set(FUNCTIONS)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_function_has_the_headers_signature(name):
    result, arguments = FUNCTIONS[name]
    expected = [declaration(a)[1] for a in arguments.split(",") if a.strip() not in ("", "void")]
    assert _abi.FUNCTIONS[name][1] == expected
    text = result.endswith("*")
    assert _abi.FUNCTIONS[name][0] is (ctypes.c_char_p if text else ctype(result))


@pytest.mark.parametrize(("name", "gives"), [("progress", ctypes.c_int32), ("log", None)])
def test_a_callback_has_the_headers_signature(name, gives):
    result, arguments = re.search(rf"typedef (\w+) \(\*atlasfit_{name}_fn\)\((.*?)\);", CODE).groups()
    ours = getattr(_abi, f"{name}_fn")
    texts = [ctypes.c_void_p if kind is ctypes.c_char_p else kind for kind in ours._argtypes_]
    assert texts == [declaration(a)[1] for a in arguments.split(",")]
    assert ours._restype_ is gives and result == ("void" if gives is None else "int32_t")


def test_the_library_exports_every_function():
    for name in FUNCTIONS:
        assert hasattr(_abi.lib(), name)
