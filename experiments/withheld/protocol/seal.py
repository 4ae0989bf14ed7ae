"""Seal answers so that nothing on the disk can tell them before they are opened.

SHA-256 of the answers is written first, as SEAL; then the answers, combined bit by bit with a keystream (SHAKE-256 of
a random key and nothing else: used once), replace the plain file. The key is a file that only the scorer is given.
"""

import hashlib
import pathlib
import secrets

import numpy as np

KEY_BYTES = 32


def seal(answers: pathlib.Path, folder: pathlib.Path, key: pathlib.Path) -> str:
    """Write FOLDER/SEAL and FOLDER/answers.sealed and the key, remove the plain answers; returns the SHA-256."""
    plain = answers.read_bytes()
    digest = hashlib.sha256(plain).hexdigest()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "SEAL").write_text(f"{digest}  answers.json\n")
    secret = secrets.token_bytes(KEY_BYTES)
    key.touch(mode=0o600)
    key.write_bytes(secret)
    (folder / "answers.sealed").write_bytes(combine(plain, secret))
    answers.unlink()
    return digest


def unseal(folder: pathlib.Path, key: pathlib.Path) -> bytes:
    """The answers as they were sealed; ValueError where they or the key are not those of SEAL."""
    plain = combine((folder / "answers.sealed").read_bytes(), key.read_bytes())
    expected = (folder / "SEAL").read_text().split()[0]
    if hashlib.sha256(plain).hexdigest() != expected:
        raise ValueError(f"{folder}/answers.sealed: not what SEAL says, or not this key")
    return plain


def combine(text: bytes, key: bytes) -> bytes:
    """Text exclusive-or keystream; its own inverse."""
    stream = hashlib.shake_256(b"withheld answers" + key).digest(len(text))
    return (np.frombuffer(text, np.uint8) ^ np.frombuffer(stream, np.uint8)).tobytes()
