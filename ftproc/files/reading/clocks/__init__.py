"""Times of a log -> seconds: `times` is the entry, `notations` holds the ways to write times, `numeric` those to count.

Calls `files` and `files.reading.meaning.numbers`.
"""
