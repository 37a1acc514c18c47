"""Files written by a thread of their own, while the run that they are about goes on."""

from __future__ import annotations

import threading
import time as clock
from collections import deque
from collections.abc import Callable
from types import TracebackType

from .errors import NumericalError

__all__ = ["BackgroundWriter"]

Job = Callable[[], object]


class BackgroundWriter:
    """One thread that does jobs in the order in which they come, for a ``with`` around each run.

    A job is a function that holds copies of all it needs. One is at work and at most one waits,
    so that the copies take bounded memory; whoever brings a third waits for its turn.

    Leaving the ``with`` waits for all jobs. Only an interrupt, such as a second Ctrl-C, gives up
    those that are not begun; the one at work is always finished.

    Attributes
    ----------
    seconds_waited : float
        Wall-clock time [s] that runs have waited for jobs.
    """

    def __init__(self) -> None:
        self.seconds_waited = 0.0
        self._jobs: deque[Job] = deque()
        self._at_work = False
        self._closed = False
        self._failure: BaseException | None = None
        self._change = threading.Condition()
        self._thread: threading.Thread | None = None

    def submit(self, take: Callable[[], Job]) -> None:
        """Queue a job.

        Parameters
        ----------
        take : callable
            Called here, once there is room: copies what the job needs and returns the job.

        Raises
        ------
        Exception
            What an earlier job has raised; jobs behind it are not done.
        """
        self._wait_until(lambda: not self._jobs)
        self.check()
        job = take()
        with self._change:
            self._jobs.append(job)
            self._change.notify_all()
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="peridem output")
            self._thread.start()

    def check(self) -> None:
        """Raise what a job has raised, if one has."""
        if self._failure is not None:
            raise self._failure

    def wait(self) -> None:
        """Wait until all jobs are done, and raise what one of them has raised."""
        self.settle()
        self.check()

    def settle(self) -> None:
        """Wait until all jobs are done; what they have raised is left for later."""
        self._wait_until(lambda: not self._jobs and not self._at_work)

    def _wait_until(self, ready: Callable[[], bool]) -> None:
        begin = clock.perf_counter()
        with self._change:
            self._change.wait_for(ready)
        self.seconds_waited += clock.perf_counter() - begin

    def _work(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._jobs or self._closed)
                if not self._jobs:
                    return
                job = self._jobs.popleft()
                self._at_work = True
                self._change.notify_all()
            failure = None
            try:
                job()
            except BaseException as error:  # it is raised where the run is
                failure = error
            del job  # with its copies
            with self._change:
                self._at_work = False
                if failure is not None:
                    self._failure = failure
                    self._jobs.clear()
                self._change.notify_all()

    def _close(self, *, finish: bool) -> None:
        """End the thread, with or without the jobs that wait."""
        with self._change:
            if not finish:
                self._jobs.clear()
            self._closed = True
            self._change.notify_all()
        if self._thread is not None:
            begin = clock.perf_counter()
            self._thread.join()
            self.seconds_waited += clock.perf_counter() - begin

    def __enter__(self) -> BackgroundWriter:
        self._closed, self._failure, self._thread = False, None, None
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        finish = error is None or isinstance(error, Exception)
        try:
            self._close(finish=finish)
        except BaseException:  # an interrupt while waiting
            self._close(finish=False)
            raise
        if error is None:
            self.check()
        elif isinstance(error, NumericalError) and self._failure is not None:
            raise NumericalError(f"{error}\n{self._failure}") from error
