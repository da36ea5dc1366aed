"""What recording events costs a step, and 100 sensors beside it: python measure_events.py [--backend cuda] [--precision
f32] SCENE ...

Each scene is run three times from its start: as it is, with events recorded, and with 100 balls of 0.1 m as sensors on
its first bodies besides. 50 steps, then STEPS that are timed. The last column: are the three states the same to the
bit?
"""

import argparse
import time

import subadmm

STEPS, SENSORS = 300, 100


def run(spec, given, recorded, sensors):
    """(ms a step, events, hash, contacts)"""
    world = subadmm.scene(spec, backend=given.backend, precision=given.precision)
    for body in world.bodies[1 : 1 + sensors]:
        body.add_shape(subadmm.sphere(0.1, sensor=True))
    if recorded:
        world.record_events()
    world.step(50)
    begin = time.perf_counter()
    world.step(STEPS)
    spent = time.perf_counter() - begin
    return 1e3 * spent / STEPS, len(world.events()) if recorded else 0, world.state_hash(), world.report.contacts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", metavar="SCENE")
    parser.add_argument("--backend", default="cpu")
    parser.add_argument("--precision", default="f32")
    given = parser.parse_args()
    print("scene, contacts, ms a step: without, recorded (events), and sensors (events), same state")
    for spec in given.scenes:
        plain, recorded, seen = (run(spec, given, *what) for what in ((False, 0), (True, 0), (True, SENSORS)))
        print(f"{spec}, {plain[3]}, {plain[0]:.3f}, {recorded[0]:.3f} ({recorded[1]}), {seen[0]:.3f} ({seen[1]}), "
              f"{plain[2] == recorded[2] == seen[2]}")


if __name__ == "__main__":
    main()
