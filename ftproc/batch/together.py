"""The trajectories of several targets in one table, in which a column names the target."""

from __future__ import annotations

import json
from collections.abc import Mapping

from ftproc.files.layout import METADATA_KEY, Target
from ftproc.files.writing import tables, trajectories

TARGET = "target"  # the column


def write(found: Mapping[str, str], version: str, target: Target) -> None:
    """Write the rows of all targets below each other, in their order. found: the Parquet file of each by its name.

    The metadata have those of each under `targets`, by its name. Raises OutputError.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    parts = {name: pq.read_table(file) for name, file in found.items()}
    named = [part.add_column(0, TARGET, pa.array([name] * part.num_rows, pa.string())) for name, part in parts.items()]
    of_each = {name: json.loads(part.schema.metadata[METADATA_KEY]) for name, part in parts.items()}
    metadata = {"program": "ftproc", "version": version, "targets": of_each}
    table = pa.concat_tables([part.replace_schema_metadata(None) for part in named], promote_options="default")
    text = trajectories.to_json(metadata, indent=None)
    with trajectories.with_sidecar(target) as (stream, beside):
        tables.write_stream(table.replace_schema_metadata({METADATA_KEY: text}), stream, tables.kind_of(target))
        beside.write(trajectories.to_json(metadata, indent=2) + b"\n")
