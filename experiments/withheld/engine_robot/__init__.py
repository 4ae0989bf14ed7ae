"""A differential-drive robot in the physics engine MuJoCo (extra `mujoco`)."""
