"""Fixtures that several test modules share."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)  # a slow machine is no failure
settings.load_profile("untimed")


@pytest.fixture(scope="session")
def corpus() -> Path:
    """The folder of real boards and instances; tests that need it skip where it is absent."""
    root = Path(__file__).resolve().parents[1]
    folder = Path(os.environ.get("TCP_CORPUS", root.parent / "shared" / "corpus"))
    if not folder.is_dir():
        pytest.skip(f"the corpus of real files is not here ({folder}); set TCP_CORPUS")
    return folder


@pytest.fixture(scope="session")
def unstated() -> dict[str, dict[str, str]]:
    """Options that the corpus' boards need, by file name, where they do not state everything."""
    text = (Path(__file__).parent / "files" / "board_hints.toml").read_text()
    return tomllib.loads(text)
