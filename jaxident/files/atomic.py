"""Files that appear whole or not at all.

The content goes to a hidden file in the same folder, is forced to the disk and then takes the target's name in one
step. A pipe or a device (/dev/stdout) has no such step and is written as it stands. Who writes holds a lock on the
hidden file, which the system takes back from a process that dies: the next call in that folder removes what is left.
"""

import codecs
import contextlib
import errno
import fcntl
import gzip
import os
import pathlib
import re
import secrets
import time
from collections.abc import Iterator
from typing import BinaryIO

from jaxident.errors import InputError, WorkError

Target = str | os.PathLike[str]

GZIP_LEVEL = 6
FRESH = 2.0
"""Seconds in which a hidden file is nobody's left-over: it may be about to be locked. One from the future is old: the
clock was set back."""
_PART = re.compile(r"\.[0-9a-f]{16}\.part")
_FAILED_WORK = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}


def check_target(path: Target) -> None:
    """InputError unless a file of this name can be written; for commands that work long before they write."""
    with explained(path):
        _check(pathlib.Path(path))


def make_folder(path: Target) -> None:
    """Make a folder and those above it where they are missing; InputError where that cannot be."""
    if not os.fspath(path):
        raise InputError("the name of the folder is empty; give one, or . for this folder")
    with explained(path):
        try:
            os.makedirs(path, exist_ok=True)
        except (FileExistsError, NotADirectoryError):
            parts = (pathlib.Path(path), *pathlib.Path(path).parents)
            file = next((part for part in parts if part.exists() and not part.is_dir()), None)
            if file is None:
                raise
            raise InputError(f"{os.fspath(path)}: {file} is a file; give the name of a folder") from None


def write_text(path: Target, text: str) -> None:
    """Write a text file in UTF-8, gzipped if the name ends in .gz; errors as in `writing_bytes`."""
    with writing_text(path) as stream:
        stream.write(text)


def write_bytes(path: Target, content: bytes) -> None:
    """Write a binary file, gzipped if the name ends in .gz; errors as in `writing_bytes`."""
    with writing_bytes(path) as stream:
        stream.write(content)


@contextlib.contextmanager
def writing_text(path: Target) -> Iterator[codecs.StreamWriter]:
    """As `writing_bytes`, for text in UTF-8; line feeds stay as they are. Half characters, as names of files may hold,
    are written as a backslash and their number."""
    with writing_bytes(path) as stream:
        yield codecs.getwriter("utf-8")(stream, "backslashreplace")


@contextlib.contextmanager
def writing_bytes(path: Target) -> Iterator[BinaryIO]:
    """A stream whose content becomes the file `path` when the block ends well; gzipped if the name ends in .gz.

    If the block raises, nothing is left behind and an older file stays as it was. The gzip header holds neither
    name nor time, so that equal content gives equal files. Raises InputError where the target cannot be written
    (missing folder, no permission, a folder) and WorkError where writing fails (disk full). The block should only
    write: every OSError in it counts as one of the target.
    """
    with explained(path):
        target = pathlib.Path(path)
        _check(target)
        place = _in_place if target.exists() and not target.is_file() else _renamed
        with place(target) as raw, _packed(raw, target) as stream:
            yield stream


@contextlib.contextmanager
def _renamed(target: pathlib.Path) -> Iterator[BinaryIO]:
    """A hidden file beside the target, which takes its name in the end."""
    target = pathlib.Path(os.path.realpath(target))  # a link stays, and leads to the new content
    _remove_left(target.parent)
    hidden = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with open(hidden, "xb") as raw:
            _lock(raw)
            yield raw
            raw.flush()
            os.fsync(raw.fileno())
            os.replace(hidden, target)
    finally:
        hidden.unlink(missing_ok=True)


def _remove_left(folder: pathlib.Path) -> None:
    """Remove the hidden files of processes that died while they wrote here."""
    for left in folder.glob(".*.part"):
        if not (_PART.fullmatch(left.name) and left.is_file() and not left.is_symlink()):
            continue
        with contextlib.suppress(OSError), open(left, "rb") as raw:
            if _lock(raw) and abs(time.time() - os.fstat(raw.fileno()).st_mtime) > FRESH:
                left.unlink()


def _lock(raw: BinaryIO) -> bool:
    """Take the lock of an open file; False where another process holds it, or the file system knows no locks."""
    try:
        fcntl.flock(raw, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


@contextlib.contextmanager
def _in_place(target: pathlib.Path) -> Iterator[BinaryIO]:
    with open(target, "wb") as raw:
        yield raw


def _check(target: pathlib.Path) -> None:
    try:
        target.stat()
    except FileNotFoundError:
        if not target.parent.is_dir():
            raise InputError(f"{target}: the folder {target.parent} does not exist; make it first") from None
        writable = target.parent
    else:
        writable = target
    if target.is_dir():
        raise InputError(f"{target}: is a folder; give the name of a file")
    if not os.access(writable, os.W_OK):
        raise InputError(f"{target}: no permission to write {'this file' if writable == target else 'in its folder'}")


def _packed(raw: BinaryIO, target: pathlib.Path) -> contextlib.AbstractContextManager[BinaryIO]:
    """`raw` itself, or the stream that compresses into it."""
    if target.suffix != ".gz":
        return contextlib.nullcontext(raw)
    return gzip.GzipFile("", "wb", GZIP_LEVEL, raw, mtime=0)  # type: ignore[return-value]


@contextlib.contextmanager
def explained(path: Target, kept: str = "nothing was left behind") -> Iterator[None]:
    """OSError as one line: the work failed where the disk is full or broken, and `kept` says what is left; the name
    is wrong otherwise."""
    try:
        yield
    except OSError as error:
        reason = f"{os.fspath(path)}: cannot be written: {error.strerror or error}"
        if error.errno in _FAILED_WORK:
            raise WorkError(f"{reason}; {kept}") from error
        raise InputError(reason) from error
