"""Several stations on one flight: the range file, the readings of all in one series of events, the stations' biases and
clocks, editing that counts on the other stations, and the outputs.

Stands on `core`, `config`, `files` and `quality`; `cli` calls it. A single station goes the way of a single log.
"""
