"""Memory as the operating system states it, where Windows lacks some of Python's modules too."""

import subprocess
import sys

from pipelines.tradeoff.memory import machine_memory, peak_memory

WITHOUT = """
import os, sys
for name in ("resource", "fcntl", "pwd", "grp", "termios"):
    sys.modules[name] = None
for name in ("sysconf", "sched_getaffinity", "fork", "getuid"):
    if hasattr(os, name): delattr(os, name)
import moma.cli, pipelines.tradeoff.study, pipelines.tradeoff.worker
"""


def test_peak_memory_lies_between_what_this_process_needs_and_what_there_is():
    before = peak_memory()
    block = bytearray(30_000_000)
    assert 10e6 < before < machine_memory()
    assert peak_memory() >= before
    assert len(block) == 30_000_000


def test_nothing_of_unix_is_loaded_where_it_is_absent():
    subprocess.run([sys.executable, "-c", WITHOUT], check=True)
