"""Kinds of file, one module each: a file's table header first, its columns as Arrow arrays on demand.

`tables` knows which module reads which kind. Calls `files`; knows no quantity, unit or record.
"""
