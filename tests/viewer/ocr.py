"""Text of a screenshot, read by tesseract: words that a view should show and that are cut or covered."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterable

import cv2
import numpy as np

from tests.viewer.harness import Picture, cannot

SCALES = (2, 3, 4)
"""Magnifications, each tried if words are still missing: one reads characters that another does not."""
SHORTEST = 3
"""Shortest word that is looked for, in characters: shorter ones are often misread."""
LETTERS_A_MISTAKE = 5
"""Number of characters of a word for each that may be misread."""
COLORED = 40
"""Least difference between red, green and blue of marks, which are removed: text is white or grey."""
MARGIN_PX = 20
TOKEN = re.compile(r"[^\W_]+(?:\.\d+)?")
"""Word, or number without its sign."""
ALIKE = str.maketrans("oilszb|", "0115281")
"""Characters that are misread for each other."""


def need_tesseract() -> None:
    """Skip the test where tesseract is missing, or fail it where the viewer is required."""
    if shutil.which("tesseract") is None:
        cannot("no tesseract (Debian: tesseract-ocr)")


def missing_words(picture: Picture, expected: Iterable[str]) -> set[str]:
    """Words of the expected texts that cannot be read in a picture. A word that is cut is missing."""
    missing = {word for text in expected for word in words(text)}
    for scale in SCALES:
        if not missing:
            break
        read = words(_read(picture, scale))
        missing = {word for word in missing if not any(_is_same(word, one) for one in read)}
    return missing


def words(text: str) -> set[str]:
    """Words and numbers of a text that are long enough, without signs."""
    return {token for token in TOKEN.findall(text.lower()) if len(token) >= SHORTEST}


def _is_same(word: str, read: str) -> bool:
    """Whether a word was read: whole, with few characters mistaken, perhaps joined to its neighbour."""
    word, read = word.translate(ALIKE), read.translate(ALIKE)
    if len(word) > len(read):
        return False
    allowed = len(word) // LETTERS_A_MISTAKE
    starts = range(len(read) - len(word) + 1)
    return any(sum(map(str.__ne__, word, read[start:])) <= allowed for start in starts)


def _read(picture: Picture, scale: int) -> str:
    """Everything that tesseract reads in a picture of light text on a dark ground."""
    brightest, darkest = picture.max(axis=2), picture.min(axis=2)
    grey = np.where(brightest - darkest > COLORED, np.median(brightest), brightest).astype(np.uint8)
    large = 255 - cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    framed = np.pad(large, MARGIN_PX, mode="edge")
    sparse = ("--psm", "11", "--dpi", "200")
    command = ["tesseract", "stdin", "stdout", *sparse]
    png = cv2.imencode(".png", framed)[1].tobytes()
    environment = {**os.environ, "OMP_THREAD_LIMIT": "1"}  # its threads wait for each other
    done = subprocess.run(command, input=png, capture_output=True, check=True, timeout=60, env=environment)
    return done.stdout.decode()
