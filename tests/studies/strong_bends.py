#!/usr/bin/env python3
"""Whether `diagnose` finds what bends readings by decimetres: floors, a wall and a body, on many plans.

strong_bends.py FIELDTRUE-CLI ROOMS-FOLDER [--rooms a,b] [--plans a,b] [--seeds N] [--untimed] [--processes N]

Each room is the shipped steel floor's with something else that errs in it; each plan is recorded from the rig's origin and,
of grids, from the origin that `plan` takes where none is stated, which goes down to the floor; random places lie in the box of
the rooms' grid. Each seed has placing errors and noise of its own, and random places. What was found is held against the
scene: of a plane the distance from the transmitter and the direction, of a body its centre. Printed: a recording a line, then
by room how many hold what a strong bend must: explained, within 10 cm and 5 degrees, less than 2 % of the square left.
"""
import argparse
import json
import math
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile

BOX_M = (2.44, 2.44, 1.83)
GRIDS = ("5x5x4@0.3", "6x6x5@0.25", "9x9x7@0.3048", "5x5x4@0.6096")
PLANS = tuple(grid + origin for grid in GRIDS for origin in ("", " default")) + ("random 60", "random 200")
NEAR_CM, NEAR_DEG, LEFT = 10, 5, 0.02
TIMES = ("t_start_s", "t_end_s")


def plane(toward, distance_m, material, strength):
    return {"id": "metal_plane", "parameters": {"toward": toward, "distance_m": distance_m, "material": material,
                                                "strength": strength}}


def body(center_m, radius_m, material):
    return {"id": "compact_metal", "parameters": {"center_m": center_m, "radius_m": radius_m, "material": material}}


DOWN, ASIDE = (0, 0, -1), (0, -1, 0)
ROOMS = {"steel_floor": None,
         "ferrous_floor_near": plane(DOWN, 1.35, "ferromagnetic", 0.6),
         "ferrous_floor_deep": plane(DOWN, 1.8, "ferromagnetic", 1.0),
         "conducting_floor_near": plane(DOWN, 1.25, "conductive", 0.5),
         "conducting_floor_deep": plane(DOWN, 1.75, "conductive", 1.0),
         "wall": plane(ASIDE, 1.7, "conductive", 0.8),
         "body_below": body((1.3, -0.5, -1.5), 0.5, "conductive"),
         "body_beside": body((1.2, -1.75, -0.5), 0.5, "conductive")}


def scene_of(rooms, room):
    with open(os.path.join(rooms, "steel_floor.scene.json"), encoding="utf-8") as file:
        scene = json.load(file)
    if ROOMS[room]:
        scene["effects"] = [ROOMS[room]]
    return scene


def plan_of(plan, seed, folder):
    """The argument of --plan."""
    if not plan.startswith("random"):
        return "grid:" + plan.removesuffix(" default") + ("" if plan.endswith("default") else ":origin=0,0,0")
    draw = random.Random(f"{plan} {seed}")
    nodes = [dict({"node": k, "qw": 1, "qx": 0, "qy": 0, "qz": 0},
                  **{axis: draw.uniform(0, side) for axis, side in zip(("x_m", "y_m", "z_m"), BOX_M)})
             for k in range(int(plan.split()[1]))]
    path = os.path.join(folder, "p.plan.json")
    with open(path, "w", encoding="utf-8") as file:
        json.dump({"schema": "fieldtrue.plan/1", "nodes": nodes}, file)
    return path


def angle_deg(a, b):
    cosine = sum(x * y for x, y in zip(a, b)) / math.hypot(*a) / math.hypot(*b)
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


def how_near(effect, found):
    """Centimetres and degrees between the scene's effect and the one found; none where it is another effect."""
    if not found or found["effect"] != effect["id"] or not found["location_m"]:
        return None
    truth, at_m = effect["parameters"], found["location_m"]
    if effect["id"] == "metal_plane":
        return 100 * abs(math.hypot(*at_m) - truth["distance_m"]), angle_deg(at_m, truth["toward"])
    return 100 * math.dist(at_m, truth["center_m"]), 0.0


def leave_out_times(path):
    """Of a node table, as of a tracker that states none."""
    with open(path, encoding="utf-8") as file:
        lines = file.read().splitlines()
    head = next(line for line in lines if not line.startswith("#")).split(",")
    kept = [at for at, name in enumerate(head) if name not in TIMES]
    with open(path, "w", encoding="utf-8") as file:
        for line in lines:
            cells = line.split(",")
            file.write((line if line.startswith("#") else ",".join(cells[at] for at in kept)) + "\n")


def study(job):
    """What became of one recording; None where the plan's places lie within the metal."""
    program, rooms, room, plan, seed, is_untimed = job
    with tempfile.TemporaryDirectory() as folder:
        nodes, report, scene_path = (os.path.join(folder, name) for name in ("n.nodes.csv", "r.gap.json", "s.scene.json"))
        scene = scene_of(rooms, room)
        with open(scene_path, "w", encoding="utf-8") as file:
            json.dump(scene, file)
        made = subprocess.run([program, "simulate", "--scene", scene_path, "--plan", plan_of(plan, seed, folder), "--seed",
                               str(seed), "--nodes", nodes], capture_output=True, check=False)
        if made.returncode:
            return room, plan, seed, None
        if is_untimed:
            leave_out_times(nodes)
        before_s = os.times().children_user
        subprocess.run([program, "diagnose", "--threads", "1", "--nodes", nodes, "--out", report], capture_output=True,
                       check=True)
        cpu_s = os.times().children_user - before_s
        with open(report, encoding="utf-8") as file:
            told = json.load(file)
    named = "+".join(found["effect"] for found in told["selected"]) or "nothing"
    near = how_near(scene["effects"][0], next(iter(told["selected"]), None))
    return room, plan, seed, (told["gap"]["position_rms_mm"], told["verdict"], named, near,
                              told["remaining"]["fraction_of_start"], cpu_s)


def holds(told):
    _, verdict, _, near, left, _ = told
    return verdict == "explained" and near is not None and near[0] <= NEAR_CM and near[1] <= NEAR_DEG and left < LEFT


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cli")
    parser.add_argument("rooms_folder")
    parser.add_argument("--rooms", default=",".join(ROOMS))
    parser.add_argument("--plans", default=",".join(PLANS))
    parser.add_argument("--seeds", type=int, default=3, help="recordings of each plan")
    parser.add_argument("--untimed", action="store_true", help="leave the times of the rows out")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    given = parser.parse_args()
    jobs = [(given.cli, given.rooms_folder, room, plan, seed, given.untimed) for room in given.rooms.split(",")
            for plan in given.plans.split(",") for seed in range(1, 1 + given.seeds)]
    counts = {}
    print("room                   plan                 seed      bend  verdict           left     off            CPU  named")
    with multiprocessing.Pool(given.processes) as pool:
        for room, plan, seed, told in pool.imap(study, jobs):
            if told is None:
                print(f"{room:22} {plan:20} {seed:4}  its places lie within the metal", flush=True)
                continue
            held, of = counts.get(room, (0, 0))
            counts[room] = held + holds(told), of + 1
            bend_mm, verdict, named, near, left, cpu_s = told
            off = f"{near[0]:5.1f} cm {near[1]:4.1f} deg" if near else "              -"
            print(f"{room:22} {plan:20} {seed:4} {bend_mm:6.0f} mm  {verdict:16} {100 * left:5.1f} %  {off} {cpu_s:6.1f} s  "
                  f"{named}", flush=True)
    print("\n| room | as a strong bend must be |\n|---|---|")
    for room, (held, of) in counts.items():
        print(f"| {room} | {held} of {of} |")


if __name__ == "__main__":
    sys.exit(main())
