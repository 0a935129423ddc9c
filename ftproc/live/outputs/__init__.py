"""Where a stream goes: `rows` to standard output or a file that is seen to grow, `parquet` to one whose end is written
again, `page` shows the newest ones."""
