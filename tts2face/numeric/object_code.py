"""Loading of compiled kernels into memory, without numba and its compiler."""

import ctypes
import importlib
import mmap
import struct
import sys
from functools import cache
from platform import machine
from typing import Any, NamedTuple

# ELF (System V ABI, AMD64 supplement): what LLVM writes for x86-64 Linux.
HEADER, SECTION, SYMBOL, RELOCATION = "<40xQ12xHH", "<4xIQ8xQQIIQ8x", "<I2xHQ8x", "<QIIq"
WRITABLE, ALLOCATED = 1, 2  # flags of sections
SYMBOLS, ADDENDS, EMPTY = 2, 4, 8  # types of sections
UNDEFINED = 0  # in place of the number of a section
FIELDS = {1: (8, False), 2: (4, True), 4: (4, True), 24: (8, True)}  # size, and whether relative, by type of relocation
READ_EXECUTE = 5  # of mprotect
_mapped: list[Any] = []  # memory that holds code for as long as the process runs


class Section(NamedTuple):
    """Fields of a section's header that are needed here."""

    kind: int
    flags: int
    at: int
    size: int
    link: int
    info: int
    align: int


class UnknownObject(Exception):  # noqa: N818 - never leaves this module
    """An object of another platform, or with a relocation that is not known here."""


def load_object(code: bytes, name: str) -> int:
    """Address of a function of an object file, which is loaded for the rest of the process.

    On x86-64 Linux its sections are copied and relocated here; elsewhere LLVM does that, which takes 40 MB and 30 ms.
    """
    try:
        return _load(code, name)
    except UnknownObject:
        return _load_by_llvm(code, name)


def _load(code: bytes, name: str) -> int:
    if sys.platform != "linux" or machine() != "x86_64" or code[:6] != b"\x7fELF\x02\x01":
        raise UnknownObject
    table, n_sections, _ = struct.unpack_from(HEADER, code)
    sections = [Section(*struct.unpack_from(SECTION, code, table + 64 * n)) for n in range(n_sections)]
    places, n_fixed, size = _arrange(sections)
    memory = mmap.mmap(-1, size)
    base = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for number, at in places.items():
        section = sections[number]
        if section.kind != EMPTY:
            memory[at : at + section.size] = code[section.at : section.at + section.size]
    names, addresses = _find_symbols(code, sections, {number: base + at for number, at in places.items()})
    for section in sections:
        if section.kind == ADDENDS and section.info in places:
            _relocate(memory, (base, places[section.info]), code[section.at : section.at + section.size], addresses)
    if _process().mprotect(ctypes.c_void_p(base), ctypes.c_size_t(n_fixed), READ_EXECUTE):
        raise UnknownObject
    _mapped.append(memory)
    return addresses[names.index(name)]


def _find_symbols(code: bytes, sections: list[Section], starts: dict[int, int]) -> tuple[list[str], list[int]]:
    """Names and addresses of the symbols of an object whose sections begin at known addresses; 0 where there is none.

    Common symbols have none: they are numba's, for calls of the interpreter, and nothing in a kernel refers to them.
    """
    table = next(section for section in sections if section.kind == SYMBOLS)
    texts, names, addresses = sections[table.link].at, [], []
    for at_name, section, value in struct.iter_unpack(SYMBOL, code[table.at : table.at + table.size]):
        names.append(code[texts + at_name : code.index(b"\0", texts + at_name)].decode())
        if section in starts:
            addresses.append(starts[section] + value)
        else:
            addresses.append(_address(names[-1]) if section == UNDEFINED and names[-1] else 0)
    return names, addresses


def _arrange(sections: list[Section]) -> tuple[dict[int, int], int, int]:
    """Place of each section that is loaded, size of those that are not written, and size of all: whole pages."""
    places: dict[int, int] = {}
    size = n_fixed = 0
    for is_written in (False, True):
        for number, section in enumerate(sections):
            if section.flags & ALLOCATED and bool(section.flags & WRITABLE) is is_written:
                size = -(-size // max(section.align, 1)) * max(section.align, 1)
                places[number] = size
                size += section.size
        size = -(-max(size, 1) // mmap.PAGESIZE) * mmap.PAGESIZE
        n_fixed = n_fixed or size
    return places, n_fixed, size


def _relocate(memory: Any, at: tuple[int, int], table: bytes, addresses: list[int]) -> None:
    """Write the addresses that a section refers to; `at` is the memory's address and the section's place in it."""
    base, start = at
    for offset, kind, symbol, addend in struct.iter_unpack(RELOCATION, table):
        if kind not in FIELDS or not addresses[symbol]:
            raise UnknownObject
        size, is_relative = FIELDS[kind]
        place = start + offset
        value = addresses[symbol] + addend - (base + place if is_relative else 0)
        if size == 4 and not -(2**31) <= value < 2**31:
            raise UnknownObject
        memory[place : place + size] = (value % 2 ** (8 * size)).to_bytes(size, "little")


@cache
def _process() -> ctypes.CDLL:
    return ctypes.CDLL(None)


@cache
def _address(name: str) -> int:
    """Address of a function of the C library; of numba's run time only for kernels that allocate memory."""
    try:
        return ctypes.cast(_process()[name], ctypes.c_void_p).value or 0
    except AttributeError:
        return int(importlib.import_module("tts2face.numeric.compiler").symbol_address(name))


@cache
def _engine() -> Any:
    """LLVM's loader of object files."""
    llvm = importlib.import_module("llvmlite.binding")
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    machine_code = llvm.Target.from_default_triple().create_target_machine()
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine_code)


def _load_by_llvm(code: bytes, name: str) -> int:
    llvm = importlib.import_module("llvmlite.binding")
    for known in ("NRT_", "numba_"):
        if known.encode() in code:
            importlib.import_module("tts2face.numeric.compiler").symbol_address("NRT_Allocate")
    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return int(engine.get_function_address(name))
