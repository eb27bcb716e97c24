"""Drill routes that come with a proof.

>>> import tcp
>>> workpiece = tcp.Workpiece.from_decimals("two", [("0", "0"), ("3.5", "4")])
>>> len(workpiece)
2
"""

from tcp.instance import Ends, Instance
from tcp.result import Proof, Result, Status
from tcp.rules import Balance, Rules
from tcp.solve import solve
from tcp.stop import Stop, StopReason
from tcp.travel import Model, Travel
from tcp.workpiece import Workpiece

__version__ = "0.1.0"

__all__ = [
    "Balance",
    "Ends",
    "Instance",
    "Model",
    "Proof",
    "Result",
    "Rules",
    "Status",
    "Stop",
    "StopReason",
    "Travel",
    "Workpiece",
    "solve",
]
