"""What a whole clip tells: its clock, the shake of the camera, the error bars, whether it is a pendulum at all."""
