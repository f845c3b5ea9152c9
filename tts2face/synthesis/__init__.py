"""What joins the rooms: text, recordings and performances become clips."""
