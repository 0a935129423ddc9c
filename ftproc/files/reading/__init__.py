"""Files in: formats, columns, units, clocks, up to a checked record; sentences for what is wrong.

`logs`, `truth` and `trajectories` are the doors. Calls `files`; nothing of `files.writing`.
"""
