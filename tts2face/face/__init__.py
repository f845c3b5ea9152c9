"""Linear face models: deformation, expressions, lip and lid constraints, gestures, and what moves by itself."""
