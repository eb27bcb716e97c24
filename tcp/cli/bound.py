"""``tcp bound``: how short a route cannot be."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from tcp.cli.main import complain
from tcp.cli.options import READ, Problem, problem_options
from tcp.cli.terminal import PROOF, PROOF_ENDINGS, check_outputs, output_path, tell
from tcp.errors import Exit, InfeasibleError, TcpError, UsageError
from tcp.instance import Instance
from tcp.result import Status, decimal
from tcp.stop import Clock, Stop

EPILOG = """\b
Examples:
  tcp bound board.csv
  tcp bound --travel case2 --method lp --certificate board.cert.json.gz board.csv

\b
one-tree: Held-Karp ascent, for any number of holes in O(n) memory.
lp:       the linear programme of branch-and-cut without its branching, sharper,
          for up to several thousand holes.
Both are valid bounds in exact arithmetic whenever they are stopped; lp has none
before it has priced all pairs for the first time."""


@click.command(epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=READ)
@problem_options
@click.option(
    "--method", type=click.Choice(["one-tree", "lp"]), default="one-tree", show_default=True
)
@click.option("--time-limit", type=float, metavar="S", help="Seconds of wall time for each file.")
@click.option("--iterations", type=click.IntRange(1), help="one-tree: trees in the ascent.")
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="lp: source of randomness."
)
@click.option(
    "--certificate", type=click.Path(path_type=Path), help="Write the proof: .json or .json.gz."
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object a file, on one line.")
def command(
    problem: Problem, files: tuple[Path, ...], as_json: bool, certificate: Path | None, **how: Any
) -> int:
    """Prove a lower bound on every route of each FILE, without looking for the best route."""
    many = len(files) > 1
    proofs = [certificate and output_path(certificate, path, many, PROOF) for path in files]
    check_outputs([(proof, PROOF_ENDINGS) for proof in proofs if proof is not None], files)
    worst = Exit.OK
    for path, proof in zip(files, proofs, strict=True):
        try:
            reading = problem.read(path)
            tell(path, reading.notes)
            instance = problem.instance(reading)
            data = bounded(instance, proof, path, **how)
        except TcpError as error:
            worst = max(worst, complain(error))
            continue
        click.echo(json.dumps(data) if as_json else _sentence(data))
    return worst


def bounded(
    instance: Instance,
    proof: Path | None,
    source: Path,
    *,
    method: str,
    time_limit: float | None,
    iterations: int | None,
    seed: int,
) -> dict[str, Any]:
    """The bound of the instance in ``source`` by one of the methods, as plain data."""
    if method == "lp" and iterations is not None:
        raise UsageError("--iterations counts the trees of one-tree; lp has none")
    if proof is not None:
        from tcp.files.certifiable import certifiable

        certifiable(instance)
    clock = Clock(Stop(time=time_limit))
    if method == "lp":
        bound = _linear(instance, proof, source, time_limit, seed)
    else:
        bound = _one_tree(instance, proof, source, clock, iterations)
    return {
        "instance": instance.describe(),
        "method": method,
        "bound": None if bound is None else decimal(bound * instance.quantum),
        "quanta": bound,
        "seconds": round(clock.elapsed, 3),
        "certificate": None if proof is None else str(proof),
    }


def _one_tree(
    instance: Instance, proof: Path | None, source: Path, clock: Clock, iterations: int | None
) -> int:
    from tcp.bounds.evidence import bound_certificate, small_enough
    from tcp.bounds.one_tree import one_tree_bound

    if proof is not None:
        small_enough(instance)
    found = one_tree_bound(instance, iterations=iterations, clock=clock)
    if proof is not None:
        from tcp.files.certificate import write
        from tcp.validate.certificate import check

        # a refusal here is a bug of ours: it leaves no file behind, and exit code 70
        write(
            bound_certificate(instance, found),
            proof,
            lambda raw: check(raw, sha256=instance.sha256) and None,
            like=(source,),
        )
    return found.value


def _linear(
    instance: Instance, proof: Path | None, source: Path, limit: float | None, seed: int
) -> int | None:
    from tcp.solve import solve

    stop = Stop(time=limit, iterations=1)
    result = solve(
        instance, "branch-and-cut", stop=stop, seed=seed, certificate=proof, like=(source,)
    )
    if result.status is Status.INFEASIBLE:
        raise InfeasibleError(f"{instance.name}: no route satisfies its ends and rules (proved)")
    return result.bound


def _sentence(data: dict[str, Any]) -> str:
    about = data["instance"]
    if data["bound"] is None:
        return f"{about['name']}: no bound within the limit"
    return (
        f"{about['name']}: every route takes at least {data['bound']} s "
        f"({data['quanta']} quanta of {about['quantum']} s; {data['method']}, "
        f"{data['seconds']:.2f} s)"
    )
