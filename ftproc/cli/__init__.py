"""The command line: one file for each command, which parses, makes one call and prints.

Calls everything; nothing calls it. What a command needs it loads when it runs, so that help comes at once.
"""
