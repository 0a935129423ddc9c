"""When a track in doubt is looked at."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.live.doubt import AGAIN_S, GROWTH, SAMPLES, Doubt


class Watched:
    """A window of which only the newest time and the doubt are known."""

    def __init__(self, time_s, doubted):
        self.time_s, self.doubted = time_s, doubted

    def in_doubt(self):
        return self.doubted


def looks(time_s, doubted, edits=()):
    """Times of the looks at a track that is in doubt in some samples; edits: samples that are looked at in any case."""
    doubt, found = Doubt(), []
    for k in range(len(time_s)):
        window = Watched(time_s[: k + 1], bool(doubted[k]))
        due = window.in_doubt() and doubt.is_due(window, k)
        if due or k in edits:
            doubt = doubt.after_edit(window, k)
        if due:
            found.append(time_s[k])
    return np.array(found)


def expected(time_s):
    """The same of a track in doubt all along: a look, and the next one when a share of the doubt's age has passed."""
    found, next_s = [], time_s[0]
    for t in time_s:
        if t >= next_s - 1e-9:
            found.append(t)
            next_s = t + max(AGAIN_S, GROWTH * (t - time_s[0]))
    return np.array(found)


@pytest.mark.parametrize("begin_s", [0.0, 4321.0])
def test_looks_become_rarer_from_when_the_doubt_began(begin_s):
    time_s = begin_s + 0.125 * np.arange(800)
    found = looks(time_s, np.ones(800))
    np.testing.assert_allclose(found, expected(time_s))
    assert np.diff(found)[0] == AGAIN_S
    assert np.diff(found)[-1] > 10 * AGAIN_S


def test_a_new_doubt_has_an_age_of_its_own():
    """In doubt, then not, as an edit in between finds, then in doubt again: the second time is looked at as the first
    was."""
    time_s = 0.125 * np.arange(1000)
    doubted = np.ones(1000)
    doubted[400:600] = 0
    found = looks(time_s, doubted, edits=(500,))
    first, second = found[found < 50], found[found > 50]
    np.testing.assert_allclose(second - second[0], first[: len(second)] - first[0])
    assert second[0] == time_s[600]


def test_a_few_samples_come_between_looks():
    """At long intervals samples count, not seconds."""
    assert set(np.diff(looks(2.0 * np.arange(10), np.ones(10)))) == {2.0 * SAMPLES}


def test_a_doubt_that_comes_right_after_a_look_waits_a_little():
    """Some samples and some time, both."""
    doubt = Doubt().after_edit(Watched(np.array([5.0]), False), 10)

    def due(row, time_s):
        return doubt.is_due(Watched(np.array([time_s]), True), row)

    assert not due(10 + SAMPLES - 1, 5.0 + 10 * AGAIN_S)
    assert not due(10 + 10 * SAMPLES, 5.0 + 0.9 * AGAIN_S)
    assert due(10 + SAMPLES, 5.0 + AGAIN_S)
