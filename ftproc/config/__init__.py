"""Station files: an instrument, its site and the settings for its logs in one TOML file; and the `Recipe` made from it.

Calls `files` and, for the names of methods, `methods`.
"""

from ftproc.config.reading import load, parse
from ftproc.config.recipe import Recipe
from ftproc.config.writing import dump

__all__ = ["Recipe", "dump", "load", "parse"]
