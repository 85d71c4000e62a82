# SPDX-License-Identifier: GPL-2.0-or-later
"""ESyS-Particle's brittle beams on the block of bench_dem: mpirun -n 2 esysparticle esys_brittle_beam.py CELLS STEPS

No damping and no contacts beside the bonds: the fastest set-up. One rank is the master, which only waits; CPU time is that of the other one. Prints one line of JSON.
"""
import json
import math
import os
import random
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
from fcc_block import fcc_block, fcc_bonds  # noqa: E402
from esys.lsm import BrittleBeamPrms, LsmMpi, RotSphere  # noqa: E402
from esys.lsm.geometry import TaggedIdConnection  # noqa: E402
from esys.lsm.util import BoundingBox, Vec3  # noqa: E402


def worker_cpu():
    """CPU time of the ranks started with this one [s]."""
    ticks, parent = 0, os.getppid()
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{name}/stat", encoding="ascii", errors="replace") as stat:
                fields = stat.read().rsplit(")", 1)[1].split()
        except OSError:
            continue  # gone meanwhile
        if int(fields[1]) == parent and int(name) != os.getpid():
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def main():
    cells, steps = int(sys.argv[1]), int(sys.argv[2])
    radius, density = 5e-4, 2700.
    mass = density * 4. / 3. * math.pi * radius**3
    simulation = LsmMpi(numWorkerProcesses=1, mpiDimList=[1, 1, 1])
    simulation.initNeighbourSearch(particleType="RotSphere", gridSpacing=2.5 * radius, verletDist=0.1 * radius)
    side = cells * 2**1.5 * radius
    simulation.setSpatialDomain(BoundingBox(Vec3(*[-3. * radius] * 3), Vec3(*[side + 3. * radius] * 3)))
    centres = fcc_block(cells, radius)
    source = random.Random(1)
    particles = []
    for number, centre in enumerate(centres):
        particle = RotSphere(number, Vec3(*centre), radius, mass)
        particle.setLinearVelocity(Vec3(*[0.1 * source.uniform(-1., 1.) for _ in range(3)]))
        particles.append(particle)
    simulation.createParticles(particles)
    bonds = fcc_bonds(cells)
    simulation.createConnections([TaggedIdConnection(first, second, 1) for first, second in bonds])
    young = 1e12
    simulation.createInteractionGroup(BrittleBeamPrms(name="bonds", youngsModulus=young, poissonsRatio=0.25, cohesion=1e13,
                                                      tanAngle=1., tag=1))
    simulation.setTimeStepSize(0.05 * math.sqrt(mass / (young * radius)))
    total = steps + max(2, steps // 10)
    simulation.setNumTimeSteps(total)
    for _ in range(total - steps):
        simulation.runTimeStep()
    begin_wall, begin_cpu = time.time(), worker_cpu()
    for _ in range(steps):
        simulation.runTimeStep()
    cpu, wall = worker_cpu() - begin_cpu, time.time() - begin_wall
    print("result " + json.dumps({"particles": len(centres), "bonds": len(bonds), "steps": steps, "cpu": cpu, "wall": wall}), flush=True)
    simulation.exit()


main()
