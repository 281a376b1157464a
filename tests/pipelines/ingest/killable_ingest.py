"""Ingests in processes of their own, which can be stopped at any moment; they start from one that has imported all."""

import multiprocessing
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path

from ground.errors import DatabaseError
from mechanics.dynamics.progress import Progress
from pipelines.ingest.ingest import ingest

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload(["tests.pipelines.ingest.one_ingest", "psycopg"])

PATIENCE = 60.0  # [s] for what takes a second on an idle machine


def wall_survey(path: Path, prefix: str, stones: int, at: float = 0.0) -> Path:
    """Write a survey file of a wall, twenty stones a course, each with its corners and four points."""
    lines = ["moma-survey 1", f"name wall {prefix}", "observer 4 -20 1", "sigma 0.003"]
    lines.append("depth * 0.4 source thickness of the wall")
    for number in range(stones):
        course, place = divmod(number, 20)
        x, z = at + 0.4 * place + 0.2 * (course % 2), 0.25 * course
        lines.append(f"stone {prefix}{number} {'header' if number % 3 else 'stretcher'} course {course + 1}")
        for u, v in ((0.0, 0.0), (0.39, 0.0), (0.39, 0.24), (0.0, 0.24)):
            lines.append(f"  vertex {x + u:.4f} 0.0000 {z + v:.4f}")
        for u, v in ((0.1, 0.1), (0.3, 0.1), (0.3, 0.2), (0.1, 0.2)):
            lines.append(f"  point {x + u:.4f} {0.001 * ((number + int(20 * u)) % 3):.4f} {z + v:.4f}")
        lines.append("end")
    path.write_text("\n".join(lines) + "\n")
    return path


def _take_in(survey: str, url: str, told: Connection) -> None:
    """Run an ingest; print when it starts, when it writes its first stone, and how it ends."""
    writing = False

    def listen(progress: Progress) -> None:
        nonlocal writing
        if not writing and progress.stage.startswith("store"):
            writing = True
            told.send("writing")

    told.send("started")
    try:
        ingest([survey], url, progress=listen)
    except DatabaseError as error:
        told.send(f"refused: {error}")
    else:
        told.send("done")


@dataclass
class Ingest:
    """An ingest in a process of its own, which has just started.

    Attributes
    ----------
    survey, url : what goes where
    said : what the process has told so far: started, writing, and done or refused
    """

    survey: Path
    url: str
    said: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._ours, theirs = _CONTEXT.Pipe(duplex=False)
        self._process: ForkServerProcess = _CONTEXT.Process(
            target=_take_in, args=(str(self.survey), self.url, theirs)
        )
        self._process.start()
        theirs.close()

    def wait_until(self, wanted: Callable[[str], bool]) -> bool:
        """Return True if the process printed the word before it ended."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if self.said and wanted(self.said[-1]):
                return True
            try:
                self.said.append(self._ours.recv())
            except EOFError:
                return False
        raise TimeoutError(f"nothing since {self.said}")

    def kill(self) -> None:
        """Send SIGKILL."""
        self._process.kill()
        self.end()

    def end(self) -> str:
        """Return the last word that it printed."""
        self.wait_until(lambda said: False)
        self._process.join(PATIENCE)
        self._process.close()
        self._ours.close()
        return self.said[-1] if self.said else ""
