"""How a network is trained: samples, genetic search, descent, and what held-out flights say of it.

Calls `correction`; `flights` also calls `methods`, `quality` and `scoring`.
"""
