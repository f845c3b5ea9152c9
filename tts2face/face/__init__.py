"""Linear face models and the way of motion onto them."""
