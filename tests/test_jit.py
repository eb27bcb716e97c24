"""Compiled kernels: never stale, wherever what they are made of was changed."""

from __future__ import annotations

import ast
import importlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import njit
from numba.core import caching
from numba.core.errors import TypingError

import tcp
from tcp import jit
from tcp.heuristics.local_search import warm_up

PACKAGE = Path(tcp.__file__).parent
CALL = "from tcp.call import call; print(call(1), sum(call.stats.cache_hits.values()))"
ON_DISK = "from tcp import jit; from tcp.call import call; print(jit.on_disk(call))"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package ``tcp`` of one kernel, of what it takes from other files, and of a bystander."""
    package = tmp_path / "tcp"
    package.mkdir()
    shutil.copy(PACKAGE / "jit.py", package)
    files = {
        "__init__": "",
        "bystander": "SIZE = 1\n",
        "constant": "from tcp.jit import kernel\nSTEP = 10\n",
        "callee": "from tcp.jit import kernel\n@kernel\ndef callee(k):\n    return k + 100\n",
        "call": (
            "from tcp.callee import callee\nfrom tcp.constant import STEP\n"
            "from tcp.jit import kernel\n@kernel\ndef call(k):\n    return callee(k) + STEP\n"
        ),
    }
    for name, text in files.items():
        (package / f"{name}.py").write_text(text)
    return package


def told(package: Path, program: str) -> list[str]:
    """What a program prints that has only this package, in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=package.parent,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


def call(package: Path) -> tuple[int, int]:
    """What the kernel answers in a process of its own, and how often the cache served it."""
    value, hits = told(package, CALL)
    return int(value), int(hits)


@pytest.mark.parametrize(
    ("file", "old", "new", "value"),
    [("constant", "10", "20", 121), ("callee", "100", "300", 311), ("call", "STEP\n", "5\n", 106)],
)
def test_a_kernel_follows_what_is_changed_in_any_file_of_kernels(package, file, old, new, value):
    assert call(package) == (111, 0)
    assert call(package) == (111, 1)
    path = package / f"{file}.py"
    text = path.read_text()
    path.write_text(new.join(text.rsplit(old, 1)))
    assert call(package) == (value, 0)
    assert call(package) == (value, 1)
    path.write_text(text)
    assert call(package) == (111, 0)


def test_other_files_do_not_make_kernels_compile_again(package):
    call(package)
    (package / "bystander.py").write_text("SIZE = 2\n")
    assert call(package) == (111, 1)


def test_where_no_cache_can_be_written_kernels_are_compiled_in_memory(monkeypatch):
    monkeypatch.setattr(caching.CompileResultCacheImpl, "_locator_classes", [])

    @jit.kernel
    def twice(k):
        return 2 * k

    assert twice(21) == 42


def kernels(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    decorators = {
        "kernel",
        "lean",
        "formula",
        "allocating",
        "compiled",
        "inner",
        "inlined",
        "cached",
    }
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and decorators & {
            name.id
            for decorator in node.decorator_list
            for name in ast.walk(decorator)
            if isinstance(name, ast.Name)
        }:
            yield node


def strangers(source: str, stamped: set[str]) -> set[str]:
    """Names in the bodies of kernels that come from modules of ours outside ``stamped``."""
    tree = ast.parse(source)
    ours = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "tcp"
        for alias in node.names
        if node.module not in stamped
    }
    return ours & {
        name.id
        for function in kernels(tree)
        for statement in function.body
        for name in ast.walk(statement)
        if isinstance(name, ast.Name)
    }


def test_kernels_use_only_what_the_stamp_of_their_cache_covers():
    texts = {
        ".".join(("tcp", *path.relative_to(PACKAGE).with_suffix("").parts)): path.read_text()
        for path in PACKAGE.rglob("*.py")
    }
    stamped = {name for name, text in texts.items() if "from tcp.jit import" in text}
    assert len(stamped) > 20
    assert {name: found for name in stamped if (found := strangers(texts[name], stamped))} == {}
    assert {name for name, text in texts.items() if "numba import" in text and "njit" in text} == {
        "tcp.jit"
    }


def test_a_name_from_elsewhere_in_a_kernel_is_seen():
    source = (
        "from tcp.jit import kernel\nfrom tcp.travel import QUANTUM\n"
        "@kernel\ndef f(k):\n    return k + QUANTUM\n"
    )
    assert strangers(source, {"tcp.jit"}) == {"QUANTUM"}


def lean_kernels() -> Iterator[tuple[str, Any]]:
    """Every kernel that counts no references, by its full name."""
    for path in sorted(PACKAGE.rglob("*.py")):
        if b"from tcp.jit import" not in path.read_bytes() or path.name == "jit.py":
            continue
        module = importlib.import_module(
            ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        )
        for name, value in vars(module).items():
            options = getattr(value, "targetoptions", {})
            if options.get("_nrt") is False and value.__module__ == module.__name__:
                yield f"{module.__name__}.{name}", value


def test_lean_kernels_return_no_arrays():
    """What called a lean kernel holds the arrays; one it returned would be freed too early."""
    warm_up()
    compiled = {name: kernel.nopython_signatures for name, kernel in lean_kernels()}
    assert len(compiled) > 50
    assert compiled["tcp.heuristics.local_search.kicks.kick_and_repair"]
    for name, signatures in compiled.items():
        for signature in signatures:
            assert "array" not in str(signature.return_type).lower(), name


def test_numba_refuses_a_lean_kernel_that_makes_an_array():
    @jit.lean
    def make(n):
        return np.zeros(n)[0]

    with pytest.raises(TypingError, match="zeros"):
        make(3)


def test_a_kernel_is_on_disk_until_a_file_with_kernels_changes(package):
    assert told(package, ON_DISK) == ["False"]
    call(package)
    assert told(package, ON_DISK) == ["True"]
    (package / "constant.py").write_text("from tcp.jit import kernel\nSTEP = 20\n")
    assert told(package, ON_DISK) == ["False"]


def test_a_kernel_without_a_cache_counts_as_on_disk():
    assert jit.on_disk(njit(lambda k: k))
    assert jit.on_disk(lambda k: k)  # numba switched off
