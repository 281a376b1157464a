"""Whether tests depend on how a processor rounds: `python -m tests.rounding tests/mechanics/solvers --ways 20`.

Each way moves the corners of every stone, and the free velocities, biases and friction of every contact problem, by up
to four units in their last place, and runs the tests. What fails then passes by luck: as effects of rounding grow with
the rounding, a bound that holds here is a factor of three beyond it. Tests of exact numbers, and of impulses computed
by hand for the numbers that are moved, fail by design.
"""

import argparse
import os
import re
import subprocess
import sys
from collections import Counter
from typing import Any

import numpy as np

from mechanics.problem.problem import ContactProblem
from mechanics.scene.scene import Block

WAY = "MOMA_ROUNDING"  # the environment variable with the number of a way
UNITS = 4
MOVED = {Block: ("vertices",), ContactProblem: ("u_free", "bias", "friction")}


def perturb(way: int) -> None:
    """Move what scenes and problems are made of, from now on."""
    rng = np.random.default_rng(way)
    for kind, names in MOVED.items():
        kind.__init__ = moving(kind.__init__, names, rng)  # type: ignore[method-assign]


def moving(make: Any, names: tuple[str, ...], rng: np.random.Generator) -> Any:
    """Return a constructor that moves these fields; equal numbers of one field by equally much."""

    def made(self: Any, *values: Any, **named: Any) -> None:
        make(self, *values, **named)
        for name in names:
            found = np.asarray(getattr(self, name))
            different, places = np.unique(found, return_inverse=True)
            units = rng.integers(-UNITS, UNITS, len(different), endpoint=True)
            off = different * (1.0 + units * np.finfo(float).eps)
            object.__setattr__(self, name, off[places].reshape(found.shape))

    return made


def failures(tests: list[str], way: int | None) -> set[str]:
    """Return the tests that fail in one way; without a number, as they stand."""
    environment = {name: value for name, value in os.environ.items() if name != WAY}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rfE", "--tb=no", *tests],
        env=environment | ({} if way is None else {WAY: str(way)}),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode not in (0, 1):
        sys.exit(done.stdout + done.stderr)
    return set(re.findall(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE))


def main() -> None:
    """Print the tests that fail, and in how many ways."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--ways", type=int, default=20)
    parser.add_argument("--first", type=int, default=1, help="the number of the first way")
    options, tests = parser.parse_known_args()
    broken = failures(tests, None)
    found: Counter[str] = Counter()
    for way in range(options.first, options.first + options.ways):
        found.update(failures(tests, way) - broken)
    for test, count in found.most_common():
        print(f"{count:3d} of {options.ways}  {test}")
    print(f"{len(found)} tests fail in some way, {len(broken)} in any case")


if __name__ == "__main__":
    main()
