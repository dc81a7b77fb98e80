"""The fixed inputs of the comparison: what both builds are asked to do, in order.

Methods, effects and formats are those that the old build lists. Each step runs in the folder of its build, so that names
of files are the same for both; what a step writes is the input of later ones.
"""
import csv
import io
import json
import os
import re
import shutil
import subprocess
import threading
from dataclasses import dataclass
from typing import Callable, Optional

ENVIRONMENT = {"LC_ALL": "C.UTF-8", "TZ": "UTC"}
PARTS = ("lists", "simulate", "fit", "export", "compare", "gap", "session", "recordings", "refusals", "blind")
PLAN = "grid:4x4x3@0.3:origin=0.6,-0.45,-0.3:order=random:seed=3"
# Bent so little that methods which need a straight grid take it.
MILD_SCENE = {"schema": "fieldtrue.scene/1", "rig": {"tolerance_m": 0.0005, "tolerance_rad": 0.001},
              "effects": [{"id": "compact_metal", "parameters": {"center_m": [1.0, 0.0, -1.0], "radius_m": 0.12}}]}


@dataclass
class Step:
    """One run of a program; `before` is done first, and alone where no program is named."""

    name: str
    words: list
    program: str = "fieldtrue-cli"
    before: Optional[Callable] = None
    last_line_only: bool = False


# Tables and scenes that are made from what a build wrote.


def edited_table(build, source, target, edit):
    """Writes a table again with its rows (dictionaries) edited; a column that no row has any more is left out."""
    with open(os.path.join(build.work, source), encoding="utf-8") as file:
        lines = file.read().splitlines(keepends=True)
    head = [line for line in lines if line.startswith("#")]
    rows = edit(list(csv.DictReader(line for line in lines if not line.startswith("#"))))
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    build.write(target, ("".join(head) + text.getvalue()).encode())


def positions_only(rows):
    return [{key: value for key, value in row.items() if not re.match("q[wxyz]|sd_rot", key)} for row in rows]


def with_validation(rows):
    return [{**row, "role": "validation" if int(row["node"]) % 5 == 2 else "fit"} for row in rows]


def two_sensors(rows):
    return rows + [{**row, "sensor": "1"} for row in rows]


def in_millimetres(rows):
    return [{key: str(1000 * float(value)) if key in ("x_m", "y_m", "z_m") else value for key, value in row.items()}
            for row in rows]


def without_times(rows):
    return [{key: value for key, value in row.items() if not re.match("t_.*s$", key)} for row in rows]


def visible(parameter):
    """A value of an effect's parameter that shows: its default, or where that is zero a little of what is plausible."""

    def small(i):
        return 20.0 if parameter["unit"] == "s" else min(0.01 * (i + 1), 0.2 * (parameter["plausible_max"] or 1.0))

    value = parameter["default"]
    if isinstance(value, list):
        return value if any(value) else [small(i) for i in range(len(value))]
    return small(0) if value == 0 and not isinstance(value, bool) else value


def scene_of(effect):
    parameters = {one["name"]: visible(one) for one in effect["parameters"] if one["default"] is not None}
    return {"schema": "fieldtrue.scene/1", "rig": {"tolerance_m": 0.0005, "tolerance_rad": 0.001},
            "effects": [{"id": effect["id"], "parameters": parameters}]}


class Plan:
    """Collects the steps."""

    def __init__(self, build, root, data, parts):
        self.root, self.data, self.parts = root, data, parts
        self.steps, self.not_covered = [], []
        self.lists = {name: json.loads(build.asked(name, "--json")[0]) for name in ("methods", "effects", "formats")}
        known = build.asked("?")[1].strip().partition("known: ")[2]
        self.commands = known.split(", ") if known else []
        self.pages = json.loads(build.asked("guide", "--json")[0])["pages"] if "guide" in self.commands else []

    def cli(self, name, *words, **more):
        # One thread each: two builds run side by side.
        threads = [] if "--help" in words or words[0] in ("blind", "--version") else ["--threads", "1"]
        self.steps.append(Step(name, [*words, *threads], **more))

    def do(self, name, action):
        self.steps.append(Step(name, [], program="", before=action))

    def wants(self, part):
        return self.parts is None or part in self.parts

    def resource(self, *path):
        return os.path.join(self.root, "resources", *path)


def add_lists(plan):
    plan.cli("version", "--version")
    plan.cli("help", "--help")
    for command in plan.commands:
        plan.cli(f"help.{command}", command, "--help")
    for name in ("methods", "effects", "formats", "devices"):
        plan.cli(f"{name}.list", name)
        plan.cli(name, name, "--json")
    for page in plan.pages:
        plan.cli(f"guide.{page['id']}", "guide", page["id"])
    for command in ("generate", "answer", "score", "controls"):
        plan.steps.append(Step(f"help.blind.{command}", [command, "--help"], program="fieldtrue-blind"))


def add_tables(plan):
    """The tables that the other parts start from."""
    scene = plan.resource("rooms", "two_bodies.scene.json")
    floor = plan.resource("scenes", "steel_floor.scene.json")
    plan.do("make.mild", lambda build: build.write("mild.scene.json", json.dumps(MILD_SCENE).encode()))
    for name, plan_text, room in [("poses", PLAN, scene), ("mild", PLAN, "mild.scene.json"), ("floor", "grid:5x4x3@0.3048:order=serpentine", floor),
                                  ("turned", "grid:3x3x3@0.3:origin=0.6,-0.3,-0.3:orientations=3:reseat=2", scene),
                                  ("plane", "grid:6x6x1@0.2:origin=0.6,-0.5,-0.1", scene)]:
        plan.cli(f"simulate.{name}", "simulate", "--scene", room, "--plan", plan_text, "--seed", "5", "--nodes",
                 f"{name}.nodes.csv", "--samples", f"{name}.samples.csv", "--samples-per-node", "20", "--json")
    for name, edit in [("positions", positions_only), ("roles", with_validation), ("sensors", two_sensors),
                       ("millimetres", in_millimetres)]:
        plan.do(f"make.{name}", lambda build, name=name, edit=edit:
                edited_table(build, "poses.nodes.csv", f"{name}.nodes.csv", edit))
    plan.cli("simulate.clean", "simulate", "--plan", PLAN, "--nodes", "clean.nodes.csv", "--samples",
             "clean.samples.csv", "--samples-per-node", "20")


def add_simulate(plan):
    for folder in ("rooms", "scenes"):
        for name in sorted(os.listdir(plan.resource(folder))):
            room = name.removesuffix(".scene.json")
            plan.cli(f"simulate.{folder}.{room}", "simulate", "--scene", plan.resource(folder, name), "--plan",
                     "grid:4x3x3@0.3:orientations=2", "--seed", "3", "--nodes", f"{folder}.{room}.nodes.csv", "--samples",
                     f"{folder}.{room}.samples.csv", "--samples-per-node", "5")


def add_effects(plan):
    """Every effect simulated and looked for."""
    plan.do("make.scenes", lambda build: [
        build.write(f"{effect['id']}.scene.json", json.dumps(scene_of(effect)).encode())
        for effect in plan.lists["effects"]["effects"]])
    for effect in plan.lists["effects"]["effects"]:
        name = effect["id"]
        plan.cli(f"simulate.effect.{name}", "simulate", "--scene", f"{name}.scene.json", "--plan", PLAN, "--nodes",
                 f"{name}.nodes.csv", "--samples", f"{name}.samples.csv", "--samples-per-node", "20")
        plan.cli(f"diagnose.{name}", "diagnose", "--nodes", f"{name}.nodes.csv", "--samples", f"{name}.samples.csv",
                 "--out", f"diagnose.{name}.gap.json")


def choices(setting):
    """The other values of a setting that has a few."""
    if setting["type"] == "bool":
        return ["false" if setting["default"] else "true"]
    if setting["type"] == "choice":
        return [value for value in setting["choices"] if value != setting["default"]]
    if setting["type"] == "auto_number":
        return ["auto"] if setting["default"] != "auto" else []
    return []


def add_fit(plan):
    for kind, other in (("position", []), ("orientation", ["--position", "affine"])):
        for method in plan.lists["methods"][kind]:
            variants = [method["id"]] + [f"{method['id']}:{setting['key']}={value}" for setting in method["settings"]
                                         for value in choices(setting)]
            for text in variants:
                name = f"fit.{kind}.{re.sub('[^a-z0-9_]+', '-', text)}"
                plan.cli(name, "fit", "--nodes", "mild.nodes.csv", *other, f"--{kind}", text, "--out",
                         f"{name}.ftcal.json", "--json")
                if text == method["id"]:
                    plan.cli(f"apply.{name}", "apply", "--calibration", f"{name}.ftcal.json", "--in", "mild.samples.csv",
                             "--out", f"apply.{name}.csv")
    plan.cli("fit.known", "fit", "--nodes", "mild.nodes.csv", "--position", "polynomial:degree=2", "--orientation",
             "polynomial_quaternion", "--align", "none", "--out", "fit.known.ftcal.json")
    plan.cli("fit.plane", "fit", "--nodes", "plane.nodes.csv", "--position", "rbf", "--out", "fit.plane.ftcal.json")
    plan.cli("fit.sensor", "fit", "--nodes", "sensors.nodes.csv", "--sensor", "1", "--position", "affine", "--out",
             "fit.sensor.ftcal.json")
    plan.cli("fit.force", "fit", "--nodes", "millimetres.nodes.csv", "--force", "--position", "affine", "--out",
             "fit.force.ftcal.json")
    plan.cli("fit.baked", "fit", "--nodes", "mild.nodes.csv", "--position", "gaussian_process", "--orientation",
             "hmq_matrix", "--bake-um", "200", "--out", "fit.baked.ftcal.json", "--json")
    plan.cli("apply.baked", "apply", "--calibration", "fit.baked.ftcal.json", "--in", "mild.samples.csv", "--out",
             "apply.baked.csv", "--json")
    for method in ("briggs", "livingston", "czernuszenko"):
        plan.cli(f"resample.{method}", "resample", "--nodes", "mild.nodes.csv", "--method", method, "--plan",
                 "grid:4x3x3@0.25:origin=0.7,-0.3,-0.2", "--nodes-out", f"resample.{method}.nodes.csv", "--json")


def add_export(plan):
    plan.cli("fit.exported", "fit", "--nodes", "mild.nodes.csv", "--position", "hmq", "--orientation",
             "polynomial_quaternion", "--out", "exported.ftcal.json")
    for exporter in plan.lists["formats"]["export"]:
        name = f"export.{exporter['id']}"
        plan.cli(name, "export", "--calibration", "exported.ftcal.json", "--format", exporter["id"], "--out",
                 name + exporter["extension"], "--json")
        plan.cli(f"{name}.baked", "export", "--calibration", "exported.ftcal.json", "--format", exporter["id"],
                 "--bake-um", "500", "--out", f"{name}.baked" + exporter["extension"])


def add_compare(plan):
    plan.cli("compare.poses", "compare", "--nodes", "poses.nodes.csv", "--validate", "kfold:5", "--html",
             "compare.poses.html", "--json")
    plan.cli("compare.floor", "compare", "--nodes", "floor.nodes.csv", "--validate", "block:8", "--methods",
             "affine,trilinear,tetrahedral,polynomial:degree=3,hmq,rbf,polynomial_euler,hmq_matrix")
    plan.cli("compare.loo", "compare", "--nodes", "poses.nodes.csv", "--methods",
             "affine,local_briggs,polynomial:degree=2,hmq:r2_cm2=auto,bspline,slerp_trilinear", "--json")
    plan.cli("compare.curve", "compare", "--nodes", "poses.nodes.csv", "--validate", "kfold:5", "--methods",
             "affine,polynomial:degree=2,rbf", "--learning-curve", "--html", "compare.curve.html")
    for name, table in [("roles", "roles"), ("plane", "plane"), ("turned", "turned"), ("positions", "positions")]:
        plan.cli(f"compare.{name}", "compare", "--nodes", f"{table}.nodes.csv", "--methods",
                 "affine,polynomial:degree=2,rbf,polynomial_quaternion" if name != "positions" else "affine,hmq,rbf",
                 "--json")
    plan.cli("compare.none", "compare", "--nodes", "poses.nodes.csv", "--align", "none", "--methods", "rigid,affine",
             "--seed", "4", "--json")
    plan.cli("report.poses", "report", "--nodes", "poses.nodes.csv", "--methods", "affine,rbf,polynomial_quaternion",
             "--validate", "kfold:4", "--html", "report.poses.html", "--json")


def add_gap(plan):
    add_effects(plan)
    plan.cli("diagnose.page", "diagnose", "--nodes", "poses.nodes.csv", "--html", "diagnose.page.html", "--updated-scene",
             "updated.scene.json", "--out", "diagnose.page.gap.json", "--json")
    plan.cli("simulate.updated", "simulate", "--scene", "updated.scene.json", "--plan", PLAN, "--nodes",
             "updated.nodes.csv")
    plan.cli("diagnose.believed", "diagnose", "--nodes", "poses.nodes.csv", "--scene", "updated.scene.json", "--out",
             "diagnose.believed.gap.json")
    plan.cli("diagnose.against", "diagnose", "--nodes", "poses.nodes.csv", "--against", "clean.nodes.csv", "--out",
             "diagnose.against.gap.json", "--html", "diagnose.against.html")
    plan.cli("diagnose.positions", "diagnose", "--nodes", "positions.nodes.csv", "--out", "diagnose.positions.gap.json")
    plan.cli("diagnose.clean", "diagnose", "--nodes", "clean.nodes.csv", "--samples", "clean.samples.csv", "--out",
             "diagnose.clean.gap.json")
    for name, words in [("plan", ["--plan", PLAN]), ("nodes", ["--nodes", "turned.nodes.csv"]),
                        ("scene", ["--plan", "grid:3x3x3@0.3", "--scene", plan.resource("rooms", "mixed.scene.json")])]:
        plan.cli(f"plan-check.{name}", "plan-check", *words)
    plan.cli("plan-check.json", "plan-check", "--plan", PLAN, "--json")


def record_once(plan):
    """A session holds the moments of its readings, so that the old build records one for both."""
    lock = threading.Lock()
    recorded = []

    def record(build):
        with lock:
            if not recorded:
                subprocess.run([build.program("fieldtrue-cli"), "acquire", "--device", "simulated:speed=20", "--plan",
                                "grid:3x3x2@0.3:origin=0.6,-0.3,-0.15", "--auto", "--samples-per-node", "20", "--scene",
                                plan.resource("scenes", "steel_floor.scene.json"), "--session", "one.fieldtrue"],
                               cwd=build.work, stdin=subprocess.DEVNULL, capture_output=True, check=True, timeout=120)
                recorded.append(os.path.join(build.work, "one.fieldtrue"))
                shutil.copy(recorded[0], os.path.join(build.work, "..", "one.fieldtrue"))
            else:
                shutil.copy(os.path.join(build.work, "..", "one.fieldtrue"), build.work)

    return record


def record_emulated(build):
    """An emulated tracker that stands still, recorded over a pseudo-terminal by pressing Enter."""
    rows = "".join(f"-1,0,0,{i / 100:.2f},0.4,-0.127,0.0635,1,0,0,0,\n" for i in range(3000))
    build.write("still.samples.csv", ("node,sensor,visit,t_s,x_m,y_m,z_m,qw,qx,qy,qz,status\n" + rows).encode())
    pipes = {"cwd": build.work, "stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT,
             "text": True}
    emulator = subprocess.Popen([build.program("fieldtrue-cli"), "emulate", "fastrak", "--pty", "line", "--replay",
                                 "still.samples.csv", "--duration", "60"], **pipes)
    told = emulator.stdout.readline()
    host = subprocess.Popen([build.program("fieldtrue-cli"), "acquire", "--device", "fastrak:line", "--plan",
                             "grid:1x1x1@0.2", "--samples-per-node", "20", "--session", "live.fieldtrue"], **pipes)
    for line in host.stdout:
        if line.startswith("Next: "):
            host.stdin.write("\n")
            host.stdin.flush()
    emulator.terminate()
    build.write("emulate.txt", f"{told}host: {host.wait()}, emulator: {emulator.wait()}\n".encode())


def add_session(plan):
    plan.do("record.once", record_once(plan))
    plan.cli("tables.one", "tables", "--session", "one.fieldtrue", "--nodes", "one.nodes.csv", "--samples",
             "one.samples.csv", "--json")
    plan.cli("report.one", "report", "--session", "one.fieldtrue", "--methods", "affine,polynomial:degree=1", "--html",
             "report.one.html")
    plan.cli("acquire.resumed", "acquire", "--device", "simulated:speed=20", "--auto", "--session", "one.fieldtrue",
             last_line_only=True)
    plan.cli("acquire.new", "acquire", "--device", "simulated:speed=20", "--plan", "grid:2x2x1@0.3", "--auto",
             "--samples-per-node", "10", "--session", "new.fieldtrue", last_line_only=True)
    plan.do("record.emulated", record_emulated)
    plan.cli("tables.live", "tables", "--session", "live.fieldtrue", "--nodes", "live.nodes.csv")
    # The readings' times are those of the table, whenever they are played.
    plan.cli("signal.still", "signal", "--device", "trace:still.samples.csv,rate=100", "--seconds", "25", "--json")
    plan.do("live.times", lambda build: edited_table(build, "live.nodes.csv", "live.nodes.csv", without_times))


def add_recordings(plan):
    def at(*path):
        return os.path.join(plan.data, *path)

    if not plan.data or not os.path.isdir(plan.data):
        plan.not_covered.append("real recordings, FIELDTRUE_REAL_DATA does not name a folder")
        return
    conditions = ("standard_data_grid", "interpolate_data_grid", "interpolate_data_grid_probe_calibrate",
                  "finer_mesh_points", "finer_mesh_3axis", "steel_shield")
    for condition in conditions:
        plan.cli(f"import.{condition}", "import", "--format", f"anser:condition={condition}", "--in",
                 at("anser_duplo", "nodes.csv"), "--nodes", f"{condition}.nodes.csv", "--json")
        plan.cli(f"compare.{condition}", "compare", "--nodes", f"{condition}.nodes.csv", "--methods",
                 "affine,polynomial:degree=2,hmq,gaussian_process", "--validate", "loo", "--json")
    plan.cli("diagnose.shield", "diagnose", "--nodes", "steel_shield.nodes.csv", "--against",
             "standard_data_grid.nodes.csv", "--out", "diagnose.shield.gap.json")
    plan.cli("import.fcsv", "import", "--format", "fcsv", "--in", at("anser_duplo", "raw", "steel_shield.fcsv"), "--truth",
             "standard_data_grid.nodes.csv", "--nodes", "fcsv.nodes.csv")
    plan.cli("import.plus", "import", "--format", "plus", "--in", at("pluslib_fcal", "samples.csv"), "--nodes",
             "plus.nodes.csv", "--samples", "plus.samples.csv", "--json")
    plan.cli("compare.plus", "compare", "--nodes", "plus.nodes.csv", "--methods", "affine,polynomial:degree=1", "--json")
    plan.cli("diagnose.plus", "diagnose", "--nodes", "plus.nodes.csv", "--samples", "plus.samples.csv", "--out",
             "diagnose.plus.gap.json", "--html", "diagnose.plus.html")
    plan.cli("import.columns", "import", "--format",
             "columns:x=tip_mean_x_mm,y=tip_mean_y_mm,z=tip_mean_z_mm,x_true=true_x_mm,y_true=true_y_mm,"
             "z_true=true_z_mm,node=landmark", "--in", at("pluslib_fcal", "nodes.csv"), "--nodes", "columns.nodes.csv")
    plan.cli("import.traj", "import", "--format", "traj", "--in", at("polhemus_hand", "user1_cup0.traj"), "--samples",
             "traj.samples.csv")
    plan.cli("compare.lighthouse", "compare", "--nodes", at("lighthouse", "20200918_Exp2.nodes.csv"), "--methods",
             "affine,polynomial:degree=2,rbf,polynomial_quaternion", "--json")
    plan.cli("diagnose.lighthouse", "diagnose", "--nodes", at("lighthouse", "20200918_Exp1.nodes.csv"), "--out",
             "diagnose.lighthouse.gap.json")


REFUSED = """
calibrate
fit --nodes poses.nodes.csv
compare --nodes poses.nodes.csv --colour red
compare --nodes poses.nodes.csv --methods magic
compare --nodes poses.nodes.csv --methods polynomial:degree=9
compare --nodes poses.nodes.csv --methods polynomial:order=2
compare --nodes poses.nodes.csv --validate kfold:x
compare --nodes millimetres.nodes.csv --methods affine
compare --nodes sensors.nodes.csv --methods affine
compare --nodes none.csv
compare --nodes .
compare --nodes exported.ftcal.json
simulate --plan grid:2x2@0.1 --nodes o.csv
simulate --plan grid:2x2x2@0.1 --nodes o.csv --seed seven
simulate --plan grid:2x2x2@0.1 --nodes none/o.csv
simulate --plan grid:2x2x2@0.1 --nodes o.csv --scene none.scene.json
simulate --plan grid:2x2x2@0.1 --nodes o.csv --samples o.csv
fit --nodes poses.nodes.csv --position magic --out o.json
fit --nodes poses.nodes.csv --position affine --align loose --out o.json
apply --calibration poses.nodes.csv --in poses.nodes.csv --out o.csv
apply --calibration none.json --in poses.nodes.csv --out o.csv
export --calibration none.json --format csv --out o
import --format xls --in poses.nodes.csv --nodes o.csv
import --format traj --in poses.nodes.csv
report --html o.html
report --session poses.nodes.csv --html o.html
tables --session none.fieldtrue --nodes o.csv
diagnose --nodes plane.nodes.csv --scene poses.nodes.csv --out o.gap.json
plan-check
plan-check --plan grid:2x2x1@0.2
acquire --device sonar --session o.fieldtrue
signal --device sonar
acquire --device simulated --session o.fieldtrue
emulate sonar --listen 0
emulate fastrak --listen 0 --faults fire
resample --nodes poses.nodes.csv --method magic --plan grid:2x2x2@0.1 --nodes-out o.csv
"""


def add_refusals(plan):
    for i, line in enumerate(REFUSED.strip().splitlines()):
        plan.cli(f"refused.{i + 1:02}.{line.split()[0]}", *line.split())


def forget_seconds(build):
    """The seconds that each answer took are figures of the score."""
    path = os.path.join(build.work, "blind", "answers.json")
    with open(path, encoding="utf-8") as file:
        answers = json.load(file)
    for one in answers["sessions"]:
        one["seconds"] = 1.0
    build.write(os.path.join("blind", "answers.json"), json.dumps(answers, indent=1).encode())


def add_blind(plan):
    def blind(name, *words, **more):
        plan.steps.append(Step(f"blind.{name}", list(words), program="fieldtrue-blind", **more))

    blind("generate", "generate", "--seed", "7", "--sessions", "4", "--levels", "--max-rows", "60", "--out", "blind")
    blind("answer", "answer", "--in", "blind", "--limit", "200")
    blind("controls", "controls", "--in", "blind", "--out", "controls", "--count", "1")
    blind("score", "score", "--in", "blind", "--json", "blind/score.json", "--markdown", "blind/score.md",
          before=forget_seconds)


def steps(build, root, data, parts):
    """@return the steps, and what could not be covered"""
    plan = Plan(build, root, data, parts)
    add_tables(plan)
    for part, add in [("lists", add_lists), ("simulate", add_simulate), ("fit", add_fit), ("export", add_export),
                      ("compare", add_compare), ("gap", add_gap), ("session", add_session),
                      ("recordings", add_recordings), ("refusals", add_refusals), ("blind", add_blind)]:
        if plan.wants(part):
            add(plan)
    if parts is None:
        used = {step.words[0] for step in plan.steps if step.words} | {"emulate", "blind"}
        plan.not_covered += [f"the command {name}" for name in plan.commands if name not in used]
    return plan.steps, plan.not_covered
