#!/usr/bin/env python3
"""Scene files changed for measurements:

    subadmm scenes pile:300 --json | bench/change_scene.py hulls > hulls.json
    subadmm scenes pile:200 --json | bench/change_scene.py floor > floor.json

hulls: every box becomes the hull of its eight corners. floor: the first body becomes a kinematic slab of 50 by 50 by 1
m (half extents), 1 m lower, that moves at 0.2 m/s along x.
"""
import itertools
import json
import sys


def hulls(scene):
    numbers = {}
    for shape in (s for body in scene["bodies"] for s in body["shapes"] if s["type"] == "box"):
        size = tuple(shape["size"])
        if size not in numbers:
            numbers[size] = len(scene["hulls"])
            corners = itertools.product(*[(-x, x) for x in size])
            scene["hulls"].append({"points": [list(p) for p in corners], "merge": 1e-6, "convex_radius": 0.0})
        shape.update(type="hull", size=[], hull=numbers[size])


def floor(scene):
    body = scene["bodies"][0]
    body.update(type="kinematic", linear_velocity=[0.2, 0, 0])
    body["position"][2] -= 1
    body["shapes"][0].update(type="box", size=[50, 50, 1])


if __name__ == "__main__":
    document = json.load(sys.stdin)
    {"hulls": hulls, "floor": floor}[sys.argv[1]](document)
    json.dump(document, sys.stdout)
