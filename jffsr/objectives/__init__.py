"""Named terms of a planning index, published and smooth, and their weighted sum."""
