"""The one definition of each torque: plant, inverse dynamics, simulation, what is compiled."""
