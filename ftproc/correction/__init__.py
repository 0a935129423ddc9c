"""The network that corrects the filter's output: its features, its file, how it is applied.

`training` makes one. Calls `core.model` and, for the file, `files`; no filter is run here.
"""
