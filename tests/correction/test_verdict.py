"""The verdict's sentences."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from ftproc.correction.verdict import ComponentVerdict, Ratio, Verdict

PLAIN = Verdict(
    "flight",
    12,
    8,
    4,
    (ComponentVerdict("radial", 0.8, 0.1, Ratio(0.7, 0.6, 0.8)),),
    None,
    Ratio(0.9, 0.85, 0.95),
    None,
)


def test_there_and_back_through_json() -> None:
    assert Verdict.from_dict(json.loads(json.dumps(PLAIN.to_dict()))) == PLAIN


def test_sentences_of_improvement() -> None:
    assert PLAIN.sentences() == [
        "Trained on 12 flights, validated on 8, tested on 4.",
        "  radial: gain 0.80, test error ratio 0.700 (0.600 to 0.800).",
        "Position error on the test flights, corrected over uncorrected: 0.900 (0.850 to 0.950), better.",
    ]


@pytest.mark.parametrize(
    ("ratio", "conclusion"),
    [(Ratio(1.2, 1.1, 1.3), "worse: do not use this model"), (Ratio(0.99, 0.9, 1.1), "no significant difference")],
)
def test_sentences_of_harm_and_doubt(ratio: Ratio, conclusion: str) -> None:
    assert conclusion in replace(PLAIN, position=ratio).sentences()[-1]


def test_sentences_of_no_gain() -> None:
    nothing = replace(PLAIN, components=(ComponentVerdict("radial", 0.0, 0.0, None),), by="block")
    assert nothing.sentences()[1:] == [
        "No significant improvement on the held-out blocks of at least 30 s: the correction is zero."
    ]
