"""What is simulated: dead zones, drive, pose, camera; and the signals that excite it."""
