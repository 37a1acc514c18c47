"""Files that are whole or absent, and folders that can be written."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError

__all__ = ["cannot_write", "make_folder", "path_of", "replace_file"]


@contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """Write a file so that it is whole or absent under its name.

    The body of the ``with`` writes to the temporary name it is given, in the same
    folder. On success the file is synced to disk and renamed to `path` (an older file of
    that name is replaced); on any exception it is removed.

    Parameters
    ----------
    path : Path
        Final name.

    Yields
    ------
    Path
        Temporary name to write to.

    Raises
    ------
    InputError
        If the system refuses to write (no space, no permission), naming file and reason.
    """
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        yield temporary
        with temporary.open("rb+") as stream:
            os.fsync(stream.fileno())
        temporary.replace(path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise InputError(cannot_write(path, error.strerror or str(error))) from error
    except BaseException:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def path_of(value: object, where: str) -> Path:
    """Return a path, checked.

    Raises
    ------
    InputError
        If it is none.
    """
    if not isinstance(value, str | os.PathLike):
        raise InputError(f"{where} = {value!r:.60}: must be a path; give its name in quotes")
    return Path(value)


def make_folder(folder: Path) -> None:
    """Create an output folder when missing.

    Raises
    ------
    InputError
        If it cannot be created or is not writable.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"output folder {folder}: cannot be created: {error.strerror}; "
            "choose another folder (Output.Path, --output or output=)"
        ) from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(
            f"output folder {folder}: is not writable; "
            "change its permissions or choose another folder (Output.Path, --output or output=)"
        )


def cannot_write(path: Path, reason: str) -> str:
    """Say that a file could not be written, and what to do."""
    if path.is_dir():
        return (
            f"{path}: cannot be written: a folder has its name; rename or remove the folder, or "
            "choose another folder (Output.Path, --output or output=)"
        )
    return (
        f"{path}: cannot be written: {reason}; free some space or "
        "choose another folder (Output.Path, --output or output=)"
    )


def _sync_folder(folder: Path) -> None:
    """Sync the folder's entries, so that a rename survives a power cut (POSIX only)."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
