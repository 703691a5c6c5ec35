# SPDX-License-Identifier: Apache-2.0
"""Renders a volume with Blender's Cycles as the scene of interop.py says:
blender -b --python blender_render.py -- VOLUME.vdb PICTURE.exr COLOUR_GRID"""
import sys

import bpy

args = sys.argv[sys.argv.index("--") + 1:]
volume, picture, colour = args
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.object.volume_import(filepath=volume, align="WORLD", location=(0, 0, 0))
volume_object = bpy.context.object
volume_object.rotation_euler = (0, 0, 0)  # the axes of the file
grids = volume_object.data.grids
grids.load()
names = " ".join(sorted(f"{g.name}/{g.data_type}" for g in grids))
print("grids:", names, "error:", grids.error_message or "none")

material = bpy.data.materials.new("volume")
material.use_nodes = True
nodes = material.node_tree.nodes
nodes.clear()
shader = nodes.new("ShaderNodeVolumePrincipled")
shader.inputs["Density"].default_value = 1
shader.inputs["Density Attribute"].default_value = "density"
shader.inputs["Color Attribute"].default_value = colour
output = nodes.new("ShaderNodeOutputMaterial")
material.node_tree.links.new(shader.outputs["Volume"], output.inputs["Volume"])
volume_object.data.materials.append(material)

camera = bpy.data.cameras.new("camera")
camera.type = "ORTHO"
camera.ortho_scale = 0.8
camera_object = bpy.data.objects.new("camera", camera)
camera_object.location = (0.55, 0.3, 2.0)  # looks along -z with y up, as a new camera does
bpy.context.collection.objects.link(camera_object)

scene = bpy.context.scene
scene.camera = camera_object
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = 16
scene.cycles.use_denoising = False
scene.cycles.volume_step_rate = 0.2
scene.cycles.pixel_filter_type = "BOX"
scene.render.resolution_x, scene.render.resolution_y = 160, 120
scene.render.film_transparent = True
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_mode = "RGBA"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = picture
bpy.ops.render.render(write_still=True)
