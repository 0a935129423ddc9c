"""Station files: what is known of an instrument and its site, and how its logs are filtered, in one TOML file; and the
`Recipe` that comes of it. Calls `files` and, for the names of methods, `methods`.
"""

from ftproc.config.reading import load, parse
from ftproc.config.recipe import Recipe
from ftproc.config.writing import dump

__all__ = ["Recipe", "dump", "load", "parse"]
