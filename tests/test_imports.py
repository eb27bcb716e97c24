"""What may be imported together, and what must not be imported too early."""

from __future__ import annotations

import subprocess
import sys

import pytest

ORTOOLS = "import ortools.sat.python.cp_model, ortools.constraint_solver.pywrapcp"
HIGHS = "import highspy; highspy.Highs().run()"


def python(*lines: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("order", [(ORTOOLS, HIGHS), (HIGHS, ORTOOLS)], ids=["or-hi", "hi-or"])
def test_ortools_and_highspy_share_a_process(order):
    """Both load a library called libhighs; highspy from 1.15 on breaks this in either order."""
    python(*order, "print('both')")


def test_importing_tcp_loads_no_solver():
    heavy = "{'ortools', 'pulp', 'highspy', 'numba', 'scipy', 'matplotlib', 'networkx'}"
    found = python("import sys, tcp", f"print(sorted({heavy} & set(sys.modules)))")
    assert found.strip() == "[]"


@pytest.mark.parametrize("command", ["solve", "optimize", "experiment", "info", "check"])
def test_the_help_of_a_command_loads_no_compiler(command):
    heavy = "{'ortools', 'pulp', 'highspy', 'numba', 'matplotlib', 'joblib', 'distributed'}"
    found = python(
        "import sys",
        "from click.testing import CliRunner",
        "from tcp.cli.main import main",
        f"assert CliRunner().invoke(main, ['{command}', '--help']).exit_code == 0",
        f"print(sorted({heavy} & set(sys.modules)))",
    )
    assert found.strip() == "[]"
