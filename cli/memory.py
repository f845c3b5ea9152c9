"""Memory that a command gives back to the system when it is no longer needed."""

import ctypes
import sys

TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # names of mallopt's parameters in glibc's malloc.h
LARGE_BYTES = 1 << 20  # arrays from this size on are mapped one by one; pictures of 512 x 512 stay below


def return_large_blocks() -> bool:
    """Have the C library return large freed blocks to the system; False where it has no such setting.

    By default glibc raises the size from which blocks are returned, up to 32 MB, when one is freed, and then keeps what
    temporary arrays took, once for every thread: some 100 MB of a clip (docs/performance.md).
    """
    if not sys.platform.startswith("linux"):
        return False
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)  # glibc
    if set_option is None:
        return False
    return all(set_option(option, LARGE_BYTES) == 1 for option in (MMAP_THRESHOLD, TRIM_THRESHOLD))
