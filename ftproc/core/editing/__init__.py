"""Which readings are outliers: screening, two passes over the whole record, and the recursive gate of the paper.

`two_pass` leads through the former, `track` through the latter. Calls `core.identification` and the rooms below it.
"""
