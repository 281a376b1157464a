"""One run of a pushed bed, in a process of its own that may be killed: FOLDER STEPS KILL_AFTER THREADS."""

import hashlib
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np

from mechanics.planar import delassus
from pipelines.run import unfinished
from pipelines.run.planar import run_planar
from tests.mechanics.planar.test_overlaps import pushed_bed


def main():
    folder, steps, last, threads = Path(sys.argv[1]), *map(int, sys.argv[2:])
    # parts of few contacts, so that threads have something to do
    delassus._THREAD_BATCH = 100
    unfinished.SHARE = np.inf
    assert threads == numba.config.NUMBA_NUM_THREADS
    bed = pushed_bed(20, 10, steps, 20, 0.002)
    bed = replace(bed, solver=replace(bed.solver, threads=threads), frame_every=10)

    def listen(report):
        if (report.stage, report.done) == ("step", last):
            os.kill(os.getpid(), signal.SIGKILL)

    result, warnings = run_planar(bed, folder, resume=True, every=5, progress=listen)
    assert not warnings
    parts = result.position, result.velocity, result.contacts.force, *vars(result.history).values()
    frames = [frame.position for frame in result.frames]
    print(
        hashlib.sha256(b"".join(np.ascontiguousarray(one).tobytes() for one in (*parts, *frames))).hexdigest()
    )


if __name__ == "__main__":
    main()
