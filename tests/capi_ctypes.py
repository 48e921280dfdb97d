"""Reads atlasfit.h as a ctypes user would, and writes C assertions that its structs lie in memory as ctypes
says.

usage: capi_ctypes.py atlasfit.h libatlasfit.so > asserts.c
"""

import ctypes
import re
import sys

SIMPLE = {
    "size_t": ctypes.c_size_t,
    "uint32_t": ctypes.c_uint32,
    "uint64_t": ctypes.c_uint64,
    "int64_t": ctypes.c_int64,
    "int32_t": ctypes.c_int32,
    "double": ctypes.c_double,
    "float": ctypes.c_float,
    "atlasfit_progress_fn": ctypes.c_void_p,
    "atlasfit_log_fn": ctypes.c_void_p,
}


def structs(header):
    """The header's structs as ctypes classes, by name."""
    text = re.sub(r"/\*.*?\*/", "", header, flags=re.S)
    values = {name: int(value) for name, value in re.findall(r"#define (ATLASFIT_\w+) (\d+)\n", text)}
    known = dict(SIMPLE)
    found = {}
    for body, name in re.findall(r"typedef struct \w* ?\{(.*?)\} (\w+);", text, flags=re.S):
        fields = []
        for declaration in (d.strip() for d in body.split(";")):
            if not declaration:
                continue
            kind, pointer, field, length = re.fullmatch(
                r"(?:const )?(?:struct )?(\w+) (\*?)(\w+)(?:\[(\w+)\])?", declaration
            ).groups()
            c = ctypes.c_void_p if pointer else known[kind]
            if length:
                c = c * int(values.get(length, length))
            fields.append((field, c))
        found[name] = known[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
    return found


def main():
    header, library = sys.argv[1:]
    all_structs = structs(open(header, encoding="utf-8").read())
    lib = ctypes.CDLL(library)
    print('#include "atlasfit.h"')
    for name, struct in all_structs.items():
        print(f'_Static_assert(sizeof({name}) == {ctypes.sizeof(struct)}, "{name}");')
        for field, _ in struct._fields_:
            print(
                f"_Static_assert(offsetof({name}, {field}) == {getattr(struct, field).offset}, "
                f'"{name}.{field}");'
            )
        init = getattr(lib, name + "_init", None)
        if init is not None:
            init.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
            value = struct()
            assert init(ctypes.byref(value), ctypes.sizeof(value)) == 0, name
            assert value.struct_size == ctypes.sizeof(value), name
    assert len(all_structs) > 10


main()
