"""Readings as they come: `live` takes them one by one and gives what is published, in the `order` of their times. A log
that is followed: `sources` give its bytes, `growing` and `forms` its lines, `columns` their readings, `stream` what is
published of them, `following` when, `state` keeps it for a crash, `publishing` and `outputs` write it. Calls the
methods, the files and the report, like the pipeline."""
