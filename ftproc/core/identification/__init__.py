"""Noise and process noise from the log itself, by maximum likelihood; noise that is correlated in time.

Calls `core.filtering` and `core.model`. Outliers are left out by the weights that it is given.
"""
