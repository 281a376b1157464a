"""Tasks on the workers of a Dask scheduler, on one machine or many, that share a folder with this one.

A scheduler gives a task up once it has lost three workers (`allowed-failures`); a study must survive more.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from ground.errors import UsageError
from pipelines.assess.workers.pool import Lost, Work

_PATIENCE = 30.0
"""Time in which a scheduler must answer, and have a worker: those of a queue are started before the study [s]."""


@contextmanager
def cluster(
    address: str, work: Work, attempts: int = 1
) -> Iterator[Callable[[Sequence[Any]], Iterator[tuple[int, Any]]]]:
    """Yield a function that works on tasks by the workers of a scheduler, as `pool.workers` does by processes.

    Parameters
    ----------
    address : of the scheduler, as tcp://host:8786
    work : the function of a task, in a module that the workers have too
    attempts : workers that a task may lose before its answer is `Lost`

    Raises
    ------
    UsageError : Dask is not installed, no scheduler answers, or it has no worker
    """
    client = _client(address)
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    # a scheduler has no MOMA: functions within functions travel whole
    def survive(dask_scheduler: Any) -> None:
        """Let a task lose its workers as often as is allowed."""
        dask_scheduler.allowed_failures = max(dask_scheduler.allowed_failures, attempts - 1)

    def run(tasks: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Yield number and answer of each task, in the order in which they end."""
        futures = client.map(work, tasks, pure=False, key="sample", retries=0)
        numbers = {future.key: number for number, future in enumerate(futures)}
        for future in as_completed(futures, loop=client.loop):
            error = future.exception() if future.status == "error" else None
            if isinstance(error, KilledWorker):
                yield (
                    numbers[future.key],
                    Lost(f"{attempts} workers ended in its run, maybe for their memory"),
                )
            elif error is not None:
                raise error
            else:
                yield numbers[future.key], future.result()

    with client:
        client.run_on_scheduler(survive)
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except TimeoutError as error:
            raise UsageError(
                f"has no worker after {_PATIENCE:.0f} s",
                where=f"--scheduler {address}",
                remedy="start workers by `dask worker ADDRESS --nthreads 1`",
            ) from error
        yield run


def _client(address: str) -> Any:
    """Return the client of a scheduler that answers."""
    try:
        from distributed import Client
    except ImportError:
        raise UsageError(
            "a scheduler needs Dask, which is not installed",
            where="--scheduler",
            remedy="pip install 'moma-masonry[dask]', or give --workers or --part, which need nothing",
        ) from None
    try:
        return Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"no Dask scheduler answers: {error}",
            where=f"--scheduler {address}",
            remedy="start one by `dask scheduler`, and workers by `dask worker ADDRESS --nthreads 1`",
        ) from error
