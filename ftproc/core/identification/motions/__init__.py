"""The motion of a log: which model of it, abrupt changes, and what the log cannot show."""
