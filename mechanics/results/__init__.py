"""Results: contacts, joints, stresses."""
