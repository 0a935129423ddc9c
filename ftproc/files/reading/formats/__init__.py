"""Kinds of file, one module each: a file's table header first, its columns as Arrow arrays on demand.

`tables` knows which module reads which kind; `packing` unpacks; `layout` finds the table in a text. Calls `files`;
knows no quantity and no record.
"""
