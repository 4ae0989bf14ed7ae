"""What goes wrong below the content of a file that is read, as one line."""

import contextlib
import gzip
import os
import zlib
from collections.abc import Iterator

from jaxident.errors import InputError

Source = str | os.PathLike[str]

LARGEST_TEXT = 1 << 24
"""Bytes of a model or study file; real ones have some thousands. A file without an end (/dev/zero) ends here."""


def read_text(path: Source, kind: str, largest: int = LARGEST_TEXT) -> str:
    """The whole of a file in UTF-8, with or without byte-order mark; `kind` is what it should be. InputError where it
    cannot be read or has more than `largest` bytes."""
    name = os.fspath(path)
    with explained(name, kind), open(path, "rb") as stream:
        content = stream.read(largest + 1)
        if len(content) > largest:
            raise InputError(f"{name}: has more than {largest} bytes; a {kind} file of this program is far smaller")
        return content.decode("utf-8-sig")


@contextlib.contextmanager
def explained(name: str, kind: str) -> Iterator[None]:
    """InputError in place of the errors of the operating system and of gzip; `kind` is what the file should be."""
    try:
        yield
    except FileNotFoundError:
        raise InputError(f"{name}: no such file") from None
    except IsADirectoryError:
        raise InputError(f"{name}: is a folder, not a {kind} file") from None
    except UnicodeDecodeError:
        raise InputError(f"{name}: is not a text file in UTF-8; it should be {kind}") from None
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{name}: damaged gzip file ({error}); copy it again") from error
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror or error}") from error
