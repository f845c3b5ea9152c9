"""What recorded gestures are like, and how near made ones come to them."""
