"""What a claims file may hold: one table from which reader and JSON Schema follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

FORMAT = "tcp-claims-1"


@dataclass(frozen=True)
class Field:
    """One key of a claims file.

    Parameters
    ----------
    type : str
        ``text``, ``texts``, ``number`` (with the digits as printed), ``whole``,
        ``flag``, ``sequence``, ``formula``, ``figures`` (a table of texts or
        numbers), ``point``, ``choices``, ``value`` (a number or a list of
        whole numbers).
    doc : str
        What it means.
    required : bool
        Whether every claim of the kind has it.
    """

    type: str
    doc: str
    required: bool = False


_COMMON = {
    "id": Field("text", "Name of the claim, unique in the file.", required=True),
    "where": Field("text", "Table, column and row, or section, of the source.", required=True),
    "note": Field("text", "Anything a reader of the audit should know."),
    "damaged": Field("text", "What of this cell the transcribed text does not show."),
}

_PROBLEM = {
    "workpiece": Field("text", "Id of a workpiece of this file."),
    "travel": Field("text", "Travel model: sequential (case1, default), simultaneous (case2), ..."),
    "vx": Field("number", "Speed of the x axis in mm/s; default 1."),
    "vy": Field("number", "Speed of the y axis in mm/s; default 1."),
    "start": Field("text", "Hole that comes first."),
    "end": Field("text", "Hole that comes last."),
    "home": Field("point", "Home position [x, y] in mm."),
    "legs": Field("text", "Moves from and to home that count: both (default), out, back."),
    "closed": Field("flag", "Whether the tool returns from the last hole to the first."),
}

_QUOTE = {
    "algorithm": Field("text", "What produced the figures."),
    "quotes": Field("text", "The claim this repeats, as SOURCE#ID."),
    "cites": Field("text", "The publication that the figures are taken from, as cited."),
    "subject": Field("text", "Claims with one subject speak of the same thing, in any paper."),
}

_TIMES = {
    f"{which}_{what}": Field("number", f"The {which} {what.replace('_', ' ')} over all runs.")
    for what in ("time", "iterations", "solutions", "ratio")
    for which in ("least", "average", "most")
}

KINDS: dict[str, dict[str, Field]] = {
    "workpiece": {
        **_COMMON,
        "holes": Field("texts", 'Holes as "id x y", with the digits as printed.'),
        "file": Field("text", "A workpiece file inside the folder of the claims file."),
        "from": Field("text", "A workpiece of another claims file, as FILE.toml#ID."),
        "units": Field("text", "mm (default) or inch."),
        "stated_holes": Field("whole", "Number of holes that the text states."),
        "same_as": Field("text", "The workpiece that this repeats, as SOURCE#ID."),
        "mirror_x": Field("number", "For same_as: x there is this number minus x here."),
        "mirror_y": Field("number", "For same_as: y there is this number minus y here."),
    },
    "route": {
        **_COMMON,
        **_PROBLEM,
        **_QUOTE,
        "sequence": Field("sequence", "Holes in drilling order, text or list.", required=True),
        "numbering": Field("text", "ids (default), or 0 or 1 for numbers counted from there."),
        "time": Field("number", "The claimed time, with the digits as printed."),
        "optimal": Field("flag", "Whether the source calls the route optimal."),
    },
    "statistics": {
        **_COMMON,
        **_PROBLEM,
        **_QUOTE,
        **_TIMES,
        "best_time": Field("number", "The best (optimal) time stated."),
        "least_error": Field("number", "(least - best) / best, as printed."),
        "average_error": Field("number", "(average - best) / best, as printed."),
        "most_error": Field("number", "(most - best) / best, as printed."),
        "runs": Field("whole", "Number of runs."),
        "population": Field("whole", "Population number."),
        "generations": Field("whole", "Generation or iteration limit of a run."),
        "solutions_per_iteration": Field("whole", "Solutions searched in one iteration."),
        "solution_space": Field("formula", "Number of solutions there are."),
    },
    "parameters": {
        **_COMMON,
        **_QUOTE,
        "values": Field("figures", "Parameters by name.", required=True),
    },
    "arithmetic": {
        **_COMMON,
        "statement": Field("text", "The sentence, in few words.", required=True),
        "printed": Field("value", "The figure as printed."),
        "compute": Field("formula", "The formula or figures it is said to follow from."),
        "alternatives": Field("choices", "Other formulas {says, compute} that could be meant."),
        "holds": Field("formula", "A comparison: [greater|at-least|less|at-most|equal, a, b]."),
    },
    "matrix": {
        **_COMMON,
        **_PROBLEM,
        "rows": Field("texts", "Rows of the travel matrix as printed.", required=True),
    },
}
"""The kinds of claims and their keys; a claims file has an array of tables for each."""

SOURCE: dict[str, Field] = {
    "key": Field("text", "Short name of the source, for references.", required=True),
    "title": Field("text", "Title of the paper.", required=True),
    "authors": Field("texts", "Authors."),
    "year": Field("whole", "Year of publication."),
    "published": Field("text", "Journal, volume, pages."),
    "doi": Field("text", "Digital object identifier."),
    "note": Field("text", "Anything a reader should know about the transcription."),
}
"""The keys of the table ``source``."""

_NUMBER = {"type": ["number", "string"], "description": "a number with the digits as printed"}
_FORMULA = {"$ref": "#/$defs/formula"}
_TYPES: dict[str, dict[str, Any]] = {
    "text": {"type": "string"},
    "texts": {"type": "array", "items": {"type": "string"}},
    "number": _NUMBER,
    "whole": {"type": "integer", "minimum": 0},
    "flag": {"type": "boolean"},
    "sequence": {
        "anyOf": [
            {"type": "string"},
            {"type": "array", "items": {"type": ["integer", "string"]}},
        ]
    },
    "formula": _FORMULA,
    "figures": {"type": "object", "additionalProperties": {"type": ["number", "string"]}},
    "point": {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2},
    "choices": {
        "type": "array",
        "items": {
            "type": "object",
            "properties": {"says": {"type": "string"}, "compute": _FORMULA},
            "required": ["says", "compute"],
            "additionalProperties": False,
        },
    },
    "value": {
        "anyOf": [{"type": ["number", "string"]}, {"type": "array", "items": {"type": "integer"}}]
    },
}


def schema() -> dict[str, Any]:
    """The JSON Schema of claims files (a TOML file, read as JSON)."""
    kinds = {kind: {"type": "array", "items": _table(fields)} for kind, fields in KINDS.items()}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Claims of a paper about drill routes",
        "description": "Generated by `tcp audit --schema`. TOML files with these keys.",
        "type": "object",
        "properties": {"format": {"const": FORMAT}, "source": _table(SOURCE), **kinds},
        "required": ["format", "source"],
        "additionalProperties": False,
        "$defs": {
            "formula": {
                "description": "A number, or [operation, operands...]; see docs/claims.md.",
                "anyOf": [
                    {"type": ["number", "string"]},
                    {"type": "array", "items": _FORMULA, "minItems": 1},
                ],
            }
        },
    }


def _table(fields: dict[str, Field]) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": {k: {**_TYPES[f.type], "description": f.doc} for k, f in fields.items()},
        "required": [k for k, f in fields.items() if f.required],
        "additionalProperties": False,
    }
