"""A pytest plugin: the fixture ``drill_oracle`` judges routes in anybody's tests.

Installed with ``tcp`` as a ``pytest11`` entry point; nothing is imported until
a test asks for the fixture.  ``docs/oracle.md`` shows it in use.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from tcp.instance import Instance
    from tcp.oracle import Oracle
    from tcp.travel import Travel
    from tcp.workpiece import Workpiece

Route = str | Iterable[str | int]


def pytest_addoption(parser: pytest.Parser) -> None:
    """The ini settings ``drill_prove`` and ``drill_time_limit``."""
    parser.addini(
        "drill_prove", "prove optima that are not pinned (default true)", "bool", default=True
    )
    parser.addini("drill_time_limit", "seconds for such a proof (default 60)", default="60")


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker ``drill``."""
    config.addinivalue_line(
        "markers",
        "drill(file, travel=None, numbering='ids', closed=False, tool=None): the workpiece that "
        "the fixture drill_oracle judges routes of",
    )


@dataclass(frozen=True)
class DrillOracle:
    """Judges routes of a workpiece; the fixture ``drill_oracle``.

    Parameters
    ----------
    folder : path
        Folder of the test file: workpiece files are named relative to it.
    cache : path or None
        Where proofs of what is not pinned are kept; None proves nothing.
    time_limit : float
        Seconds for such a proof.
    instance : Instance or None
        The problem chosen by :meth:`on` or the marker ``drill``.
    numbering : str
        What entries of a route are: ``ids``, or numbers from ``0`` or ``1``.
    file : path or None
        The workpiece file.
    """

    folder: Path
    cache: Path | None
    time_limit: float
    instance: Instance | None = None
    numbering: str = "ids"
    file: Path | None = None

    def on(
        self,
        file: str | Path,
        travel: str | Travel | None = None,
        *,
        numbering: str = "ids",
        closed: bool = False,
        **how: Any,
    ) -> DrillOracle:
        """The oracle for one workpiece file and travel model; by default the file's own.

        ``how`` is for :func:`tcp.read`: ``tool="T3"``, ``units="inch"``.  What the reader notes,
        such as which of several tools it took, is a warning.
        """
        from tcp.files import read

        path = self.folder / file
        reading = read(path, **how)
        for note in reading.notes:
            warnings.warn(f"{path}: {note}", stacklevel=2)
        instance = self._instance(reading.workpiece, travel, closed, reading.travel)
        return replace(self, instance=instance, numbering=numbering, file=path)

    def assert_valid(self, route: Route) -> None:
        """Fail, with findings and repairs, unless ``route`` drills every hole exactly once."""
        __tracebackhide__ = True
        self._assert(route, None)

    def assert_optimal(self, route: Route, within: float = 0.0) -> None:
        """Fail unless ``route`` is valid and at most ``within`` (0.01 is 1 %) above the optimum."""
        __tracebackhide__ = True
        self._assert(route, Fraction(str(within)))

    def optimum(
        self, workpiece: str | Path | Workpiece, travel: str | Travel | None = None
    ) -> Fraction:
        """The certified optimal time of a workpiece (a file, or in memory)."""
        if isinstance(workpiece, (str, Path)):
            chosen = self.on(workpiece, travel)
            assert chosen.instance is not None
            return chosen._oracle().time(chosen.instance)
        return self._oracle().time(self._instance(workpiece, travel, False))

    def _instance(
        self,
        workpiece: Workpiece,
        travel: str | Travel | None,
        closed: bool,
        own: Travel | None = None,
    ) -> Instance:
        from tcp.files.reading import travel_as
        from tcp.instance import Ends, Instance
        from tcp.travel import parse_model

        if travel is None or isinstance(travel, str):
            travel = travel_as(own, None if travel is None else parse_model(travel))
        return Instance(workpiece, travel, Ends(closed=closed))

    def _oracle(self) -> Oracle:
        from tcp.oracle import FOLDER, Oracle

        files = () if self.file is None else (self.file,)
        homes = dict.fromkeys([*(file.parent for file in files), self.folder])
        return Oracle(tuple(h / FOLDER for h in homes), self.cache, self.time_limit, files)

    def _assert(self, route: Route, within: Fraction | None) -> None:
        __tracebackhide__ = True
        from tcp.oracle import judge
        from tcp.report.findings_text import text_page

        if self.instance is None:
            raise pytest.UsageError(
                "drill_oracle knows no workpiece: mark the test with "
                "@pytest.mark.drill('board.csv') or call drill_oracle.on('board.csv')"
            )
        known = None if within is None else self._oracle().known(self.instance)
        found = judge(self.instance, route, numbering=self.numbering, known=known, within=within)
        if found.failed():
            raise AssertionError("\n" + text_page(found, "all").rstrip())


@pytest.fixture
def drill_oracle(request: pytest.FixtureRequest) -> DrillOracle:
    """Judge of drill routes, set up by the marker ``drill`` or by ``drill_oracle.on(file)``."""
    config = request.config
    store = getattr(config, "cache", None)  # absent under -p no:cacheprovider
    cache = None
    if store is not None and config.getini("drill_prove"):
        cache = Path(store.mkdir("tcp-certificates"))
    limit = float(config.getini("drill_time_limit"))
    oracle = DrillOracle(Path(request.path).parent, cache, limit)
    marker: Any = request.node.get_closest_marker("drill")
    return oracle if marker is None else oracle.on(*marker.args, **marker.kwargs)
