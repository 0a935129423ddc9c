"""The model file: a round trip, and a plain sentence for everything that is not one."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load as parse
from safetensors.numpy import save as serialise

from ftproc.correction.apply import correct
from ftproc.correction.model import Model, card
from ftproc.correction.model_file import from_bytes, load, save, sha256, to_bytes
from ftproc.correction.training.train import train
from ftproc.errors import ModelError, OutputError
from ftproc.settings import TrainSettings
from tests.correction import fake

KEY = "ftproc-correction"


@pytest.fixture(scope="module")
def model() -> Model:
    settings = TrainSettings(hidden=4, population=6, generations=3, epochs=20, seed=3)
    flights = fake.flights(0, 6, bias=(0, 0, 1.5, 0, 0, 0))
    stages = {
        name: train(flights, replace(settings, features=features))
        for name, features in (("filter", "window"), ("smoother", "instrument"))
    }
    return Model(stages, asdict(settings))


def changed(model: Model, **changes: Any) -> Model:
    """The model with another filter stage."""
    return replace(model, stages={**model.stages, "filter": replace(model.filter, **changes)})


def header_of(content: bytes) -> dict[str, Any]:
    length = int.from_bytes(content[:8], "little")
    header: dict[str, Any] = json.loads(json.loads(content[8 : 8 + length])["__metadata__"][KEY])
    return header


def rewritten(model: Model, drop: str = "", **changes: Any) -> bytes:
    """The model's file with entries of its header, or of its filter's, replaced, or a tensor dropped."""
    content = to_bytes(model)
    header, tensors = header_of(content), parse(content)
    for key, value in changes.items():
        (header if key in header else header["stages"]["filter"])[key] = value
    tensors.pop(drop, None)
    return serialise(tensors, metadata={KEY: json.dumps(header)})


def test_there_and_back(model: Model, tmp_path: Path) -> None:
    path = tmp_path / "model.safetensors"
    save(model, path)
    again = load(path)
    assert to_bytes(again) == to_bytes(model) == path.read_bytes()
    assert again.filter.verdict == model.filter.verdict
    assert again.settings == model.settings
    filtered = fake.run(np.random.default_rng(9))
    for stage in ("filter", "smoother"):
        values = correct(filtered, again.stages[stage]).values
        assert np.array_equal(values, correct(filtered, model.stages[stage]).values)
        assert values.any()
    assert [p.name for p in tmp_path.iterdir()] == ["model.safetensors"]


def test_a_model_without_its_hidden_layer_says_linear(model: Model) -> None:
    weights = model.filter.weights
    assert not model.filter.linear
    for name in ("w1", "w2"):
        discarded = changed(model, weights=weights._replace(**{name: np.zeros_like(getattr(weights, name))}))
        assert discarded.filter.linear
        assert ", linear, " in card(discarded).split("smoother:")[0]
        line = correct(fake.run(np.random.default_rng(1)), discarded.filter)
        assert line.values.any()
    assert not changed(
        model, weights=weights._replace(w1=np.ones_like(weights.w1), w2=np.ones_like(weights.w2))
    ).filter.linear


def test_the_hash_is_that_of_the_file(model: Model, tmp_path: Path) -> None:
    import hashlib

    save(model, tmp_path / "m")
    assert sha256(model) == hashlib.sha256((tmp_path / "m").read_bytes()).hexdigest()


def test_the_header_says_what_the_model_is(model: Model) -> None:
    header = header_of(to_bytes(model))
    assert header["schema"] == 2
    assert header["settings"]["seed"] == 3
    stage = header["stages"]["filter"]
    assert stage["features"] == "window"
    assert stage["layers"] == [41, 4, 6, False]
    assert len(stage["input_mean"]) == len(stage["input_scale"]) == 41
    assert len(stage["fingerprint"]) == 64
    assert len(stage["verdict"]["components"]) == 6
    assert header["stages"]["smoother"]["layers"] == [7, 4, 3, True]


def test_a_model_cannot_be_written_where_there_is_no_directory(model: Model, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no directory"):
        save(model, tmp_path / "missing" / "model")


def test_no_such_file_and_a_directory(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="there is no such file"):
        load(tmp_path / "missing")
    with pytest.raises(ModelError, match="cannot be read"):
        load(tmp_path)


@pytest.mark.parametrize(
    "content",
    [b"", b"time_s,range_m\n0,1\n", b"\x80\x04\x95", b"\x08" + b"\0" * 7 + b"not json", b"\xff" * 100],
)
def test_a_file_that_is_no_safetensors_file(content: bytes) -> None:
    with pytest.raises(ModelError, match=r"^some\.log: not a correction model"):
        from_bytes(content, "some.log")


def test_a_cut_file(model: Model) -> None:
    content = to_bytes(model)
    for length in (4, 100, len(content) // 2, len(content) - 1):
        with pytest.raises(ModelError, match="not a correction model"):
            from_bytes(content[:length], "m")


def test_a_safetensors_file_of_something_else() -> None:
    for metadata in (None, {"format": "pt"}):
        with pytest.raises(ModelError, match="a safetensors file, but not a correction model"):
            from_bytes(serialise({"w1": np.zeros(3)}, metadata=metadata), "m")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"schema": 1}, "schema 1, this version reads 2; train it again"),
        ({"stages": {}}, r"header is damaged \(its stages are none\)"),
        ({"stages": {"smoother": {}}}, "its stages are smoother"),
        ({"features": "fourier"}, "made for the feature set 'fourier'; known are correction, window"),
        ({"features": "correction"}, "do not fit the feature set 'correction' of 9 inputs and 9 outputs"),
        ({"layers": [41, 5, 6, False]}, "do not fit"),
        ({"gain": [1.0]}, r"sizes \(gain\) do not fit"),
        ({"input_scale": [1.0] * 40}, "input scale"),
        ({"gain": [2.0] * 6}, "out of its range"),
        ({"input_scale": [0.0] * 41}, "out of its range"),
        ({"bound_sigma": [-1.0] * 6}, "out of its range"),
        ({"envelope_limit": float("nan")}, "header is damaged"),
        ({"target_mean": [float("inf")] * 6}, "header is damaged"),
        ({"settings": {"noise": float("-inf")}}, "header is damaged"),
        ({"gain": "all"}, "header is damaged"),
        ({"verdict": {"by": "flight"}}, "header is damaged"),
        ({"verdict": 3}, "header is damaged"),
        ({"settings": None}, "header is damaged"),
    ],
)
def test_headers_that_do_not_fit(model: Model, changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ModelError, match=sentence) as caught:
        from_bytes(rewritten(model, **changes), "old.model")
    assert str(caught.value).startswith("old.model: ")


def test_a_header_that_is_no_object(model: Model) -> None:
    for text in ("3", "{", "[]", "{}"):
        with pytest.raises(ModelError, match="header is damaged"):
            from_bytes(serialise({"w1": np.zeros(1)}, metadata={KEY: text}), "m")


def test_a_missing_tensor(model: Model) -> None:
    with pytest.raises(ModelError, match="lacks its w2"):
        from_bytes(rewritten(model, drop="filter.w2"), "m")


@pytest.mark.parametrize("tensor", ["w1", "b1", "w2", "b2"])
def test_weights_that_are_not_finite(model: Model, tensor: str) -> None:
    array = getattr(model.filter.weights, tensor).copy()
    array.flat[0] = np.nan
    broken = changed(model, weights=model.filter.weights._replace(**{tensor: array}))
    with pytest.raises(ModelError, match="not finite"):
        from_bytes(to_bytes(broken), "m")


def test_weights_of_another_size(model: Model) -> None:
    broken = changed(model, weights=model.filter.weights._replace(w2=np.zeros((6, 5))))
    with pytest.raises(ModelError, match=r"sizes \(w2\) do not fit"):
        from_bytes(to_bytes(broken), "m")


def test_the_card_describes_the_model(model: Model) -> None:
    text = card(model)
    for part in (
        "feature set 'window', network 41-4-6",
        "seed 3",
        model.filter.fingerprint,
        "bounded to 2 to ",
        "up: gain",
    ):
        assert part in text
    assert "smoother: feature set 'instrument', linear, 7 inputs to 3 outputs" in text
    assert "no verdict" in card(changed(model, verdict=None))
    alone = replace(model, stages={"filter": model.filter})
    assert "smoother: no network; --smooth is not corrected" in card(alone)
