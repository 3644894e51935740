"""A ball on the taxels of a sensor in MuJoCo: the taxels read its weight.

    pip install mujoco numpy
    taxel export three-axis-8x8 --to mjcf -o taxels.xml
    python examples/mujoco_touch.py taxels.xml

Includes the exported taxels in a world, lays a ball of 2 g on them, waits until it rests, and
prints the sum of the force sensors beside the weight and beside the forces of all contacts. Ends
with 1 if the sum differs from the weight by more than 0.1 %.

The contacts that it prints last, a point and a force each, are what
`Sensor.loads_from_contacts` of the library takes: rigid contact lights a few taxels, the soft
cover of the device spreads it.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

MASS = 2e-3  # kg
RADIUS = 4e-3  # m
ALLOWED = 1e-3  # of the weight

WORLD = """
<mujoco>
  <option timestep="0.0002" integrator="implicitfast" cone="elliptic"/>
  <include file="{taxels}"/>
  <worldbody>
    <body name="ball" pos="0.0003 0.0002 {height}">
      <freejoint/>
      <geom name="ball" type="sphere" size="{radius}" mass="{mass}" condim="6"
            friction="1 0.005 0.001" solref="0.005 1"/>
    </body>
  </worldbody>
</mujoco>
"""


def main():
    taxels = Path(sys.argv[1] if len(sys.argv) > 1 else "taxels.xml").resolve()
    world = WORLD.format(taxels=taxels, height=RADIUS + 2e-4, radius=RADIUS, mass=MASS)
    model = mujoco.MjModel.from_xml_string(world)
    data = mujoco.MjData(model)
    while data.time < 2.0:
        mujoco.mj_step(model, data)

    # A force sensor gives what the rest of the world does to its body; the weight of the box of a
    # taxel itself is in it, too.
    forces = np.zeros(3)
    lit = 0
    for sensor in range(model.nsensor):
        body = model.site_bodyid[model.sensor_objid[sensor]]
        turn = data.site_xmat[model.sensor_objid[sensor]].reshape(3, 3)
        address = model.sensor_adr[sensor]
        force = turn @ data.sensordata[address : address + 3]
        force += model.body_mass[body] * model.opt.gravity
        forces += force
        lit += np.linalg.norm(force) > 1e-6
    weight = MASS * -model.opt.gravity[2]
    total = forces[2]

    contacts = np.zeros(3)
    points = []
    for number in range(data.ncon):
        wrench = np.zeros(6)
        mujoco.mj_contactForce(model, data, number, wrench)
        contact = data.contact[number]
        # The frame of a contact has its normal first, from the first body to the second.
        ball_is_second = model.geom(contact.geom2).name == "ball"
        on_ball = contact.frame.reshape(3, 3).T @ wrench[:3] * (1 if ball_is_second else -1)
        contacts += on_ball
        points.append((contact.pos.copy(), -on_ball))

    print(f"weight                 {1e3 * weight:10.4f} mN")
    print(f"sum of the taxels      {1e3 * total:10.4f} mN, off by {abs(total / weight - 1):.1e}")
    print(f"sum of the contacts    {1e3 * contacts[2]:10.4f} mN")
    print(f"taxels that read more than 1 uN: {lit} of {model.nsensor}")
    for point, force in points:
        print(f"contact at {1e3 * point} mm with {1e3 * force} mN")
    if not abs(total / weight - 1) <= ALLOWED:
        sys.exit(1)


if __name__ == "__main__":
    main()
