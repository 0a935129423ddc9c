"""Texts that are no plain table: a table inside another language, and lines or records of names and values."""
