"""What the pages for people are made of."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.conftest import PROJECT_ROOT


def block_with(text: str, word: str, language: str = "") -> str:
    """The one code block of a language in a page that contains a word."""
    blocks = re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    (found,) = [block for block in blocks if word in block]
    return found


@pytest.fixture
def beside_the_build(tmp_path: Path) -> Path:
    """A folder from which `build/` and the commands are found as from the project's own."""
    (tmp_path / "build").symlink_to(PROJECT_ROOT / "build")
    return tmp_path
