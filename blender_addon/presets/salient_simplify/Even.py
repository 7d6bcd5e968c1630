# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

bpy.context.scene.salient_simplify.use_preset("even")
