"""Files out, complete or not at all: trajectories, maps, simulated flights.

Calls `files`, not `files.reading`.
"""
