#!/usr/bin/env python3
"""How often `diagnose --against` says that a field changed: where nothing did, and where something small came into the room.

against_alarms.py FIELDTRUE-CLI ROOMS-FOLDER [PAIRS]

Each room is recorded twice, with other placing errors and noise: on one grid, or on random places of one box, other ones each
time, with some orientations or one; 4 slips of centimetres among them in the rows named so. Then the second recording is made
with a metal sphere more, at a random place in the box: how often the change is told, by the RMS that the sphere moves readings
by (told by `simulate` without noise, not by the program's judgement), how often metal is named, and how far off it is put.
"""
import json
import math
import multiprocessing
import os
import random
import sys
import tempfile

from difference_alarms import BOX, SLIPS, Study, moved_mm

KINDS = (("same grid", 100, 1, 0), ("other places", 40, 1, 0), ("other places", 120, 1, 0), ("other places", 120, 1, SLIPS),
         ("same grid", 100, 3, 0), ("other places", 120, 3, 0))


def plan(study, draw, kind, count, orientations):
    """Places of a grid of five layers of four by five, the same each time, or drawn anew."""
    nodes = []
    for k in range(count):
        if kind == "same grid":
            index = (k % 5, (k // 5) % 4, k // 20)
            place = [low + (high - low) * i / (n - 1) for (low, high), i, n in zip(BOX, index, (5, 4, 5))]
        else:
            place = [draw.uniform(*side) for side in BOX]
        angle = 2 * math.pi * (k % orientations) / orientations
        nodes.append(dict(zip(("x_m", "y_m", "z_m"), place), node=k, qw=math.cos(angle / 2), qx=0, qy=0,
                          qz=math.sin(angle / 2)))
    return study.write("p.plan.json", {"schema": "fieldtrue.plan/1", "nodes": nodes})


def against(study, earlier, later):
    report = study.at("r.gap.json")
    study.run("diagnose", "--threads", "1", "--nodes", later, "--against", earlier, "--out", report)
    with open(report) as file:
        return json.load(file)["against"]


def alarm(job):
    program, scene, kind, count, orientations, slips, pair = job
    with tempfile.TemporaryDirectory() as folder:
        study = Study(program, folder)
        draw = random.Random(f"{scene} {kind} {count} {orientations} {slips} {pair}")
        a = study.record(scene, plan(study, draw, kind, count, orientations), 2 * pair + 1, "a", slips)
        b = study.record(scene, plan(study, draw, kind, count, orientations), 2 * pair + 2, "b", slips)
        return against(study, a, b)["changed"]


def finding(job):
    program, scene, kind, count, radius, pair = job
    with tempfile.TemporaryDirectory() as folder:
        study = Study(program, folder)
        draw = random.Random(f"sphere {kind} {radius} {pair}")
        center = [draw.uniform(*side) for side in BOX]
        with open(scene) as file:
            after = json.load(file)
        after["effects"].append({"id": "compact_metal", "parameters": {"center_m": center, "radius_m": radius,
                                                                       "material": "conductive"}})
        other = study.write("after.scene.json", after)
        try:
            a = study.record(scene, plan(study, draw, kind, count, 1), 2 * pair + 1, "a")
            plan_b = plan(study, draw, kind, count, 1)
            b = study.record(other, plan_b, 2 * pair + 2, "b")
            moved = moved_mm(study, scene, other, plan_b, 7)
        except RuntimeError:
            return None  # A place inside the metal.
        told = against(study, a, b)
        off = math.dist(told["location_m"], center) if told["location_m"] else None
        return moved, told["changed"], told["effect"], off


def middle(values):
    values = sorted(values)
    return values[len(values) // 2] if values else float("nan")


def main():
    program, rooms = sys.argv[1:3]
    pairs = int(sys.argv[3]) if len(sys.argv) > 3 else 25
    with multiprocessing.Pool(2) as pool:
        print(f"{'room':12} {'kind':13} places turns slips  said to have changed though nothing did")
        for room in ("clean", "steel_floor", "two_bodies", "mixed"):
            scene = os.path.join(rooms, room + ".scene.json")
            for kind, count, orientations, slips in KINDS:
                jobs = [(program, scene, kind, count, orientations, slips, pair) for pair in range(pairs)]
                alarms = sum(pool.map(alarm, jobs, chunksize=1))
                print(f"{room:12} {kind:13} {count:6} {orientations:5} {slips:5}  {alarms} of {pairs}", flush=True)
        print("\nA sphere more: said to have changed, by the RMS that it moves readings by")
        for room in ("clean", "steel_floor"):
            scene = os.path.join(rooms, room + ".scene.json")
            for kind, count in (("same grid", 100), ("other places", 120)):
                for radius in (0.03, 0.05, 0.08, 0.12):
                    jobs = [(program, scene, kind, count, radius, pair) for pair in range(pairs)]
                    found = [answer for answer in pool.map(finding, jobs, chunksize=1) if answer]
                    told = [answer for answer in found if answer[1]]
                    metal = [answer for answer in told if answer[2] == "compact_metal"]
                    print(f"{room:12} {kind:13} radius {radius:.2f} m, median {middle([f[0] for f in found]):6.2f} mm: "
                          f"{len(told)} of {len(found)}, named compact_metal {len(metal)} "
                          f"({100 * middle([m[3] for m in metal]):.0f} cm off), all "
                          f"{100 * middle([t[3] for t in told]):.0f} cm off", flush=True)


if __name__ == "__main__":
    main()
