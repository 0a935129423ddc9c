"""What flight-test engineers read off a trajectory: speeds, angles and loads with their sigmas, and their extremes.

    quantities.Derived.of(trajectory).columns()     # ground_speed_mps, ..., sigma_load_factor
    extremes.extremes(trajectory)                   # the fastest moment, the highest, ... each with its time and sigma

The formulas are those of `core.model.kinematics`. With a site the vertical is that of the ellipsoid below the target,
so that the climb rate is the rate of `height_m`; without one it is the z axis. Calls `core.model` and `files.writing`.
"""
