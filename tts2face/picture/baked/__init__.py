"""Pictures of faces with baked light: what is nearest in each sample, then one colour for each surface in a pixel."""
