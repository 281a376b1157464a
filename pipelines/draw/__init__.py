"""Pictures of surveys, joints and results."""
