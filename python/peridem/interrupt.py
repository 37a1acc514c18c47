"""Ctrl-C and SIGTERM as a wish that a run fulfils after the current step."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

__all__ = ["StopSignals", "Terminated"]


class Terminated(SystemExit):
    """SIGTERM has stopped the run; the program ends with code 143 unless this is caught."""

    def __init__(self) -> None:
        super().__init__(128 + signal.SIGTERM)


class StopSignals:
    """Within the ``with``, the first Ctrl-C or SIGTERM is only noted, a second one acts at once.

    Signals that the program ignores, and those of other than the main thread, are left alone.

    Parameters
    ----------
    active : bool
        Whether to note signals at all.

    Attributes
    ----------
    noted : int or None
        Number of the signal that has come.
    """

    def __init__(self, *, active: bool = True) -> None:
        self.noted: int | None = None
        self._active = active and threading.current_thread() is threading.main_thread()
        self._before: dict[int, Any] = {}

    def raise_noted(self) -> None:
        """Raise what a signal that has come stands for: KeyboardInterrupt or `Terminated`."""
        if self.noted == signal.SIGINT:
            raise KeyboardInterrupt
        if self.noted is not None:
            raise Terminated

    def __enter__(self) -> StopSignals:
        for number in (signal.SIGINT, signal.SIGTERM) if self._active else ():
            before = signal.getsignal(number)
            if before not in (signal.SIG_IGN, None):
                self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if kind is None:
            self.raise_noted()

    def _note(self, number: int, frame: FrameType | None) -> None:
        is_second = self.noted is not None
        self.noted = number
        if is_second:
            self.raise_noted()
