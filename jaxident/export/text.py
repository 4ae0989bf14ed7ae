"""Numbers and words as they stand in files of other programs."""

import math
import re
from typing import Any

import numpy as np

from jaxident.errors import InputError
from jaxident.robot.model import Model

LONGEST = 200
"""Characters of a text from a model file that a comment keeps."""


def number(value: Any) -> str:
    """A finite number with all its digits, as Python, C, YAML 1.2, JSON and XML read it; InputError for another."""
    found = float(np.asarray(value))
    if not math.isfinite(found):
        raise InputError(f"the model holds the number {found}; an export needs finite ones")
    text = repr(found)
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def signed(value: Any) -> str:
    """`number`, in brackets where it is negative, so that it stands after any operator."""
    text = number(value)
    return f"({text})" if text.startswith("-") else text


def harmless(text: str) -> str:
    """Words from a model file for a comment of any language: letters, digits and a few signs; the rest becomes `_`."""
    kept = re.sub(r"[^A-Za-z0-9 .,:;()=+/-]", "_", text[:LONGEST])
    return re.sub(r"-{2,}", "-", kept).strip(" -")


def origin(model: Model) -> list[str]:
    """Lines for the head of a file: what wrote it, and where the model comes from."""
    found = model.provenance
    lines = ["Written by jaxident; units are SI unless told, commands in the unit of the model's logs."]
    if found.method:
        by = f" by version {harmless(found.version)}" if found.version else ""
        lines.append(f"The model: {harmless(found.method)}, from {len(found.logs)} logs{by}.")
    return lines
