"""One file for each family of published methods, and the registry that lists them.

A method takes `Readings` and settings and gives an `Estimate`. Calls `core`; knows no file.
"""
