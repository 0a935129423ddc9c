"""The numerical core: arrays in, arrays out.

Rooms from the ground up: `model`, `filtering`, `identification`, `editing`, `comparators`; `signatures`,
`compiled`, `threads`, `processes` and `pacing` serve all. Each may call those before it; none knows a file, a table or
the command line.
"""
