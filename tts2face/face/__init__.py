"""Linear face models: deformation, expressions, lip and lid constraints, and transfer of motion to them."""
