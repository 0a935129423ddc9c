"""Readings as they come: `live` takes them one by one and gives what is published, `following` reads a log that still
grows. Calls the methods and the files, like the pipeline."""
