"""The command line: one file for each command, which parses its options, makes one call and prints.

Calls everything; nothing calls it. A command loads what it needs when it runs, so that help is immediate.
"""
