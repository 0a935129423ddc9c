"""Many logs: where outputs go (`plan`), the work on one log (`tasks`), and on many (`run`) in this process, in worker
processes (`processes`) or on a Dask cluster (`cluster`).

Calls `pipeline`, `report`, `config` and what is below them; only `cli` calls it.
"""
