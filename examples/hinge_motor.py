"""A motor in a hinge opens a door until the hinge's limit stops it; the motor's torque and the limit's are read back.

    python hinge_motor.py
"""

import subadmm


def main():
    world = subadmm.World()
    door = world.add_solid(subadmm.box(0.4, 0.02, 1), mass=20, position=(0, 0, 1.1))
    motor = subadmm.Coordinate(
        drive="speed", target_speed=1, drive_force=15, limited=True, lower=0, upper=1.5, friction=0.2
    )
    # About z of its frame, which is put at the door's edge. Body a is None: the static world.
    hinge = world.add_joint("revolute", None, door, position=(-0.4, 0, 1.1), coordinates={5: motor})
    for _ in range(2):
        world.step(200)
        print(f"{world.report.time:.1f} s: angle {hinge.position[5]:.4f} rad, {hinge.speed[5]:.4f} rad/s, "
              f"motor {hinge.drive_force[5]:.2f} N m, limit {hinge.limit_force[5]:.2f} N m")
    return hinge


if __name__ == "__main__":
    main()
