"""A character of an .fbx file as .glb, for `tts2face face import`.

Keeps meshes, shapes, skins and textures, which lie in the file or beside it; leaves animations out. By Blender, or its
package (`pip install bpy`):

    blender --background --python fbx_to_glb.py -- character.fbx character.glb
    python fbx_to_glb.py character.fbx character.glb
"""

import sys

import bpy

source, target = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.fbx_import(filepath=source)
shapes = set()
for one in bpy.data.objects:
    one.animation_data_clear()
    for bone in one.pose.bones if one.pose else ():
        bone.matrix_basis.identity()
for keys in bpy.data.shape_keys:
    keys.animation_data_clear()  # the pose of an animation is no rest
    for key in keys.key_blocks[1:]:
        key.value = 0
        shapes.add(key.name)
options = {"export_animations": False, "export_morph_normal": False, "export_vertex_color": "NONE"}  # FBX shows none
bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", **options)
print(f"{target}: {len(shapes)} shapes: {', '.join(sorted(shapes)[:5])}, ...")
