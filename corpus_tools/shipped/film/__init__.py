"""Film light: a path tracer lights a character's meshes, and its light is baked into components that are drawn live."""
