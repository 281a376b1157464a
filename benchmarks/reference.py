"""Results of Siconos on a stored problem: live, or as the file siconos.csv beside the problems says."""

import argparse
import csv
import json
import subprocess
from pathlib import Path

from benchmarks.report import Row
from moma.errors import MissingLibraryError, SolverError, UsageError

__all__ = ["Siconos"]


class Siconos:
    """What Siconos reached: live, or as the file beside the problems says."""

    def __init__(self, table: Path, options: argparse.Namespace) -> None:
        self._options = options
        self._rows: list[dict[str, str]] = []
        self.source = "not there"
        if options.siconos_python:
            self._check()
            self.source = f"live, {options.siconos_python}"
        elif table.exists():
            with table.open(newline="", encoding="utf-8") as file:
                self._rows = [row for row in csv.DictReader(file) if float(row["tol"]) == options.tolerance]
            self.source = f"{table.name}, one cold call each on another machine"

    def figures(self, path: Path) -> Row:
        """The fastest method that solved the problem, and the fastest NSGS."""
        methods = self._live(path) if self._options.siconos_python else self._stored(path.stem)
        solved = sorted(
            (one for one in methods if one["solved"]), key=lambda one: one["cpu"] or one["cpu_first"]
        )
        sweeping = [one for one in solved if one["method"].startswith("NSGS")]
        best, nsgs = next(iter(solved), None), next(iter(sweeping), None)
        return {
            "siconos_solved": len(solved),
            "siconos_tried": len(methods),
            "siconos_best": best and best["method"],
            "siconos_best_cpu": best and best["cpu"],
            "siconos_best_cpu_first": best and best["cpu_first"],
            "siconos_best_iterations": best and best["iterations"],
            "siconos_nsgs": nsgs and nsgs["method"],
            "siconos_nsgs_cpu": nsgs and nsgs["cpu"],
            "siconos_nsgs_cpu_first": nsgs and nsgs["cpu_first"],
            "siconos_nsgs_iterations": nsgs and nsgs["iterations"],
        }

    def _stored(self, name: str) -> list[Row]:
        return [
            {
                "method": row["solver"],
                "solved": row["solved"] == "1",
                "iterations": int(row["iterations"] or 0),
                "cpu": None,  # a file tells one cold call
                "cpu_first": float(row["cpu_s"] or "nan"),
            }
            for row in self._rows
            if row["problem"] == name
        ]

    def _live(self, path: Path) -> list[Row]:
        options, child = self._options, Path(__file__).with_name("siconos_child.py")
        command = [options.siconos_python, "-W", "ignore", str(child), str(path.resolve())]
        command += [repr(options.tolerance), str(options.max_iterations)]
        said: bytes
        complaint = b""
        try:
            done = subprocess.run(command, check=False, capture_output=True, timeout=options.siconos_limit)
            said, complaint = done.stdout, done.stderr
        except subprocess.TimeoutExpired as late:  # what had been solved by then counts
            said = late.stdout or b""
        lines = said.decode(errors="replace").splitlines()
        rows = [json.loads(line.removeprefix("ROW ")) for line in lines if line.startswith("ROW ")]
        if not rows and complaint:
            raise SolverError(
                complaint.decode(errors="replace").splitlines()[-1], where=f"Siconos on {path.stem}"
            )
        return rows

    def _check(self) -> None:
        python = self._options.siconos_python
        asked = [python, "-c", "import scipy.sparse, siconos.numerics"]
        try:
            found = subprocess.run(asked, check=False, capture_output=True).returncode == 0
        except OSError:
            raise UsageError("no such interpreter", where=f"--siconos-python {python}") from None
        if not found:
            remedy = "on Debian and Ubuntu, apt-get install python3-siconos python3-scipy"
            raise MissingLibraryError("siconos.numerics cannot be imported", where=python, remedy=remedy)
