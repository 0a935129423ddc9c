"""Files in: columns, units and times, up to a checked record; messages for what is wrong.

`logs`, `truth` and `trajectories` are the entries. `formats` opens files, `meaning` finds columns, units and targets,
`clocks` reads the times, `understanding` says how. Calls `files`, not `files.writing`.
"""
