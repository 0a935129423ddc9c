"""Station files: an instrument, its site and the settings for its logs in one TOML file; and the `Recipe` made from it.

Calls `files` and, for the names of methods, `methods`.
"""
