"""Files made to take the machine, to lead a reader astray, or to make it fail: one generator for each kind of reader.

`running` reads each in a process of its own, with limits of memory and time. All are the same for the same seed.
"""
