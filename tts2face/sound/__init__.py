"""Sound: voices that speak phones, and the analysis of recordings into features and phone edges."""
