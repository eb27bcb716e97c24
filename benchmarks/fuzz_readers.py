"""Fuzzes the readers, guided by coverage: any bytes become a workpiece or one sentence.

    pip install atheris
    python benchmarks/fuzz_readers.py [--minutes 15] [--out FOLDER] [--results FILE] [READER ...]

READER is excellon, gcode, kicad, dxf, csv or tsplib; all of them by default, one after
the other.  Each runs in a process of its own, starts from small seeds, keeps what reaches
new code in FOLDER/READER/corpus (so a second run goes on where the first stopped) and
what breaks a rule in FOLDER/READER/found, one file for each kind of failure.  The rules:

* a reader returns a workpiece, or raises ``InputError`` or ``UsageError`` in one line;
* a drill file that is read is written back byte for byte, and in any other order of its units
  (and, Excellon, with its repeats written out) it is the same work: the guard says so.

Findings become tests in ``tests/test_drill_fuzz.py`` and ``tests/test_fuzz_readers.py``; what was
found before and now keeps the rules is removed first.  What was run (seconds, executions, kinds of
failure, versions) is kept in FILE, reader by reader.

Exit code 0 if every reader was fuzzed and nothing was found, 1 if something was found, 2 if atheris
is missing, 3 if a fuzzer ended before its time.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
import logging
import random
import re
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tcp.files.excellon import Program
    from tcp.files.excellon.rewrite import Order

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
    """Reads a drill file, writes it back, shuffled, and hole by hole, and compares."""
    from tcp.errors import InputError, UsageError
    from tcp.files import excellon, gcode
    from tcp.files.drilling import compare, reordered, reparse
    from tcp.files.excellon import Hints
    from tcp.files.excellon.blocks import folded
    from tcp.files.excellon.edit import expand

    module = gcode if language == "gcode" else excellon

    def target(data: bytes) -> None:
        hints = Hints(unfinished=len(data) % 2 == 0)
        try:
            program = module.parse(data, "f.drl", hints)
        except InputError as refusal:
            assert "\n" not in str(refusal) and len(str(refusal)) < 600
            return
        assert reordered(program, {}) == data, "written back it is another file"
        rng = random.Random(0)
        for view in (folded(program), program):
            try:
                other = reordered(view, shuffled(view, rng))
            except UsageError:
                continue
            compare(program, reparse(other, program, Hints(unfinished=True)))
        if language == "excellon" and program.times().sum() < 20_000:
            written, _ = expand(program)
            compare(program, reparse(written, program, Hints(unfinished=True)), text="free")

    return target


def shuffled(program: Program, rng: random.Random) -> dict[int, Order]:
    """Each stretch in a random order, what may be turned turned at random."""
    from tcp.files.excellon import Mark
    from tcp.files.excellon.rewrite import Order, Turn

    orders = {}
    for a, b in program.stretches():
        free = (program.rows.mark[a:b] & Mark.FREE) != 0
        turns = [Turn(a + i, bool(f) and rng.random() < 0.5) for i, f in enumerate(free)]
        rng.shuffle(turns)
        orders[a] = Order.of(turns)
    return orders


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


def keeps_the_rules(target: Callable[[bytes], None], data: bytes) -> bool:
    """Whether an input that once broke a rule does so no more."""
    try:
        target(data)
    except Exception:
        return False
    return True


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
    for file in found.iterdir():
        if keeps_the_rules(target, file.read_bytes()):
            file.unlink()
            print(f"{reader}: mended since: {file.name}", flush=True)

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
DONE = re.compile(r"Done (\d+) runs in (\d+) second")


def run(reader: str, words: list[str]) -> dict[str, Any]:
    """Fuzz one reader in a process of its own; what it says about itself at its end."""
    command = [sys.executable, __file__, reader, "--here", *words]
    row: dict[str, Any] = {"seconds": 0, "executions": 0}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, errors="replace") as child:
        assert child.stderr is not None
        for line in child.stderr:
            sys.stderr.write(line)
            if done := DONE.match(line):
                row = {"seconds": int(done[2]), "executions": int(done[1])}
    whole = row["executions"] and child.returncode == 0
    return row | {"ended": "in time" if whole else f"early, code {child.returncode}"}


def keep(rows: dict[str, dict[str, Any]], file: Path) -> None:
    """Put the rows of these readers in the place of their last ones."""
    table = json.loads(file.read_text()) if file.exists() else {}
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(table | rows, indent=1, sort_keys=True) + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("readers", nargs="*", metavar="READER", help=", ".join(SEEDS))
    parser.add_argument("--minutes", type=float, default=15.0, help="For each reader.")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/fuzz"))
    parser.add_argument("--results", type=Path, default=Path("benchmarks/results/fuzz.json"))
    parser.add_argument("--here", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    readers = given.readers or list(SEEDS)
    if unknown := set(readers) - SEEDS.keys():
        parser.error(f"no reader {min(unknown)}; expected {', '.join(SEEDS)}")
    if importlib.util.find_spec("atheris") is None:
        print("fuzzing needs atheris, which is not installed: pip install atheris", file=sys.stderr)
        return 2
    if given.here:
        fuzz(readers[0], round(60 * given.minutes), given.out)
    return report(readers, given)


def report(readers: list[str], given: argparse.Namespace) -> int:
    """Fuzz the readers one after the other, print and keep what came of it."""
    from tcp.solve import versions

    rows = {}
    for reader in readers:
        row = run(reader, ["--minutes", str(given.minutes), "--out", str(given.out)])
        found = sorted((given.out / reader / "found").glob("*"))
        corpus = len(list((given.out / reader / "corpus").glob("*")))
        libraries = versions(("atheris", *(["ezdxf"] if reader == "dxf" else [])))
        row |= {"corpus": corpus, "found": [file.name for file in found], "versions": libraries}
        rows[reader] = row
        keep(rows, given.results)
    for reader, row in rows.items():
        ran = f"{row['seconds']:,} s, {row['executions']:,} executions, ended {row['ended']}"
        print(f"{reader}: {ran}; {len(row['found'])} kinds of failure found")
        for name in row["found"]:
            print(f"  {given.out / reader / 'found' / name}")
    if any(row["ended"] != "in time" for row in rows.values()):
        return 3
    return 1 if any(row["found"] for row in rows.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
