"""Locks that let one of several test processes compile a kernel while the others wait for its cache."""

import os
import tempfile
from pathlib import Path


def compile_once() -> None:
    """Make the workers of one test run compile every kernel once between them.

    Kernels that call one another have no circles, so that processes which hold the lock of a kernel wait for those of
    its callees alone. Without file locks (Windows) each worker compiles its own.
    """
    try:
        import fcntl
    except ImportError:
        return
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.dispatcher import Dispatcher, NullCache

    folder = Path(tempfile.gettempdir()) / f"moma-kernel-locks-{os.getuid()}"
    folder.mkdir(exist_ok=True)
    compile_anywhere, held = Dispatcher.compile, set()

    def compile_alone(self, signature):
        name = f"{self.py_func.__module__}.{self.py_func.__qualname__}"
        with global_compiler_lock:
            if isinstance(self._cache, NullCache) or name in held:
                return compile_anywhere(self, signature)
            with (folder / name).open("w") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX)
                held.add(name)
                try:
                    return compile_anywhere(self, signature)
                finally:
                    held.discard(name)

    Dispatcher.compile = compile_alone
