"""Speech synthesis: text to sound with phone edges."""
