"""The tables that are not in any page: that they can be made, and say what they should."""

from __future__ import annotations

import importlib

import pytest

from tests.bench import ablation, golden, logs


@pytest.mark.parametrize("rule", ablation.RULES)
def test_a_rule_is_off_inside_and_on_again(rule):
    """Each name that a rule switches off is there; a rule that has moved would be measured as one without worth."""
    before = [getattr(importlib.import_module(off.module), off.name) for off in ablation.RULES[rule]]
    with ablation.without(rule):
        inside = [getattr(importlib.import_module(off.module), off.name) for off in ablation.RULES[rule]]
    after = [getattr(importlib.import_module(off.module), off.name) for off in ablation.RULES[rule]]
    assert after == before
    assert all(one is not other for one, other in zip(inside, before, strict=True))


def test_a_rule_that_is_off_is_missed():
    """Ranges that jump by their ambiguity, with nobody to look for steps."""
    name = f"fault/range ambiguity/{logs.SEEDS[1]}"
    assert ablation.run("faults that last", name).error_m > 100 * ablation.run(None, name).error_m


def test_what_two_versions_differ_in_is_named():
    before = {"a, filter": ["1", "2", "3", "consistent"], "b, filter": ["1", "2", "3", "suspect"], "c": ["1"] * 4}
    after = {"a, filter": ["1", "2", "3", "consistent"], "b, filter": ["1", "9", "3", "consistent"], "d": ["1"] * 4}
    assert list(golden.differences(before, after)) == [
        "b, filter: sigma, verdict (suspect, now consistent)",
        "c: only before",
        "d: only now",
    ]


def test_the_same_version_gives_the_same_digests():
    name = "scenario/zuo2021/300"
    assert golden.digests(name) == golden.digests(name)
    assert len(golden.digests(name)) == 5
    assert len(logs.names()) == len(set(logs.names())) > 70
