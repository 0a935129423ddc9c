"""What moves and what is measured: constant acceleration, range, azimuth and elevation, frames, refraction.

Stands on nothing but `core.compiled`. All other rooms of the core build on it.
"""
