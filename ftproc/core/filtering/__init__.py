"""The unscented Kalman filter: first states, the forward pass, the fixed-interval smoother, and their records.

Calls `core.model`. Weights of readings are given to it: whether a reading is an outlier is decided in `core.editing`.
"""
