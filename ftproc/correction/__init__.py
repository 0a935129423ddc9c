"""Correction of the filter's output by a trained network: its features, its guards and its file.

`training` makes networks. Calls `core.model`, `core.filtering` for the record of a run, and `files` for the model file;
runs no filter.
"""
