"""A replay as a MuJoCo model: every solid a mesh on a body that is put where the replay says."""

from __future__ import annotations

import mujoco
import numpy as np

from jffsr.viz.replay.film.camera import FIELD, Camera, view_axes
from jffsr.viz.replay.film.facets import corner_normals
from jffsr.viz.replay.film.sky import sky
from jffsr.viz.replay.replay import Replay

_SHADOWS = (512, 2048)
"""Sides of the shadows' map at least and at most, pixels: three for each of the tile's height, in powers of two."""
_SMOOTHING = 4  # samples of a pixel
_SUN = np.array([-0.55, 0.75, 0.85])
"""Where the light comes from: to the right, up, to the camera."""
_RIM = np.array([0.8, 0.2, -0.75])


def film_model(replay: Replay, camera: Camera, width: int, height: int) -> mujoco.MjModel:
    """The model to draw in a tile of this size: mocap body i is solid i, with geom i."""
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.global_.fovy = FIELD
    spec.visual.quality.offsamples = _SMOOTHING
    spec.visual.quality.shadowsize = int(np.clip(2 ** round(np.log2(3 * height)), *_SHADOWS))
    # Only ways, arrows and axes are made of these.
    spec.visual.quality.numslices, spec.visual.quality.numstacks = 14, 8
    # All lengths below are measured in the extent.
    spec.stat.center, spec.stat.extent = camera.look_at, camera.distance
    spec.visual.map.znear, spec.visual.map.zfar = 0.02, 20.0
    spec.visual.map.shadowclip = 0.6
    spec.visual.headlight.ambient = [0.30, 0.31, 0.34]
    spec.visual.headlight.diffuse = [0.16, 0.16, 0.17]
    spec.visual.headlight.specular = [0.0, 0.0, 0.0]
    axes = view_axes(camera.azimuth, camera.elevation)
    _add_light(spec, camera, _SUN @ axes, [0.72, 0.70, 0.66], shadow=True)
    _add_light(spec, camera, _RIM @ axes, [0.18, 0.22, 0.30], shadow=False)
    _add_sky(spec)
    material = spec.add_material(name="matter")
    material.specular, material.shininess = 0.22, 0.35
    for number, solid in enumerate(replay.solids):
        if len(solid.faces):
            _add_mesh(spec, f"mesh{number}", solid.vertices, solid.faces)
        body = spec.worldbody.add_body(name=f"solid{number}", mocap=True)
        geom = body.add_geom(contype=0, conaffinity=0, material="matter", rgba=[*solid.colour, 1.0])
        if len(solid.faces):
            geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_MESH, f"mesh{number}"
        else:
            # A body without any surface: nothing that could be seen.
            geom.type, geom.size, geom.group = mujoco.mjtGeom.mjGEOM_SPHERE, [1e-6, 0, 0], 5
    return spec.compile()


def _add_light(spec, camera: Camera, source: np.ndarray, colour, shadow: bool) -> None:
    direction = -source / np.linalg.norm(source)
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        # Shadows are cast from here.
        pos=camera.look_at - camera.distance * direction,
        dir=direction,
        diffuse=colour,
        ambient=[0.0, 0.0, 0.0],
        specular=[0.35, 0.35, 0.35] if shadow else [0.0, 0.0, 0.0],
        castshadow=shadow,
    )


def _add_sky(spec) -> None:
    faces = sky()
    texture = spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    texture.width, texture.height, texture.nchannel = faces.shape[1], faces.shape[0], 3
    texture.data = faces.tobytes()


def _add_mesh(spec, name: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    normals = corner_normals(vertices, faces)
    mesh = spec.add_mesh(name=name)
    mesh.uservert = vertices.ravel()
    mesh.userface = faces.ravel()
    mesh.usernormal = normals.ravel()
    mesh.userfacenormal = np.arange(3 * len(faces))
    # Surfaces that are open, or have two sides, hold no volume.
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
