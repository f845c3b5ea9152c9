"""Speech analysis: phone edges and features of sound."""
