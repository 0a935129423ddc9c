"""The experiments of the papers, done again: one page with the papers' figures beside ours.

Every module here but `page` is an experiment: it has a function `section(page: Page) -> str`, which returns Markdown
and saves its plots by `page.plot`. `ORDER` says where on the page it stands. Nothing else need be told of a new one.
"""
