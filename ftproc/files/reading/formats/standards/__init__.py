"""Formats that a standard or a maker describes: `catalogue` lists them, each other file reads one, `choosing` asks
which of their targets or stations is meant.
"""
