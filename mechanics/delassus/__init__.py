"""The Delassus operator in its forms: rigid bodies in space and plane, rigid with deformable, stored."""
