"""The force of the ground on a box that is pushed: as a sum, point by point, and the event of its landing.

    python contact_force.py
"""

import subadmm


def main():
    world = subadmm.World()
    world.add_ground(friction=0.5)
    box = world.add_solid(subadmm.box(0.1, 0.1, 0.1, friction=0.5), mass=2, position=(0, 0, 0.12))
    world.record_events()
    world.step(100)
    box.set_wrench((8, 0, 0))  # N, less than friction can hold
    world.step(100)

    print("contacts push the box with", box.contact_wrench[:3], "N")
    contacts = world.contacts()
    normal = (contacts["force"] * contacts["normal"]).sum(axis=1)
    for place, force in zip(contacts["position"], normal):
        print(f"  point ({place[0]:.2f}, {place[1]:.2f}): normal force {force:.3f} N")

    events = world.events()
    begun = events[events["type"] == subadmm.CONTACT_BEGUN]
    for event in begun:
        print(f"step {event['step']}: two shapes touch, at {event['speed']:.3f} m/s")
    return box, normal, begun


if __name__ == "__main__":
    main()
