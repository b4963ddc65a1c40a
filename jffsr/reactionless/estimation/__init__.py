"""What the arm carries, estimated from what can be measured: the base's rate and the joints' positions and rates."""
