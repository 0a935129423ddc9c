"""Logs as instruments, receivers and people write them, made here, each with its truth and the options that no program
can know."""
