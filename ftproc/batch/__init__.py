"""Many logs: where outputs go (`plan`), one log's work (`tasks`), who does it (`run`, `processes`, `cluster`).

Calls `pipeline`, `report`, `config` and what is below them; only `cli` calls it.
"""
