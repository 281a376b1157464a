"""Contact laws: each turns what is known of its contacts into a shift and a cone."""
