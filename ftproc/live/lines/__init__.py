"""Bytes that come -> lines (`growing`), plots (`plots`) or lines of a table (`forms`)."""
