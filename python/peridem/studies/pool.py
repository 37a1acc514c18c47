"""Processes of a study, each a fresh interpreter with its share of the processors."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any

from ..errors import InputError
from .parameters import Parameters
from .worker import Outcome

__all__ = ["pickled", "run_in_processes"]

_START = "import sys; from peridem.studies.worker import main; main(int(sys.argv[1]))"
_THREADS = ("PERIDEM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_GRACE = 5.0
"""Seconds that a process has to end after it was asked to."""

Task = tuple[str, Parameters, Mapping[str, Any]]
"""Id, parameters, more arguments."""


def pickled(run: Callable[..., Any]) -> bytes:
    """Pickle a function for other processes: by value where it cannot be imported.

    Raises
    ------
    InputError
        If it, or something that it uses, cannot be pickled.
    """
    import cloudpickle

    try:
        return bytes(cloudpickle.dumps(run))
    except (TypeError, pickle.PicklingError, AttributeError, RuntimeError) as error:
        raise InputError(
            f"study: {run!r}: cannot be sent to another process ({error}); make what it needs "
            "inside the function, or set workers=0"
        ) from error


def run_in_processes(
    function: bytes, tasks: Sequence[Task], workers: int, threads: int
) -> Generator[tuple[str, Outcome]]:
    """Run a function for many sets of parameters; yield rows as they come.

    A process that dies gives a failed row, and another one takes its place. When the generator
    is closed, or raises, all processes are ended.

    Parameters
    ----------
    function : bytes
        The function, pickled.
    tasks : sequence of (str, dict, mapping)
        What to run.
    workers, threads : int
        Number of processes, and of threads in each.

    Yields
    ------
    (str, dict)
        Id and row.

    Raises
    ------
    InputError
        If the function cannot be loaded in a process.
    """
    waiting = deque(tasks)
    busy: dict[Connection, _Worker] = {}
    try:
        for _ in range(min(workers, len(tasks))):
            worker = _Worker(function, threads)
            busy[worker.pipe] = worker
        while busy:
            for pipe in wait(list(busy)):
                assert isinstance(pipe, Connection)
                worker = busy.pop(pipe)
                id_, outcome = worker.answer()
                if worker.dead:
                    worker.end()
                    if waiting:
                        worker = _Worker(function, threads)
                        busy[worker.pipe] = worker
                elif waiting:
                    worker.take(waiting.popleft())
                    busy[pipe] = worker
                else:
                    worker.end()
                if id_ is not None:
                    yield id_, outcome
    finally:
        for worker in busy.values():
            worker.ask_to_end()
        for worker in busy.values():
            worker.end()


class _Worker:
    """A process and what it is doing."""

    def __init__(self, function: bytes, threads: int) -> None:
        self.pipe, child = Pipe()
        self.task: Task | None = None
        self.dead = False
        environment = os.environ | dict.fromkeys(_THREADS, str(threads))
        paths = [os.path.abspath(one or ".") for one in sys.path]  # noqa: PTH100
        environment["PYTHONPATH"] = os.pathsep.join(paths)
        self._process = subprocess.Popen(
            [sys.executable, "-c", _START, str(child.fileno())],
            stdin=subprocess.PIPE,
            pass_fds=[child.fileno()],
            env=environment,
        )
        child.close()
        self.pipe.send((paths, sys.argv, os.getcwd(), function))  # noqa: PTH109

    def take(self, task: Task) -> None:
        """Start on a task."""
        self.task = task
        self.pipe.send(task[1:])

    def answer(self) -> tuple[str | None, Outcome]:
        """Receive what the process says: a row, or that it is ready."""
        task, self.task = self.task, None
        try:
            said = self.pipe.recv()
        except (EOFError, OSError):
            self.dead = True
            text = self._last_words()
            if task is None:
                raise InputError(
                    f"study: a process {text} before it could start; see above"
                ) from None
            return task[0], {"status": "failed", "error": f"the process {text}", "seconds": ""}
        if task is not None:
            return task[0], said
        if said is not None:
            raise InputError(
                f"study: the function cannot be loaded in another process ({said}); make it "
                "importable, or set workers=0"
            )
        return None, {}

    def _last_words(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_GRACE)
        code = self._process.returncode
        if code is not None and code < 0:
            return f"was ended by signal {-code} ({signal.Signals(-code).name})"
        return f"ended with code {code}"

    def ask_to_end(self) -> None:
        """Ask the process to end after its current step."""
        with contextlib.suppress(OSError):
            self._process.terminate()

    def end(self) -> None:
        """Wait for the process to end; kill it when it takes long."""
        self.pipe.close()
        try:
            self._process.wait(_GRACE)
        except (subprocess.TimeoutExpired, KeyboardInterrupt):
            self._process.kill()
            self._process.wait()
        finally:
            if self._process.stdin is not None:
                self._process.stdin.close()
