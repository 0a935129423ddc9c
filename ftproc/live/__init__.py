"""Readings as they come: `live` takes them one by one and gives what is published. A log that still grows: `growing`
gives its lines, `columns` their readings, `following` what is published of them, `publishing` writes it. Calls the
methods and the files, like the pipeline."""
