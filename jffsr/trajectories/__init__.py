"""Joint trajectories: free numbers in, position, rate and acceleration at any time out."""
