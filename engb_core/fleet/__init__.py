"""What many diagnoses say together: common causes, differences between units, trends."""
