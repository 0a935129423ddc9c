"""The model file: safetensors, with the weights as tensors and everything else as JSON in the header; no pickle."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.correction.envelope import Envelope, Normaliser
from ftproc.correction.feature_sets import FEATURES
from ftproc.correction.features import APPLIED
from ftproc.correction.model import FILTER, SCHEMA, STAGES, Model, Stage
from ftproc.correction.network import Weights
from ftproc.correction.verdict import Verdict
from ftproc.errors import ModelError
from ftproc.settings import NO_MODEL, PACKAGED

_KEY = "ftproc-correction"  # one key only: safetensors writes several in no fixed order
_LARGEST = 64 << 20  # bytes; a model has thousands
_TENSORS = (*Weights._fields, "precision")
_PACKAGED_FILE = Path(__file__).parent / "default.safetensors"


def named(name: str | Model) -> Model | None:
    """The model named `packaged` or by its file, None for `none`; a loaded model as it is. Raises ModelError."""
    if name == NO_MODEL:
        return None
    return _loaded(name) if isinstance(name, str) else name


@cache
def _loaded(name: str) -> Model:
    return load(_PACKAGED_FILE if name == PACKAGED else name)


def to_bytes(model: Model) -> bytes:
    """The file's content; equal models give equal bytes."""
    from safetensors.numpy import save as serialise

    tensors = {
        f"{name}.{key}": np.ascontiguousarray(value)
        for name, stage in model.stages.items()
        for key, value in zip(_TENSORS, (*stage.weights, stage.envelope.precision), strict=True)
    }
    stages = {name: _header(stage) for name, stage in model.stages.items()}
    content = {"schema": SCHEMA, "settings": dict(model.settings), "stages": stages}
    return bytes(serialise(tensors, metadata={_KEY: json.dumps(content, sort_keys=True, allow_nan=False)}))


def _header(stage: Stage) -> dict[str, Any]:
    return {
        "features": stage.features.name,
        "layers": list(stage.shape),
        "input_mean": stage.inputs.mean.tolist(),
        "input_scale": stage.inputs.scale.tolist(),
        "target_mean": stage.targets.mean.tolist(),
        "target_scale": stage.targets.scale.tolist(),
        "envelope_limit": stage.envelope.limit,
        "gain": stage.gain.tolist(),
        "bound_sigma": stage.bound_sigma.tolist(),
        "fingerprint": stage.fingerprint,
        "verdict": None if stage.verdict is None else stage.verdict.to_dict(),
    }


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
        header = json.loads(metadata[_KEY], parse_float=_finite, parse_constant=_finite)
        schema = header["schema"]
    except (ValueError, KeyError, TypeError, RecursionError) as cause:
        raise ModelError(f"{name}: the model's header is damaged; train it again") from cause
    if schema != SCHEMA:
        raise ModelError(f"{name}: a model of schema {schema}, this version reads {SCHEMA}; train it again")
    try:
        found = header["stages"]
        if FILTER not in found or set(found) - set(STAGES):
            raise ValueError(f"its stages are {', '.join(found) or 'none'}")
        stages = {key: _stage(found[key], tensors, key, name) for key in STAGES if key in found}
        return Model(stages, dict(header["settings"]))
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as cause:
        raise ModelError(f"{name}: the model's header is damaged ({cause}); train it again") from cause


def _finite(text: str) -> float:
    """A number of the header. Raises ValueError for NaN, infinity and numbers too large for a double."""
    if not math.isfinite(number := float(text)):
        raise ValueError(f"{text} is not a finite number")
    return number


def _stage(header: Mapping[str, Any], tensors: Mapping[str, Any], key: str, name: str) -> Stage:
    if header["features"] not in FEATURES:
        raise ModelError(f"{name}: made for the feature set {header['features']!r}; known are {', '.join(FEATURES)}")
    if missing := [part for part in _TENSORS if f"{key}.{part}" not in tensors]:
        raise ModelError(f"{name}: the model lacks its {', '.join(missing)}; train it again")
    *weights, precision = (np.asarray(tensors[f"{key}.{part}"], np.float64) for part in _TENSORS)
    column = {part: np.array(header[part], np.float64) for part in header if part.endswith(("_mean", "_scale"))}
    verdict = header["verdict"]
    stage = Stage(
        features=FEATURES[header["features"]],
        weights=Weights(*weights),
        inputs=Normaliser(column["input_mean"], column["input_scale"]),
        targets=Normaliser(column["target_mean"], column["target_scale"]),
        envelope=Envelope(precision, float(header["envelope_limit"])),
        gain=np.array(header["gain"], np.float64),
        bound_sigma=np.array(header["bound_sigma"], np.float64),
        fingerprint=str(header["fingerprint"]),
        verdict=None if verdict is None else Verdict.from_dict(verdict),
    )
    _check(stage, header, name)
    return stage


def _check(stage: Stage, header: Mapping[str, Any], name: str) -> None:
    """Raise ModelError unless sizes fit the feature set, all is finite, and gains, bounds and scales are in range."""
    features, weights = stage.features, stage.weights
    d, o, h = features.input_size, features.output_size, weights.b1.size
    arrays = {
        "w1": (weights.w1, (h, d)), "b1": (weights.b1, (h,)), "w2": (weights.w2, (o, h)), "b2": (weights.b2, (o,)),
        "direct": (weights.direct, (o, d if features.direct else 0)), "precision": (stage.envelope.precision, (d, d)),
        "gain": (stage.gain, (APPLIED,)), "bound": (stage.bound_sigma, (APPLIED,)),
        "input mean": (stage.inputs.mean, (d,)), "input scale": (stage.inputs.scale, (d,)),
        "target mean": (stage.targets.mean, (o,)), "target scale": (stage.targets.scale, (o,)),
    }  # fmt: skip
    wrong = [label for label, (array, shape) in arrays.items() if array.shape != shape]
    if wrong or list(header["layers"]) != [d, h, o, features.direct]:
        raise ModelError(
            f"{name}: its sizes ({', '.join(wrong) or 'layers'}) do not fit the feature set "
            f"{features.name!r} of {d} inputs and {o} outputs; train it again"
        )
    finite = all(np.all(np.isfinite(array)) for array, _ in arrays.values())
    if not (finite and np.isfinite(stage.envelope.limit)):
        raise ModelError(f"{name}: it holds numbers that are not finite; train it again")
    scales = np.concatenate([stage.inputs.scale, stage.targets.scale])
    if np.any(scales <= 0) or np.any(stage.gain < 0) or np.any(stage.gain > 1) or np.any(stage.bound_sigma < 0):
        raise ModelError(f"{name}: a scale, gain or bound is out of its range; train it again")


def save(model: Model, path: Path | str) -> None:
    """Write the model, atomically. Raises OutputError."""
    from ftproc.files.writing.atomic import replacing

    content = to_bytes(model)
    with replacing(path) as stream:
        stream.write(content)


def load(path: Path | str) -> Model:
    """Read a model. Raises ModelError for any file that is not one."""
    from ftproc.files.reading.formats.content import is_ordinary

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
