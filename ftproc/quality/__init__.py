"""Judges logs and runs: sanity of a whole log, statistics, consistency, the verdict with its reasons, provenance.

`verdict` decides whether a run is consistent, suspect or unreliable. Calls `methods`, `correction` and `files`.
"""
