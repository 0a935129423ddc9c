"""The trained correction and its file: safetensors, weights as tensors, everything else as JSON in the
header."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.features import APPLIED, FEATURES, Features
from ftproc.correction.network import Shape, Weights
from ftproc.correction.verdict import Verdict
from ftproc.errors import ModelError
from ftproc.records import FloatArray

SCHEMA = 1
_KEY = "ftproc-correction"  # one key only: safetensors writes several in no fixed order
_LARGEST = 64 << 20  # bytes; a model has thousands
_TENSORS = ("w1", "b1", "w2", "b2", "precision")


@dataclass(frozen=True)
class Model:
    """A correction ready to apply.

    features: the feature set. weights: network on normalised inputs and targets. gain: (6,) in [0, 1] per
    applied output, zero where held-out data did not prove it. bound_sigma: (6,) a correction never exceeds so
    many of the filter's sigmas along each line-of-sight axis. fingerprint: SHA-256 of the training,
    validation and test arrays. settings: how it was trained (JSON-serialisable).
    """

    features: Features
    weights: Weights
    inputs: Normaliser
    targets: Normaliser
    envelope: Envelope
    gain: FloatArray
    bound_sigma: FloatArray
    fingerprint: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    verdict: Verdict | None = None

    @property
    def shape(self) -> Shape:
        hidden, inputs = self.weights.w1.shape
        return Shape(inputs, hidden, len(self.weights.b2))


def _header(model: Model) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "features": model.features.name,
        "layers": list(model.shape),
        "input_mean": model.inputs.mean.tolist(),
        "input_scale": model.inputs.scale.tolist(),
        "target_mean": model.targets.mean.tolist(),
        "target_scale": model.targets.scale.tolist(),
        "envelope_limit": model.envelope.limit,
        "gain": model.gain.tolist(),
        "bound_sigma": model.bound_sigma.tolist(),
        "settings": dict(model.settings),
        "fingerprint": model.fingerprint,
        "verdict": None if model.verdict is None else model.verdict.to_dict(),
    }


def to_bytes(model: Model) -> bytes:
    """The file's content; equal models give equal bytes."""
    from safetensors.numpy import save as serialise

    tensors = dict(zip(_TENSORS, (*model.weights, model.envelope.precision), strict=True))
    header = json.dumps(_header(model), sort_keys=True, allow_nan=False)
    return bytes(serialise({k: np.ascontiguousarray(v) for k, v in tensors.items()}, metadata={_KEY: header}))


def sha256(model: Model) -> str:
    """SHA-256 of the model's file, for provenance."""
    return hashlib.sha256(to_bytes(model)).hexdigest()


def from_bytes(content: bytes, name: str) -> Model:
    """The inverse of `to_bytes`; `name` is for messages. Raises ModelError."""
    from safetensors import SafetensorError
    from safetensors.numpy import load as parse

    try:
        tensors = parse(content)
        length = int.from_bytes(content[:8], "little")
        metadata = json.loads(content[8 : 8 + length]).get("__metadata__", {})
    except (SafetensorError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as cause:
        raise ModelError(f"{name}: not a correction model; `ftproc train` writes one") from cause
    if _KEY not in metadata:
        raise ModelError(f"{name}: a safetensors file, but not a correction model; `ftproc train` writes one")
    try:
        header = json.loads(metadata[_KEY])
        schema = header["schema"]
    except (ValueError, KeyError, TypeError, RecursionError) as cause:
        raise ModelError(f"{name}: the model's header is damaged; train it again") from cause
    if schema != SCHEMA:
        raise ModelError(f"{name}: a model of schema {schema}, this version reads {SCHEMA}; train it again")
    try:
        model = _assemble(header, tensors, name)
        _check(model, header, name)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as cause:
        raise ModelError(f"{name}: the model's header is damaged ({cause}); train it again") from cause
    return model


def _assemble(header: Mapping[str, Any], tensors: Mapping[str, Any], name: str) -> Model:
    if header["features"] not in FEATURES:
        raise ModelError(f"{name}: made for the feature set {header['features']!r}; known are {', '.join(FEATURES)}")
    if missing := [key for key in _TENSORS if key not in tensors]:
        raise ModelError(f"{name}: the model lacks its {', '.join(missing)}; train it again")
    w1, b1, w2, b2, precision = (np.asarray(tensors[key], np.float64) for key in _TENSORS)
    column = {key: np.array(header[key], np.float64) for key in header if key.endswith(("_mean", "_scale"))}
    verdict = header["verdict"]
    return Model(
        features=FEATURES[header["features"]],
        weights=Weights(w1, b1, w2, b2),
        inputs=Normaliser(column["input_mean"], column["input_scale"]),
        targets=Normaliser(column["target_mean"], column["target_scale"]),
        envelope=Envelope(precision, float(header["envelope_limit"])),
        gain=np.array(header["gain"], np.float64),
        bound_sigma=np.array(header["bound_sigma"], np.float64),
        fingerprint=str(header["fingerprint"]),
        settings=dict(header["settings"]),
        verdict=None if verdict is None else Verdict.from_dict(verdict),
    )


def _check(model: Model, header: Mapping[str, Any], name: str) -> None:
    """Sizes that fit each other and the feature set; finite numbers; a gain and scales that make sense."""
    d, o = model.features.input_size, model.features.output_size
    h = model.weights.b1.size
    arrays = {
        "w1": (model.weights.w1, (h, d)), "b1": (model.weights.b1, (h,)),
        "w2": (model.weights.w2, (o, h)), "b2": (model.weights.b2, (o,)),
        "precision": (model.envelope.precision, (d, d)), "gain": (model.gain, (APPLIED,)),
        "bound": (model.bound_sigma, (APPLIED,)),
        "input mean": (model.inputs.mean, (d,)), "input scale": (model.inputs.scale, (d,)),
        "target mean": (model.targets.mean, (o,)), "target scale": (model.targets.scale, (o,)),
    }  # fmt: skip
    wrong = [label for label, (array, shape) in arrays.items() if array.shape != shape]
    if wrong or list(header["layers"]) != [d, h, o]:
        raise ModelError(
            f"{name}: its sizes ({', '.join(wrong) or 'layers'}) do not fit the feature set "
            f"{model.features.name!r} of {d} inputs and {o} outputs; train it again"
        )
    finite = all(np.all(np.isfinite(array)) for array, _ in arrays.values())
    if not (finite and np.isfinite(model.envelope.limit)):
        raise ModelError(f"{name}: it holds numbers that are not finite; train it again")
    scales = np.concatenate([model.inputs.scale, model.targets.scale])
    if np.any(scales <= 0) or np.any(model.gain < 0) or np.any(model.gain > 1) or np.any(model.bound_sigma < 0):
        raise ModelError(f"{name}: a scale, gain or bound is out of its range; train it again")


def save(model: Model, path: Path | str) -> None:
    """Write the model; it appears whole or not at all. Raises OutputError."""
    from ftproc.files.atomic import replacing

    content = to_bytes(model)
    with replacing(path) as stream:
        stream.write(content)


def load(path: Path | str) -> Model:
    """Read a model. Raises ModelError, in a sentence, for whatever is not one."""
    from ftproc.files.tables import is_ordinary

    try:
        if not is_ordinary(Path(path)):
            raise ModelError(f"{path}: not an ordinary file (a pipe or a device); give a model `ftproc train` wrote")
        with Path(path).open("rb") as stream:
            content = stream.read(_LARGEST + 1)
    except FileNotFoundError as cause:
        raise ModelError(f"{path}: there is no such file; `ftproc train` writes a model") from cause
    except OSError as cause:
        raise ModelError(f"{path}: cannot be read ({cause.strerror}); give a model `ftproc train` wrote") from cause
    if len(content) > _LARGEST:
        raise ModelError(f"{path}: far too large for a correction model; give one that `ftproc train` wrote")
    return from_bytes(content, str(path))


def _numbers(values: FloatArray) -> str:
    return "/".join(f"{v:.3g}" for v in dict.fromkeys(values.tolist()))


def card(model: Model) -> str:
    """The model's card: what it is, how it was trained, and what it brings on held-out flights."""
    d, h, o = model.shape
    settings = ", ".join(f"{key} {value}" for key, value in model.settings.items())
    lines = [
        f"Correction model, schema {SCHEMA}, feature set {model.features.name!r}, network {d}-{h}-{o}",
        f"training: {settings or 'not recorded'}",
        f"data: sha256 {model.fingerprint}",
        f"bounded to {_numbers(model.bound_sigma)} sigma; zero while coasting, in the first samples after a "
        "start and outside the range of the training data",
    ]
    verdict = ["no verdict on held-out data"] if model.verdict is None else model.verdict.sentences()
    return "\n".join([*lines, *verdict])
