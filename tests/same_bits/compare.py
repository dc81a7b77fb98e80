"""Compares the files that two builds wrote: to the bit but for times, dates and the software's name."""
import base64
import difflib
import json
import os
import re

import png

DURATION = r"\d+(?:\.\d+)? (?:ns|us|ms|s)"
MASKS = [
    # What JSON calls them, compact or not.
    (re.compile(r'("(?:fit_s|eval_ns|software|date)": ?)("(?:[^"\\]|\\.)*"|[^\s,}\]]+)'), r"\1*"),
    # The head of a table.
    (re.compile(r"^(# ?(?:software|date): ?).*"), r"\1*"),
    # Any moment.
    (re.compile(r"\b20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?(?:Z|[+-]\d\d:\d\d)?"), "*"),
    # The two last columns of a comparison, on a terminal and on a page; on a terminal their width moves the heading.
    (re.compile(rf"  +{DURATION}  +{DURATION}$"), "  *  *"),
    (re.compile(r"  +fit  +evaluation$"), "  fit  evaluation"),
    (re.compile(rf'(<td class="number">){DURATION}(</td>)'), r"\1*\2"),
]
# A checksum over a text that names the software.
CHECKSUM = (re.compile(r'("(?:checksum|answer_sha256)": ?)"[^"]*"'), r"\1*")
PICTURE = re.compile(r"data:image/png;base64,([A-Za-z0-9+/=]+)")
# Sessions hold the moment of each reading; what is in them is compared as tables.
NOT_COMPARED = (".fieldtrue", ".fieldtrue-wal", ".fieldtrue-shm")


def masked(line, masks):
    for pattern, replacement in masks:
        line = pattern.sub(replacement, line)
    return line


def around(old, new, most=100):
    """Two lines from shortly before their first difference on."""
    start = next((i for i, (a, b) in enumerate(zip(old, new)) if a != b), min(len(old), len(new)))
    begin = max(0, start - 40) if max(len(old), len(new)) > most else 0
    return [("..." if begin else "") + text[begin : begin + most] + ("..." if len(text) > begin + most else "")
            for text in (old, new)]


def paired(old, new):
    """Lines that belong together: (number in the old file, old, new); None where a line stands in one file only."""
    if len(old) == len(new):
        return [(i + 1, a, b) for i, (a, b) in enumerate(zip(old, new))]
    pairs = []
    for kind, i, i_end, j, j_end in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if kind == "equal":
            continue
        for k in range(max(i_end - i, j_end - j)):
            pairs.append((min(i + k, i_end) + 1, old[i + k] if i + k < i_end else None,
                          new[j + k] if j + k < j_end else None))
    return pairs


def text_differences(old, new, masks):
    """(line, old, new) of each line that differs, and of each picture in it."""
    found = []
    old_pictures, new_pictures = ([base64.b64decode(one) for one in PICTURE.findall(text)] for text in (old, new))
    old_lines, new_lines = ([masked(PICTURE.sub("a picture", line), masks) for line in text.split("\n")]
                            for text in (old, new))
    for number, a, b in paired(old_lines, new_lines):
        if a != b:
            found.append((f"line {number}", *(around(a, b) if a is not None and b is not None else (a, b))))
    for i, (a, b) in enumerate(zip(old_pictures, new_pictures)):
        if told := png.difference(a, b):
            found.append((f"picture {i + 1}", told, None))
    return found


def file_differences(old_path, new_path, masks):
    with open(old_path, "rb") as old_file, open(new_path, "rb") as new_file:
        old, new = old_file.read(), new_file.read()
    if old == new:
        return []
    if old.startswith(png.SIGNATURE):
        told = png.difference(old, new)
        return [("picture", told, None)] if told else []
    try:
        return text_differences(old.decode(), new.decode(), masks)
    except UnicodeDecodeError:
        first = next((i for i, (a, b) in enumerate(zip(old, new)) if a != b), min(len(old), len(new)))
        return [(f"byte {first}", old[first : first + 16].hex(" "), new[first : first + 16].hex(" "))]


def files_of(folder):
    found = {os.path.relpath(os.path.join(where, name), folder) for where, _, names in os.walk(folder) for name in names}
    return {name for name in found if not name.endswith(NOT_COMPARED)}


def differences(old_folder, new_folder, same_software):
    """[(file, where, old, new)] over all files of two folders, and how many files there are."""
    masks = MASKS if same_software else [*MASKS, CHECKSUM]
    old_files, new_files = files_of(old_folder), files_of(new_folder)
    found = [(name, "the whole file", "is there", "is missing") for name in sorted(old_files - new_files)]
    found += [(name, "the whole file", "is missing", "is there") for name in sorted(new_files - old_files)]
    for name in sorted(old_files & new_files):
        for one in file_differences(os.path.join(old_folder, name), os.path.join(new_folder, name), masks):
            found.append((name, *one))
    return found, len(old_files | new_files)


# How much the numbers of the JSON files changed.

MASKED_KEYS = {"fit_s", "eval_ns", "software", "date", "checksum", "answer_sha256"}
NAMES = ("method", "effect", "id", "name", "kind", "file")


def by_name(values):
    """The items of a list under what they call themselves and a count, so that another order is no change."""
    items = {}
    for value in values:
        names = [value[key] for key in NAMES if isinstance(value, dict) and isinstance(value.get(key), str)]
        name = names[0] if names else ""
        count = 0
        while (name, count) in items and name:
            count += 1
        items[(name, count) if name else (name, len(items))] = value
    return items


class Changes:
    """Largest relative change of each number by its path, and texts that changed."""

    def __init__(self):
        self.numbers = {}
        self.texts = []

    def number(self, file, path, old, new, scale):
        change = abs(new - old) / scale
        if change > self.numbers.get(path, (0,))[0]:
            self.numbers[path] = (change, old, new, file)

    def compare(self, file, path, old, new):
        if isinstance(old, dict) and isinstance(new, dict):
            for key in sorted(old.keys() | new.keys()):
                if key not in MASKED_KEYS:
                    self.compare(file, f"{path}.{key}", old.get(key), new.get(key))
        elif isinstance(old, list) and isinstance(new, list):
            self.compare_lists(file, path, old, new)
        elif is_number(old) and is_number(new):
            if old != new:
                self.number(file, path, old, new, max(abs(old), abs(new)))
        elif old != new:
            self.texts.append((path, file, old, new))

    def compare_lists(self, file, path, old, new):
        if len(old) == len(new) and all(map(is_number, old + new)):
            # A vector is measured by its largest component.
            scale = max(map(abs, old + new), default=0)
            for a, b in zip(old, new):
                if a != b:
                    self.number(file, path + "[]", a, b, scale)
            return
        old_items, new_items = by_name(old), by_name(new)
        if list(old_items) != list(new_items):
            self.texts.append((path + " (its items)", file, *([key[0] for key in items] if len(items) < 30 else len(items)
                                                              for items in (old_items, new_items))))
        for key in old_items.keys() & new_items.keys():
            self.compare(file, f"{path}[{key[0]}]", old_items[key], new_items[key])


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def changes(old_folder, new_folder):
    """Changes over all JSON files, and the other files that differ in any way."""
    found = Changes()
    others = [name for name in files_of(old_folder) ^ files_of(new_folder)]
    for name in sorted(files_of(old_folder) & files_of(new_folder)):
        paths = os.path.join(old_folder, name), os.path.join(new_folder, name)
        try:
            old, new = (json.load(open(path, encoding="utf-8")) for path in paths)
        except (ValueError, UnicodeDecodeError):
            if file_differences(*paths, [*MASKS, CHECKSUM]):
                others.append(name)
            continue
        found.compare(name, name.split(".")[0], old, new)
    return found, sorted(others)
