"""A box falls on the ground and comes to rest; its contact forces add up to its weight.

    python falling_box.py
"""

import subadmm


def main():
    world = subadmm.World()
    world.add_ground()
    box = world.add_solid(subadmm.box(0.1, 0.1, 0.1), mass=2, position=(0, 0, 0.15))
    for _ in range(4):
        world.step(50)
        print(f"{world.report.time:.2f} s: z = {box.position[2]:.5f} m, {world.report.contacts} contacts")
    force, weight = box.contact_wrench[2], box.mass * 9.81
    print(f"the ground bears {force:.6f} N of {weight:.6f} N")
    return force, weight


if __name__ == "__main__":
    main()
