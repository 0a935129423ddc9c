"""The fused trajectory from what the stations have seen: a first track, then biases, clocks, noise, process noise and
decisions in turn, stretch by stretch where the flight is long.

Stands on `core` alone; the rest of `fusion` calls `whole`.
"""
