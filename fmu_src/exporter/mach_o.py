"""One macOS library for several processors: FMI 2.0 has a single folder for macOS, darwin64.

The format is Apple's universal ("fat") binary, <mach-o/fat.h>: a header in big-endian order, then the libraries as
they are, each on a page boundary of its processor. Each keeps its own signature.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable

FAT_MAGIC = 0xCAFEBABE
MACH_O_64 = 0xFEEDFACF
PAGE_BITS = 14  # 16 KiB: the larger of the two processors' pages


def universal(libraries: Iterable[bytes]) -> bytes:
    """The libraries, 64-bit Mach-O for one processor each, as one file; raises ValueError for anything else."""
    # those for x86_64 first, as Apple's own tools do: old systems read no further
    ordered = sorted(libraries, key=_processor)
    if len({_processor(library) for library in ordered}) < len(ordered):
        raise ValueError("two libraries for one processor cannot share a file")
    page = 1 << PAGE_BITS
    header, content = struct.pack(">II", FAT_MAGIC, len(ordered)), b""
    offset = page
    for library in ordered:
        processor, variant = struct.unpack_from("<II", library, 4)
        header += struct.pack(">IIIII", processor, variant, offset, len(library), PAGE_BITS)
        padded = library + b"\0" * (-len(library) % page)
        content, offset = content + padded, offset + len(padded)
    end = len(content) - (-len(ordered[-1]) % page)  # nothing follows the last one
    return header.ljust(page, b"\0") + content[:end]


def _processor(library: bytes) -> int:
    magic: int
    processor: int
    magic, processor = struct.unpack_from("<II", library.ljust(8, b"\0"))
    if magic != MACH_O_64:
        raise ValueError(f"no 64-bit Mach-O library: it begins with {magic:#010x}")
    return processor
