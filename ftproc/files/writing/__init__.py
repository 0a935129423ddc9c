"""Files out, whole or not at all: trajectories, maps, simulated flights.

Calls `files`; nothing of `files.reading`.
"""
