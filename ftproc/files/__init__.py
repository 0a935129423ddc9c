"""Files in (`reading`) and out (`writing`), and what both share: columns (`layout`), `units`, `conventions`, storage.

A new unit or name of a quantity goes to `units`, a new kind of file to `reading.formats` or `writing.tables`, a new
notation of times to `reading.clocks`. Calls `records` and, for refraction, `core.model`.
"""
