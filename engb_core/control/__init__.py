"""The controller's parts: trajectory, PID, feedforward, disturbance observer, and their loop."""
