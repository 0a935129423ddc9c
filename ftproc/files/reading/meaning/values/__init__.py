"""What the values of a log show of what its names leave open, or say wrongly.

`deciding` weighs the `ways` in which a log may be meant by the `motion` of its target; `asking` puts the question where
that is not enough. `plausibility` knows the sizes of angles, `stamps` coarse clocks.
"""
