"""Memory of this machine and of this process, by the operating system."""

import ctypes
import os
import sys
from ctypes import wintypes


class _MachineStatus(ctypes.Structure):
    """MEMORYSTATUSEX of Windows."""

    _fields_ = (
        ("length", wintypes.DWORD),
        ("load", wintypes.DWORD),
        *((name, ctypes.c_ulonglong) for name in ("total", "free", "total_page", "free_page")),
        *((name, ctypes.c_ulonglong) for name in ("total_virtual", "free_virtual", "free_extended")),
    )


class _ProcessCounters(ctypes.Structure):
    """PROCESS_MEMORY_COUNTERS of Windows."""

    _fields_ = (
        ("size", wintypes.DWORD),
        ("faults", wintypes.DWORD),
        *((name, ctypes.c_size_t) for name in ("peak", "now", "peak_paged", "paged", "peak_unpaged")),
        *((name, ctypes.c_size_t) for name in ("unpaged", "page_file", "peak_page_file")),
    )


def machine_memory() -> int:
    """Return the memory of this machine [bytes]."""
    if sys.platform == "win32":
        status = _MachineStatus()
        status.length = ctypes.sizeof(status)
        ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
        return int(status.total)
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def peak_memory() -> int:
    """Return the peak memory of this process [bytes]."""
    if sys.platform == "win32":
        counters = _ProcessCounters()
        counters.size = ctypes.sizeof(counters)
        kernel = ctypes.windll.kernel32
        kernel.GetCurrentProcess.restype = wintypes.HANDLE
        read = kernel.K32GetProcessMemoryInfo
        read.argtypes = (wintypes.HANDLE, ctypes.c_void_p, wintypes.DWORD)
        read(kernel.GetCurrentProcess(), ctypes.byref(counters), counters.size)
        return int(counters.peak)
    import resource  # Windows has none

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
