"""Fuzzes the readers, guided by coverage: any bytes become a workpiece or one sentence.

    pip install atheris
    python benchmarks/fuzz_readers.py [--minutes 15] [--out FOLDER] [READER ...]

READER is excellon, gcode, kicad, dxf, csv or tsplib; all of them by default, one after
the other.  Each runs in a process of its own, starts from small seeds, keeps what reaches
new code in FOLDER/READER/corpus (so a second run goes on where the first stopped) and
what breaks a rule in FOLDER/READER/found, one file for each kind of failure.  The rules:

* a reader returns a workpiece, or raises ``InputError`` or ``UsageError`` in one line;
* a drill file that is read is written back byte for byte, and in any other order of its
  units it is the same work (the guard says so).

Findings become tests in ``tests/test_drill_fuzz.py`` and ``tests/test_fuzz_readers.py``.
Exit code 1 if anything was found.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import random
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path

HEAD = b"M48\nINCH,TZ\nT1C.02\nT2C.04\n%\nT1\n"
TSP = b"NAME: p\nTYPE: TSP\nDIMENSION: 3\nEDGE_WEIGHT_TYPE: "
KICAD = (
    b'(kicad_pcb (version 2) (via (at 1 2) (size 1) (drill 0.4)) (footprint "a" (at 5 6 90)'
    b' (pad "1" thru_hole oval (at -1 0.5) (drill oval 0.8 1.2)) (pad "" np_thru_hole circle'
    b" (at 1 0 45) (drill 3))) (module b (at 0 0 30) (pad 1 thru_hole rect (at 1 1) (drill 1))))"
)
DXF = (
    b"0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\n"
    b"ENTITIES\n0\nCIRCLE\n8\nvia\n10\n1.5\n20\n2.5\n40\n0.4\n0\nPOINT\n8\n0\n10\n3\n20\n4\n0\nENDSEC\n"
    b"0\nEOF\n"
)
SEEDS = {
    "excellon": [
        HEAD + b"X1Y1\nX2\nY3\nR2X5\nX1Y1G85X2Y2\nG00X1Y1\nM15\nG01X5\nM16\nG05\nT00\nM30\n",
        b"M48\nMETRIC\nT1C.5\n%\nT1\nX1.5Y2.25\nM25\nX3.Y4.\nM01\nM02X1.5M70\nM08\nX0.Y0.\nM30\n",
        HEAD
        + b"G91\nX1Y1\nX1\nG90\nX5Y5\nG00X1Y1\nM15\nG01X5\nG02X7Y1A3\nM16\nG05\nT2\nX1Y1\nM30\n",
        b";Holesize 1. = 40.0 Tolerance = +0.0/-0.0 PLATED MILS Quantity = 4\nX01Y01\nM00\nM30\n",
        b"M71\n%\nT1C.015F095S3\nX1Y1\n;FILE_FORMAT=4:4\nG93X0Y0\nG82X1Y1\nM30\n",
    ],
    "gcode": [
        b"G21 G90\nT1 M6\nG99 G81 X1. Y2 Z-1 R2 F100\nX5\nN3 Y7\nG80\nG0 X1\nG1 Z-1\nG0 Z2\nM30\n",
        b"%\nG20\nG91\nG81 X1 Y1 Z-1 R1\nX1 (a)\nG90\nG83 X1 Q.5 Z-1\nX2 ; b\nG80\n#1=2\nM2\n%\n",
    ],
    "kicad": [KICAD],
    "dxf": [DXF],
    "csv": [b"x,y\n1,2\n3,4\n", b"# units: inch\nid;X (mm);y_in\na;1,5;2\n", b"1 2 3\n4 5 6\n"],
    "tsplib": [
        TSP + b"EUC_2D\nNODE_COORD_SECTION\n1 0 0\n2 1.5 3\n3 4 4\nEOF\n",
        TSP + b"EXPLICIT\nEDGE_WEIGHT_FORMAT: UPPER_ROW\nEDGE_WEIGHT_SECTION\n1 2 3\nEOF\n",
        TSP
        + b"EXPLICIT\nEDGE_WEIGHT_FORMAT: FULL_MATRIX\nEDGE_WEIGHT_SECTION\n0 1 2 1 0 3 2 3 0\n",
    ],
}
SUFFIXES = {"kicad": ".kicad_pcb", "dxf": ".dxf", "csv": ".csv", "tsplib": ".tsp"}
LONGEST = 2_000


def drill_target(language: str) -> Callable[[bytes], None]:
    """Reads a drill file, writes it back, shuffles it, and compares."""
    from tcp.errors import InputError, UsageError
    from tcp.files import excellon, gcode
    from tcp.files.drilling import compare, reordered, reparse
    from tcp.files.excellon import Hints, Mark
    from tcp.files.excellon.blocks import folded
    from tcp.files.excellon.rewrite import Order, Turn

    module = gcode if language == "gcode" else excellon

    def target(data: bytes) -> None:
        hints = Hints(unfinished=len(data) % 2 == 0)
        try:
            program = module.parse(data, "f.drl", hints)
        except InputError as refusal:
            assert "\n" not in str(refusal) and len(str(refusal)) < 600
            return
        assert reordered(program, {}) == data, "written back it is another file"
        rng, orders, view = random.Random(0), {}, folded(program)
        for a, b in view.stretches():
            free = (view.rows.mark[a:b] & Mark.FREE) != 0
            turns = [Turn(a + i, bool(f) and rng.random() < 0.5) for i, f in enumerate(free)]
            rng.shuffle(turns)
            orders[a] = Order.of(turns)
        try:
            other = reordered(view, orders)
        except UsageError:
            return
        compare(program, reparse(other, program, Hints(unfinished=True)))

    return target


def file_target(suffix: str) -> Callable[[bytes], None]:
    """Reads a file of any other format."""
    from tcp.errors import InputError, UsageError
    from tcp.files import read

    path = Path(tempfile.mkdtemp()) / f"f{suffix}"

    def target(data: bytes) -> None:
        path.write_bytes(data)
        try:
            assert len(read(path).workpiece) >= 1
        except (InputError, UsageError) as refusal:
            assert "\n" not in str(refusal) and len(str(refusal)) < 600

    return target


def fuzz(reader: str, seconds: int, folder: Path) -> None:
    """Fuzz one reader in this process; libFuzzer ends the process when the time is up."""
    import atheris

    with atheris.instrument_imports(include=["tcp.files"]):
        for name in ("tcp.files", "tcp.files.drilling", *(f"tcp.files.{m}" for m in MODULES)):
            importlib.import_module(name)
    suffix = SUFFIXES.get(reader)
    target = drill_target(reader) if suffix is None else file_target(suffix)
    corpus, found = folder / reader / "corpus", folder / reader / "found"
    for place in (corpus, found):
        place.mkdir(parents=True, exist_ok=True)
    for i, seed in enumerate(SEEDS[reader]):
        (corpus / f"seed-{i}").write_bytes(seed)
    known: set[str] = set()

    def kept(data: bytes) -> None:
        """Run the target; keep the shortest input for each kind of failure, and go on."""
        try:
            target(data)
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            kind = f"{type(error).__name__}-{Path(last.filename).stem}-{last.lineno}"
            file = found / kind
            if kind not in known or len(data) < file.stat().st_size:
                known.add(kind)
                file.write_bytes(data)
                print(f"{reader}: {kind}: {str(error)[:120]} {data[:200]!r}", flush=True)

    options = [
        f"-max_total_time={seconds}",
        f"-max_len={LONGEST}",
        "-timeout=20",
        "-print_final_stats=1",
    ]
    logging.disable()
    atheris.Setup(["fuzz", *options, f"-artifact_prefix={found}/", str(corpus)], kept)
    atheris.Fuzz()


MODULES = ("csv", "tsplib", "kicad", "dxf", "excellon", "gcode")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("readers", nargs="*", metavar="READER", help=", ".join(SEEDS))
    parser.add_argument("--minutes", type=float, default=15.0, help="For each reader.")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/fuzz"))
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    readers = given.readers or list(SEEDS)
    if unknown := set(readers) - SEEDS.keys():
        parser.error(f"no reader {min(unknown)}; expected {', '.join(SEEDS)}")
    if given.here:
        fuzz(readers[0], round(60 * given.minutes), given.out)
    for reader in readers:
        words = [reader, "--here", "--minutes", str(given.minutes), "--out", str(given.out)]
        subprocess.run([sys.executable, __file__, *words], check=False)
    findings = [path for reader in readers for path in (given.out / reader / "found").glob("*")]
    print(f"{len(findings)} kinds of failure found", *findings, sep="\n  ")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
