"""The motion of a pendulum, how a camera sees it, and their fits."""
