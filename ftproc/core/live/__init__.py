"""Live editing: what a system can know of a track when each reading arrives, or a given lag later.

`editor` leads: it takes readings and gives rows; `window` holds what it carries along. Calls `core` alone.
"""
