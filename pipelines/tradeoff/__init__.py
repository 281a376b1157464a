"""Speed against accuracy, measured on a scene (`moma trade`)."""
