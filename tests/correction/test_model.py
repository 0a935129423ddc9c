"""The model's file: there and back, and a plain sentence for everything that is not one."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import save as serialise

from ftproc.correction.apply import correct
from ftproc.correction.model import Model, card, from_bytes, load, save, sha256, to_bytes
from ftproc.correction.training import train
from ftproc.errors import ModelError, OutputError
from ftproc.settings import TrainSettings

from . import fake

KEY = "ftproc-correction"


@pytest.fixture(scope="module")
def model() -> Model:
    settings = TrainSettings(hidden=4, population=6, generations=3, epochs=20, seed=3)
    return train(fake.flights(0, 6, bias=(0, 0, 1.5, 0, 0, 0)), settings)


def header_of(content: bytes) -> dict[str, Any]:
    length = int.from_bytes(content[:8], "little")
    header: dict[str, Any] = json.loads(json.loads(content[8 : 8 + length])["__metadata__"][KEY])
    return header


def rewritten(model: Model, drop: str = "", **changes: Any) -> bytes:
    """The model's file with entries of its header replaced, or a tensor dropped."""
    header = {**header_of(to_bytes(model)), **changes}
    tensors = {**model.weights._asdict(), "precision": model.envelope.precision}
    tensors.pop(drop, None)
    contiguous = {k: np.ascontiguousarray(v) for k, v in tensors.items()}
    return serialise(contiguous, metadata={KEY: json.dumps(header)})


def test_there_and_back(model: Model, tmp_path: Path) -> None:
    path = tmp_path / "model.safetensors"
    save(model, path)
    again = load(path)
    assert to_bytes(again) == to_bytes(model) == path.read_bytes()
    assert again.verdict == model.verdict
    assert again.settings == model.settings
    filtered = fake.run(np.random.default_rng(9))
    assert np.array_equal(correct(filtered, again).values, correct(filtered, model).values)
    assert correct(filtered, again).values.any()
    assert [p.name for p in tmp_path.iterdir()] == ["model.safetensors"]


def test_the_hash_is_that_of_the_file(model: Model, tmp_path: Path) -> None:
    import hashlib

    save(model, tmp_path / "m")
    assert sha256(model) == hashlib.sha256((tmp_path / "m").read_bytes()).hexdigest()


def test_the_header_says_what_the_model_is(model: Model) -> None:
    header = header_of(to_bytes(model))
    assert header["schema"] == 1
    assert header["features"] == "window"
    assert header["layers"] == [32, 4, 6]
    assert len(header["input_mean"]) == len(header["input_scale"]) == 32
    assert header["settings"]["seed"] == 3
    assert len(header["fingerprint"]) == 64
    assert len(header["verdict"]["components"]) == 6


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
        ({"schema": 2}, "schema 2, this version reads 1; train it again"),
        ({"features": "fourier"}, "made for the feature set 'fourier'; known are correction, window"),
        ({"features": "correction"}, "do not fit the feature set 'correction' of 9 inputs and 9 outputs"),
        ({"layers": [32, 5, 6]}, "do not fit"),
        ({"gain": [1.0]}, r"sizes \(gain\) do not fit"),
        ({"input_scale": [1.0] * 31}, "input scale"),
        ({"gain": [2.0] * 6}, "out of its range"),
        ({"input_scale": [0.0] * 32}, "out of its range"),
        ({"bound_sigma": [-1.0] * 6}, "out of its range"),
        ({"envelope_limit": float("nan")}, "not finite"),
        ({"target_mean": [float("inf")] * 6}, "not finite"),
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
        from_bytes(rewritten(model, drop="w2"), "m")


@pytest.mark.parametrize("tensor", ["w1", "b1", "w2", "b2"])
def test_weights_that_are_not_finite(model: Model, tensor: str) -> None:
    array = getattr(model.weights, tensor).copy()
    array.flat[0] = np.nan
    broken = replace(model, weights=model.weights._replace(**{tensor: array}))
    with pytest.raises(ModelError, match="not finite"):
        from_bytes(to_bytes(broken), "m")


def test_weights_of_another_size(model: Model) -> None:
    broken = replace(model, weights=model.weights._replace(w2=np.zeros((6, 5))))
    with pytest.raises(ModelError, match=r"sizes \(w2\) do not fit"):
        from_bytes(to_bytes(broken), "m")


def test_the_card_tells_all_in_plain_words(model: Model) -> None:
    told = card(model)
    for part in ("32-4-6", "'window'", "seed 3", model.fingerprint, "bounded to 2 sigma", "up: gain"):
        assert part in told
    assert "no verdict" in card(replace(model, verdict=None))
