"""A thousand grippers close on what they stand over, lift it and shake it: targets of all of them are set at once.

    python thousand_grippers.py                     # 1000, on what is there
    python thousand_grippers.py --count 20 --backend cpu
    python thousand_grippers.py --backend cuda --precision f32

The world is that of the scene "grippers:1000" (docs/guide/scenes.md): each gripper is a palm that a coupling leads, and
two fingers on sliding joints, with a box, a ball or a capsule of 0.2 to 1 kg between them. The scene's own script is
left out.
"""

import argparse
import time

import numpy as np

import subadmm

LIFT, SQUEEZE = 0.2, 0.012  # m: how far up; how far into the object the fingers' targets are
CLOSED, LIFTED, SHAKEN = 0.6, 1.6, 2.6  # s: when these are done


def smooth(x):
    """From 0 to 1 while x is, with slopes of 0 at the ends."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


class Grippers:
    """Rows of the world's arrays: body 0 is the ground, then palm, left, right finger and object of each gripper;
    joints 2 a gripper, couplings 1."""

    def __init__(self, count, backend, precision):
        # As a file it has no script: what moves is what is set here.
        file = subadmm.scene(f"grippers:{count}").to_json()
        self.world = world = subadmm.scene_from_json(file, backend=backend, precision=precision)
        self.count = count
        state = world.get("body_state")[1:].reshape(count, 4, 13)
        self.home = state[:, 0, :7]  # of the palms
        # What is between a finger and the object. Half their widths are the first of their sizes, in every form.
        widths = np.array([shape.definition.size[0] for shape in world.shapes[1:]]).reshape(count, 4)
        self.way = state[:, 2, 0] - state[:, 0, 0] - widths[:, 2] - widths[:, 3] + SQUEEZE
        self.targets = world.get("joint_target_position")
        self.leads = world.get("coupling_target")
        turns = 2.4 * np.arange(count)
        self.shake = 0.02 * np.stack([np.cos(turns), np.sin(turns), np.zeros(count)], axis=1)  # each its own way, m
        self.held_at = None

    def palms_at(self, t):
        on = smooth((t - LIFTED) / 0.2) * smooth((SHAKEN - t) / 0.2)
        up = np.array([0, 0, LIFT * smooth((t - CLOSED) / (LIFTED - CLOSED))])
        return self.home[:, :3] + up + on * np.sin(2 * np.pi * 3 * t) * self.shake

    def step(self):
        """One step, with the targets of all grippers for its end."""
        world = self.world
        dt = world.settings.dt
        t = world.report.time
        closed = self.way * smooth((t + dt) / (CLOSED - 0.1))
        self.targets[0::2, 2], self.targets[1::2, 2] = closed, -closed
        world.set("joint_target_position", self.targets)
        now, then = self.palms_at(t), self.palms_at(t + dt)
        self.leads[:, :3], self.leads[:, 7:10] = then, (then - now) / dt
        world.set("coupling_target", self.leads)
        world.step()

    def objects_in_hand(self):
        """Where objects are from their palms (along the world's axes: palms do not turn), m, n x 3; and all states."""
        state = self.world.get("body_state")[1:].reshape(self.count, 4, 13)
        return state[:, 3, :3] - state[:, 0, :3], state


def main(arguments=None):
    parser = argparse.ArgumentParser(description="Many grippers, by arrays.")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--backend", default="auto", choices=["auto", "ref", "cpu", "cuda"])
    parser.add_argument("--precision", default="f64", choices=["f32", "f64"])
    given = parser.parse_args(arguments)
    grippers = Grippers(given.count, given.backend, given.precision)
    world, dt = grippers.world, grippers.world.settings.dt
    steps = round((SHAKEN + 0.2) / dt)
    closed, begin = None, time.perf_counter()
    for step in range(steps):
        grippers.step()
        if closed is None and (step + 1) * dt >= CLOSED:
            closed, _ = grippers.objects_in_hand()
    seconds = time.perf_counter() - begin
    end, state = grippers.objects_in_hand()
    slip = np.linalg.norm(end - closed, axis=1)
    held = (slip < 0.005) & (state[:, 0, 2] - grippers.home[:, 2] > 0.95 * LIFT)
    print(
        f"{given.count} grippers on {world.report.backend}: {steps} steps in {seconds:.2f} s, "
        f"{steps / seconds:.1f} steps/s, {given.count * steps / seconds:.0f} gripper steps/s"
    )
    print(
        f"{held.sum()} of {given.count} hold what they lifted by {LIFT} m and shook; "
        f"slip {1e3 * slip.max():.3f} mm at most"
    )
    return held, slip


if __name__ == "__main__":
    main()
