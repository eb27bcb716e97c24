"""Every code of the judge with its page, in one table.  Codes never change their meaning.

1xx the sequence, 2xx its time, 3xx its optimality, 4xx statistics, 5xx
arithmetic, 6xx agreement with a source, 7xx the transcription itself.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Code:
    """What a code means.

    Parameters
    ----------
    name : str
        Short name, for SARIF and JUnit.
    severity : str
        ``error``, ``warning`` or ``note``.
    summary : str
        One sentence.
    why : str
        How the judge decides, and why it matters.
    remedy : str
        What to do about it.
    """

    name: str
    severity: str
    summary: str
    why: str
    remedy: str


CODES: dict[str, Code] = {
    "TCP101": Code(
        "duplicate-hole",
        "error",
        "A hole is drilled more than once.",
        "A route visits every hole exactly once. The finding names the hole and every place of "
        "the sequence (counted from 1) where it stands. The usual cause is a crossover or a "
        "mutation that does not keep permutations.",
        "Run `tcp validate --repair` to see every smallest repair and the cheapest route that "
        "keeps the rest of the order.",
    ),
    "TCP102": Code(
        "missing-hole",
        "error",
        "A hole is never drilled.",
        "Every hole of the workpiece has to stand in the sequence. A missing hole usually comes "
        "with a duplicate one: see TCP101.",
        "Run `tcp validate --repair`.",
    ),
    "TCP103": Code(
        "unknown-hole",
        "error",
        "An entry names a hole that the workpiece does not have.",
        "Entries are read as hole ids. Numbers from 0 are a frequent cause: then TCP107 says so.",
        "Correct the entry, or say `--numbering 0` if the sequence counts holes from 0.",
    ),
    "TCP104": Code(
        "wrong-length",
        "error",
        "The sequence is longer or shorter than the workpiece has holes.",
        "Stated besides the duplicate, missing and unknown holes that it follows from.",
        "See the other findings of the same sequence.",
    ),
    "TCP105": Code(
        "wrong-end",
        "error",
        "The route does not start or end at the hole that is asked for.",
        "The ends are part of the problem: a shorter route between other ends proves nothing.",
        "If the reversed route has the right ends, TCP204 says so; reverse it.",
    ),
    "TCP106": Code(
        "broken-rule",
        "error",
        "Two holes follow each other that must not, or do not although they must.",
        "Process rules (minimum jump, forbidden successions, slots) belong to the problem.",
        "Change the order at the places named.",
    ),
    "TCP107": Code(
        "other-numbering",
        "warning",
        "Read with another numbering, the sequence visits every hole once.",
        "The judge does not guess: it reads the sequence as it was told, and says what another "
        "reading would give.",
        "Pass `--numbering 0` or `--numbering 1` if that is what the sequence means.",
    ),
    "TCP108": Code(
        "no-separators",
        "note",
        "The sequence has no separators and was read one character a hole.",
        "Printed tables lose blanks: 321678549 for 3 2 1 6 7 8 5 4 9. This reading is taken only "
        "if the whole text is no hole's id and every single character is one.",
        "Nothing, if the reading is right.",
    ),
    "TCP201": Code(
        "time-differs",
        "error",
        "The claimed time is not the time of the sequence.",
        "The time is recomputed exactly, in integers, from the coordinates as printed. The "
        "claim holds if rounding or cutting off the exact time gives its digits. For a sequence "
        "that is no route the time of walking it as printed is compared.",
        "Look for TCP204 and TCP205, which say what else the claim could mean.",
    ),
    "TCP202": Code(
        "time-rounded",
        "note",
        "The claimed time is the exact time, rounded to the digits printed.",
        "235.3 for 235.25 is a rounding, not an error.",
        "Nothing.",
    ),
    "TCP203": Code(
        "time-cut-off",
        "note",
        "The claimed time is the exact time, cut off after the digits printed.",
        "235.2 for 235.25 is what cutting off (or rounding half to even) gives; rounding half up "
        "would print 235.3.",
        "Nothing; print one more digit next time.",
    ),
    "TCP204": Code(
        "other-reading",
        "warning",
        "The claim comes true when it is read differently.",
        "Tried: the other travel models, closed instead of open, the closed tour less its "
        "longest move, home legs, millimetres for inches and back, a mirrored board, the "
        "sequence as ranks instead of holes, and the reversed sequence for fixed ends.",
        "If the other reading is what was meant, state it in the claim.",
    ),
    "TCP205": Code(
        "swapped-entries",
        "warning",
        "Swapping two entries of the sequence makes the claimed time true.",
        "All pairs are tried (up to 2,000 entries). Several pairs can fit; all are named.",
        "Compare the two places with the original.",
    ),
    "TCP206": Code(
        "time-confirmed",
        "note",
        "The claimed time is exactly the recomputed time.",
        "Recomputed in integers from the coordinates as printed.",
        "Nothing.",
    ),
    "TCP301": Code(
        "certified-optimal",
        "note",
        "No sequence is faster: proved.",
        "The time equals a lower bound whose certificate passed the independent checker.",
        "Nothing.",
    ),
    "TCP302": Code(
        "above-optimum",
        "warning",
        "The route is valid, but a faster one is certified to exist.",
        "A warning where the claim calls the route optimal, else a note. The difference is given "
        "in per cent of the certified optimum.",
        "`tcp solve --exact` finds the optimum.",
    ),
    "TCP303": Code(
        "below-bound",
        "error",
        "The claimed time is impossible: it lies below the certified lower bound of every "
        "sequence.",
        "The bound comes from a certificate that was checked again when it was loaded. The "
        "digits printed are given the benefit of rounding before the comparison.",
        "Either the coordinates, the travel model or the time are not what the claim says.",
    ),
    "TCP304": Code(
        "not-certified",
        "note",
        "No certificate bounds this problem: optimality cannot be judged.",
        "The judge solves nothing itself; it needs a certificate, by the instance's hash.",
        "`tcp oracle pin FILE` makes one.",
    ),
    "TCP305": Code(
        "open-gap",
        "note",
        "Only a lower bound is certified: the route may or may not be optimal.",
        "The gap to that bound is given.",
        "Pin a certificate of the optimum.",
    ),
    "TCP306": Code(
        "optimum-matched",
        "note",
        "The claimed time is the certified optimum, though no sequence here attains it.",
        "A figure without a valid sequence can still be right.",
        "Nothing.",
    ),
    "TCP307": Code(
        "stated-bound-wrong",
        "error",
        "A valid route is faster than the optimum or lower bound that was stated.",
        "The bound comes from `--optimum` or `--lower-bound`, not from a certificate; the route "
        "refutes it.",
        "Doubt whoever stated it; `tcp solve --exact` finds the optimum.",
    ),
    "TCP401": Code(
        "least-above-average",
        "error",
        "A least value lies above the average.",
        "No sample has a minimum above its mean.",
        "Look for swapped or misprinted cells.",
    ),
    "TCP402": Code(
        "average-above-most",
        "error",
        "An average lies above the greatest value.",
        "No sample has a mean above its maximum.",
        "Look for swapped or misprinted cells.",
    ),
    "TCP403": Code(
        "most-below-least",
        "error",
        "The greatest value lies below the least.",
        "No sample has a maximum below its minimum.",
        "Look for swapped rows.",
    ),
    "TCP404": Code(
        "best-not-least",
        "error",
        "The best time is not the least time.",
        "If the best was found in the runs that the statistics describe, the two are one number; "
        "if not, the table does not say where it comes from.",
        "State where the best time comes from.",
    ),
    "TCP405": Code(
        "percentage-differs",
        "error",
        "A printed percentage does not follow from the printed figures.",
        "Error percentages are (value - best) / best.",
        "Recompute it.",
    ),
    "TCP406": Code(
        "beyond-limit",
        "error",
        "An iteration count exceeds the generation limit.",
        "A run that stops after N generations cannot converge in generation N + 1.",
        "Correct the limit or the count.",
    ),
    "TCP407": Code(
        "average-impossible",
        "error",
        "With this many runs the average cannot be what it is.",
        "One run has the least and one the most value, so the mean of r runs lies between "
        "least + (most - least)/r and most - (most - least)/r; a mean of whole numbers is a "
        "multiple of 1/r, to the digits printed.",
        "Correct the figures or the number of runs.",
    ),
    "TCP408": Code(
        "search-figure-differs",
        "error",
        "Solutions searched or a search ratio do not follow from the iteration counts.",
        "Solutions searched are iterations times solutions an iteration; the search ratio is "
        "solutions searched over the number of solutions there are (the cuckoo paper's eq. 17).",
        "Recompute it.",
    ),
    "TCP409": Code(
        "statistics-consistent",
        "note",
        "The statistics do not contradict each other.",
        "All checks of 4xx that the printed figures allow were made.",
        "Nothing.",
    ),
    "TCP410": Code(
        "negative-figure",
        "error",
        "A time, count or ratio is negative.",
        "No route takes less than nothing, and nothing is counted below zero.",
        "Correct the figure.",
    ),
    "TCP501": Code(
        "arithmetic-differs",
        "error",
        "A printed figure does not follow from the formula or figures it is said to follow from.",
        "The formula is data in the claims file, computed exactly; nothing is evaluated as code.",
        "Recompute it; TCP503 names a formula that does give the figure, where one is known.",
    ),
    "TCP502": Code(
        "arithmetic-cut-off",
        "note",
        "A printed figure is right, but cut off instead of rounded.",
        "See TCP203.",
        "Nothing.",
    ),
    "TCP503": Code(
        "other-formula",
        "note",
        "Another formula gives the printed figure.",
        "The claims file lists formulas that could have been meant; this one fits.",
        "Correct the text to say what was computed.",
    ),
    "TCP504": Code(
        "comparison-false",
        "error",
        "A stated comparison does not hold.",
        "The figures compared are taken from the claims themselves.",
        "Correct the statement or the figures.",
    ),
    "TCP505": Code(
        "arithmetic-confirmed",
        "note",
        "The statement follows from its formula or figures.",
        "Computed exactly.",
        "Nothing.",
    ),
    "TCP601": Code(
        "parameter-contradicts-source",
        "error",
        "A parameter is not what the cited source says.",
        "Compared with the parameters transcribed from the source itself.",
        "Correct the parameter or the citation.",
    ),
    "TCP602": Code(
        "misquoted-figure",
        "error",
        "A figure is not what the cited source prints.",
        "Figures agree if they are equal, or one is the other rounded to its digits.",
        "Correct the figure or the citation.",
    ),
    "TCP603": Code(
        "misquoted-sequence",
        "error",
        "A sequence is not the one that the cited source prints.",
        "Compared entry by entry.",
        "Correct the sequence or the citation.",
    ),
    "TCP604": Code(
        "quoted-differently",
        "warning",
        "Two papers quote different figures for the same thing.",
        "Claims that share a `subject` speak about the same algorithm on the same workpiece. If "
        "the papers cite different publications for it, the message says which.",
        "Look the figure up in the original.",
    ),
    "TCP605": Code(
        "hole-count-differs",
        "warning",
        "The number of holes stated is not the number of holes of the workpiece.",
        "Some papers count the home position as a hole; parameters that depend on the number "
        "of holes change with it.",
        "State whether the home position is counted.",
    ),
    "TCP606": Code(
        "matrix-differs",
        "error",
        "A printed travel matrix is not that of the coordinates.",
        "Recomputed entry by entry.",
        "Correct the matrix or the coordinates.",
    ),
    "TCP607": Code(
        "quotation-confirmed",
        "note",
        "The claim repeats its source faithfully.",
        "All shared figures, parameters and sequences agree.",
        "Nothing.",
    ),
    "TCP608": Code(
        "source-absent",
        "note",
        "The cited claim is not among the audited files.",
        "Quotations can be compared only when the source's claims file is audited too.",
        "Pass the source's claims file as well.",
    ),
    "TCP609": Code(
        "matrix-confirmed",
        "note",
        "The printed travel matrix is that of the coordinates.",
        "Recomputed entry by entry.",
        "Nothing.",
    ),
    "TCP610": Code(
        "nothing-to-compare",
        "warning",
        "The claim shares no parameter, figure or sequence with the one it quotes.",
        "Only what both claims state under one key can be compared; here nothing is confirmed.",
        "Quote the claim that states it, under the same keys.",
    ),
    "TCP701": Code(
        "damaged-cell",
        "warning",
        "The transcription marks this cell as damaged.",
        "The text at hand does not show what was printed; the claim holds the readable part and "
        "says what is damaged.",
        "Look it up in the original.",
    ),
    "TCP702": Code(
        "coordinates-differ",
        "warning",
        "Two papers print different coordinates for the same workpiece.",
        "Compared hole by hole, after the mirroring that the claim states.",
        "Times are comparable only on the same coordinates.",
    ),
    "TCP703": Code(
        "coordinates-agree",
        "note",
        "Two papers print the same coordinates.",
        "Compared hole by hole, after the mirroring that the claim states.",
        "Nothing.",
    ),
    "TCP704": Code(
        "suspect-coordinate",
        "note",
        "One changed coordinate would make the claim come true.",
        "Candidates of `tcp audit --suspect`: swapped digits, swapped x and y, one wrong digit, "
        "a neighbour's coordinate, the place that completes a repeated pattern. Data are never "
        "changed. The number of candidates tried says how easily one fits by chance.",
        "Compare the coordinate with the original drawing.",
    ),
}


def page(code: str) -> str:
    """The page of a code, as plain text.

    Raises
    ------
    KeyError
        If there is no such code.
    """
    entry = CODES[code]
    return (
        f"{code} {entry.name} ({entry.severity})\n\n{entry.summary}\n\n"
        f"How it is decided\n  {entry.why}\n\nWhat to do\n  {entry.remedy}\n"
    )


def catalogue() -> str:
    """All pages as one Markdown document: ``docs/findings.md``."""
    parts = [
        "# Findings of the judge\n\nGenerated by `tcp explain --all --markdown`. A code never "
        "changes its meaning; `--ignore CODE` silences it.\n"
    ]
    for code, entry in CODES.items():
        parts.append(
            f"\n## {code} {entry.name}\n\n*{entry.severity}*: {entry.summary}\n\n{entry.why}\n\n"
            f"What to do: {entry.remedy}\n"
        )
    return "".join(parts)
