"""What a browser runs of a page (`page.js`, `page.css`), and the browser that prints one to PDF.

Calls `files`; only `report` and `report.fused` call it.
"""
