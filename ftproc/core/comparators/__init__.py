"""The filters that the main one is compared with: robust, adaptive, multiple-model, per-channel, ensemble, particle.

Calls the rest of the core; nothing there calls it. `methods` makes methods of what is here.
"""
