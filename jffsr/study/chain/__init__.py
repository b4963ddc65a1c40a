"""The whole chain: a tumbling target seen, predicted, reached, grasped, and the base then held still."""
