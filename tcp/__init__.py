"""Drill routes that come with a proof.

>>> import tcp
>>> holes = [("0", "0"), ("10", "0"), ("2.5", "0"), ("7", "4")]
>>> workpiece = tcp.Workpiece.from_decimals("bracket", holes)  # or tcp.read(path).workpiece
>>> result = tcp.solve(tcp.Instance(workpiece, tcp.Travel(tcp.Model.SIMULTANEOUS)), exact=True)
>>> result.ids, result.time, str(result.status)
(('1', '3', '4', '2'), Fraction(11, 1), 'optimal')

Whatever a caller can get wrong is a :class:`TcpError` with one sentence.  Judging and repairing
routes is :mod:`tcp.validate`, checking certificates :mod:`tcp.validate.certificate`.
"""

from tcp.errors import InputError, TcpError, UsageError
from tcp.files import Reading, read
from tcp.instance import Ends, Instance
from tcp.result import Progress, Proof, Result, Status
from tcp.rules import Balance, Rules
from tcp.solve import solve
from tcp.stop import Stop, StopReason
from tcp.travel import Model, Travel
from tcp.workpiece import Workpiece

__version__ = "0.1.0"

__all__ = [
    "Balance",
    "Ends",
    "InputError",
    "Instance",
    "Model",
    "Progress",
    "Proof",
    "Reading",
    "Result",
    "Rules",
    "Status",
    "Stop",
    "StopReason",
    "TcpError",
    "Travel",
    "UsageError",
    "Workpiece",
    "read",
    "solve",
]
