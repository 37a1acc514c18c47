"""The process that runs gmsh: a hang, a crash, its signals and messages stay there.

It is started by the first mesh, serves this process one request after the other, and ends with
it. Requests and answers are pickles with their length in front.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import select
import struct
import subprocess
import sys
import threading
import time
from typing import IO, Any

from ..errors import InputError

_LENGTH = struct.Struct("<Q")
_FUNCTIONS = ("generate", "region_of_drawing")
_CLOSING = 1.0  # [s] that the process may take to end

_lock = threading.Lock()
_running: dict[int, subprocess.Popen[bytes]] = {}  # by the process that started it: forks


def ask(function: str, *arguments: Any, patience: float, what: str) -> Any:
    """Call a function of `peridem.meshing.generate` in the process that runs gmsh.

    Parameters
    ----------
    function : str
        Its name.
    *arguments
        Picklable.
    patience : float
        Time [s] after which it is given up.
    what : str
        What is asked for, for messages.

    Raises
    ------
    InputError
        That of the function; or if gmsh crashes or does not come to an end.
    """
    request = pickle.dumps((function, arguments))
    with _lock:
        process = _process()
        try:
            assert process.stdin is not None and process.stdout is not None
            _send(process.stdin, request)
            kind, answer = pickle.loads(_receive(process.stdout, patience))
        except TimeoutError:
            _stop(process)
            raise InputError(
                f"{what}: gmsh has not come to an end within {patience:.0f} s and was stopped; "
                "use another mesh_size or a simpler shape"
            ) from None
        except (EOFError, BrokenPipeError):
            code = _stop(process)
            raise InputError(
                f"{what}: gmsh has crashed (exit code {code}); use another mesh_size or a simpler "
                "shape, and check that its surface does not cross itself"
            ) from None
        except BaseException:  # Ctrl-C: the answer must not be taken for that of the next request
            _stop(process)
            raise
    if kind == "error":
        raise InputError(answer)
    return answer


def _process() -> subprocess.Popen[bytes]:
    process = _running.get(os.getpid())
    if process is None or process.poll() is not None:
        paths = os.pathsep.join(path for path in sys.path if path)
        process = subprocess.Popen(
            [sys.executable, "-c", "from peridem.meshing.worker import serve; serve()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1"},
            start_new_session=True,  # Ctrl-C is for the one who asks
        )
        _running[os.getpid()] = process
    return process


def _send(stream: IO[bytes], content: bytes) -> None:
    stream.write(_LENGTH.pack(len(content)) + content)
    stream.flush()


def _receive(stream: IO[bytes], patience: float) -> bytes:
    """Read an answer.

    Raises
    ------
    TimeoutError, EOFError
        If it does not come in time, or the process has ended.
    """
    end = time.monotonic() + patience
    (length,) = _LENGTH.unpack(_read(stream, _LENGTH.size, end))
    return _read(stream, length, end)


def _read(stream: IO[bytes], length: int, end: float) -> bytes:
    descriptor, content = stream.fileno(), bytearray()
    while len(content) < length:
        ready, _, _ = select.select([descriptor], [], [], max(0.0, end - time.monotonic()))
        if not ready:
            raise TimeoutError
        part = os.read(descriptor, min(length - len(content), 1 << 20))
        if not part:
            raise EOFError
        content += part
    return bytes(content)


def _stop(process: subprocess.Popen[bytes]) -> int:
    """End a process, whatever it does, and return its exit code."""
    with contextlib.suppress(OSError):
        if process.stdin is not None:
            process.stdin.close()
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(0.1)
    if process.poll() is None:
        process.kill()
    if process.stdout is not None:
        process.stdout.close()
    return process.wait()


@atexit.register
def close() -> None:
    """End the process that runs gmsh; the next mesh starts another."""
    with _lock:
        process = _running.pop(os.getpid(), None)
    if process is not None:
        assert process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_CLOSING)
        _stop(process)


def serve() -> None:
    """Answer requests from standard input until it is closed."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not get between the answers
    requests = sys.stdin.buffer
    while head := requests.read(_LENGTH.size):
        request = requests.read(*_LENGTH.unpack(head))
        try:
            answer: tuple[str, Any] = ("done", _called(request))
        except InputError as error:
            answer = ("error", str(error))
        _send(answers, pickle.dumps(answer))


def _called(request: bytes) -> Any:
    from . import generate

    function, arguments = pickle.loads(request)
    assert function in _FUNCTIONS
    return getattr(generate, function)(*arguments)
