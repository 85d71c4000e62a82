# SPDX-License-Identifier: GPL-2.0-or-later
"""Yade's bonded particle model JCFPM on the block of bench_dem: yade -n -x -j1 yade_jcfpm.py CELLS STEPS

Prints one line of JSON. The set-up is the fast one: a collider that runs only when particles have moved, no recorders.
"""
import json
import os
import random
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
from fcc_block import fcc_block  # noqa: E402
from yade import *  # noqa: E402,F403

cells, steps = int(sys.argv[1]), int(sys.argv[2])
radius = 5e-4
material = O.materials.append(JCFpmMat(type=1, young=1e12, poisson=0.25, density=2700., frictionAngle=0.46,
                                       tensileStrength=1e13, cohesion=1e13))
O.bodies.append([sphere(centre, radius, material=material) for centre in fcc_block(cells, radius)])
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.1, label="boxes")], verletDist=0.1 * radius),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.1, label="geometry")],
                    [Ip2_JCFpmMat_JCFpmMat_JCFpmPhys(cohesiveTresholdIteration=1)],
                    [Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM()]),
    NewtonIntegrator(damping=0.1)]
O.dt = 0.1 * PWaveTimeStep()
O.step()  # makes the bonds; from here on only touching pairs are new contacts
boxes.aabbEnlargeFactor = geometry.interactionDetectionFactor = 1.
source = random.Random(1)
for body in O.bodies:
    body.state.vel = [0.1 * source.uniform(-1., 1.) for _ in range(3)]
O.run(max(2, steps // 10), True)

begin_wall, begin_cpu = time.time(), time.process_time()
O.run(steps, True)
cpu, wall = time.process_time() - begin_cpu, time.time() - begin_wall
bonds = sum(1 for i in O.interactions if i.isReal and i.phys.isCohesive)
print("result " + json.dumps({"particles": len(O.bodies), "bonds": bonds, "steps": steps, "cpu": cpu, "wall": wall}))
