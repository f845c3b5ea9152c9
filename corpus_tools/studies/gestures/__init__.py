"""Statistics of recorded gestures, and the distance of synthesised ones from them."""
