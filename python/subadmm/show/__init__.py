"""Worlds to look at: pictures, recordings that play in a browser, glTF files, and a page with the running world.

    from subadmm import show

    show.save_picture("pile.png", world)
    show.record(world, seconds=5).save("pile.html")      # or .glb
"""
from .camera import Camera, camera_of, looking_at
from .description import Description, Group, describe
from .meshes import Mesh, mesh_of
from .picture import picture, render, save_picture
from .recording import Recording, record

__all__ = [
    "Camera",
    "Description",
    "Group",
    "Mesh",
    "Recording",
    "camera_of",
    "describe",
    "looking_at",
    "mesh_of",
    "picture",
    "record",
    "render",
    "save_picture",
]
