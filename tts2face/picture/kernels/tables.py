"""Columns of the vertex and material tables, and rows of the fragment table, that the drawing kernels share."""

# Columns of the material table; the first five become rows of the fragment table.
GLOSS, ROUGHNESS, SECOND_LOBE, DARK_GLOSS, OPACITY, WRAP, TEXTURE, OPEN_SURFACE, EYE = range(9)
N_MATERIAL_COLUMNS = 9
# Columns of the vertex table: 3, 3, 3, 4, 3, 2 numbers. Exposure: to the sky, the key light and the rim lights.
CAMERA, NORMAL, DIFFUSE, EXPOSURE, COLOUR, UV = 0, 3, 6, 9, 13, 16
N_VERTEX_COLUMNS = 18
N_EXPOSURES = 4
# Rows of the fragment table: normal 3, albedo 3, diffuse light 3, exposure 4, ray 2, material 5, glow, samples.
AT_NORMAL, AT_ALBEDO, AT_DIFFUSE, AT_EXPOSURE, AT_RAY, AT_GLOSS, AT_ROUGHNESS = 0, 3, 6, 9, 13, 15, 16
AT_SECOND_LOBE, AT_DARK_GLOSS, AT_OPACITY, AT_GLOW, AT_SHARE = 17, 18, 19, 20, 21
N_ROWS = 22
