"""A clip of `--export clip.glb` as .fbx, with the animation of its shapes.

Blender sends the animation of shapes only where an object has an action, and cuts it to that action's frames. The head
of a face has one of the whole length; a character whose file has no head gets one that moves nothing. By Blender, or
its package (`pip install bpy`):

    tts2face "Hello there." --export clip.glb
    blender --background --python glb_to_fbx.py -- clip.glb clip.fbx
    python glb_to_fbx.py clip.glb clip.fbx
"""

import json
import struct
import sys
from pathlib import Path

import bpy

source, target = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
content = Path(source).read_bytes()
length = struct.unpack_from("<I", content, 12)[0]
document = json.loads(content[20 : 20 + length])
times = document["accessors"][document["animations"][0]["samplers"][0]["input"]]
start = document["bufferViews"][times["bufferView"]].get("byteOffset", 0) + times.get("byteOffset", 0)
rate = round(1 / struct.unpack_from("<f", content, 28 + length + start + 4)[0], 3)  # of the second key

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = round(rate)
scene.render.fps_base = round(rate) / rate  # 29.97 is 30 over 1.001
bpy.ops.import_scene.gltf(filepath=source, disable_bone_shape=True)  # no ball in place of each bone
for mesh in bpy.data.meshes:  # materials of FBX show no colours of vertices: those without a texture get their mean
    colours = mesh.color_attributes.active_color
    for number, material in enumerate(mesh.materials if colours else ()):
        faces = [face for face in mesh.polygons if face.material_index == number]
        at = [i for face in faces for i in (face.vertices if colours.domain == "POINT" else face.loop_indices)]
        means = [sum(colours.data[i].color[axis] for i in at) / max(len(at), 1) for axis in range(3)]
        if not any(node.type == "TEX_IMAGE" for node in material.node_tree.nodes):
            material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*means, 1)
last = max((action.frame_range[1] for action in bpy.data.actions), default=0)
scene.frame_start, scene.frame_end = 0, round(last)
if not any(one.animation_data and one.animation_data.action for one in bpy.data.objects):
    still = bpy.data.objects[0]
    for frame in (0, last):
        still.keyframe_insert("location", frame=frame)
bpy.ops.export_scene.fbx(filepath=target, add_leaf_bones=False, path_mode="COPY", embed_textures=True)
print(f"{target}: {last / rate:.2f} s at {rate:g} frames a second")
