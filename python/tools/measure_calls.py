"""What calls from Python cost, and saved states: python python/tools/measure_calls.py"""
import time

import numpy as np

import subadmm


def best(call, count, rounds=5):
    """Seconds a call, the least of some rounds."""
    least = float("inf")
    for _ in range(rounds):
        begin = time.perf_counter()
        for _ in range(count):
            call()
        least = min(least, (time.perf_counter() - begin) / count)
    return least


def main():
    world = subadmm.World()
    world.add_ground()
    ball = world.add_solid(subadmm.sphere(0.1), mass=1, position=(0, 0, 5))
    out, empty = np.empty((2, 13)), subadmm.World()
    for name, call in [("contact_count", lambda: world.contact_count), ("position", lambda: ball.position),
                       ("get(out=)", lambda: world.get("body_state", out=out)),
                       ("get()", lambda: world.get("body_state")), ("step() of an empty world", empty.step)]:
        print(f"{name}: {1e6 * best(call, 4000):.2f} us")
    print(f"step(4000) of an empty world: {1e6 * best(lambda: empty.step(4000), 1) / 4000:.2f} us a step")
    for spec in ("settled_pile:10000", "hand_demo", "terrain:500"):
        world = subadmm.scene(spec, backend="cpu")
        world.step(3)
        saved = world.save()
        print(f"{spec}: {len(saved)} bytes, save {1e3 * best(world.save, 1):.2f} ms, "
              f"restore {1e3 * best(lambda: world.restore(saved), 1):.2f} ms")


if __name__ == "__main__":
    main()
