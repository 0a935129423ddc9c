"""Files: `reading` and `writing`, and what both share: names of columns, units, conventions, storage.

Calls `records` and, for refraction, `core.model`.
"""
