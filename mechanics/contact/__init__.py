"""Contact detection: from the predicted configuration to contact points."""
