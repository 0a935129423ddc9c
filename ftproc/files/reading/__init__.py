"""Files in: columns, units and times, up to a checked record; messages for what is wrong.

`logs`, `truth` and `trajectories` are the entries, `formats` opens the files. Calls `files`, not `files.writing`.
"""
