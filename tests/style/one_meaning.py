#!/usr/bin/env python3
"""One name, one meaning: names that two files define differently and that one program links.

The linker keeps one of two such definitions and says nothing (undefined behaviour, [basic.def.odr]). Found here:
  - a struct, class, union or enum of one namespace defined in two files;
  - a function of one namespace with the same parameters but two different results (the result is not part of the
    linker's name of a plain function);
  - a function of one namespace defined in two files.
What stands in an anonymous namespace, or is static, belongs to its file alone. `main` is one a program.

usage: one_meaning.py FOLDER... [-FILE...]      -FILE: one that takes another's place in a program of its own
exit status 0: none found; 1: found, one line each
"""
import re
import sys
from collections import defaultdict
from pathlib import Path

TYPE = re.compile(r"^(?:template\s*<.*>\s*)?(?:enum\s+(?:class|struct)|struct|class|union|enum)\s+"
                  r"(?:alignas\s*\([^)]*\)\s*|\[\[[^\]]*\]\]\s*)*(\w+)(?:\s+final)?\s*(?::[^:].*)?$", re.S)
FUNCTION = re.compile(r"^(?P<result>[\w:<>,&*\s\[\]()]*?[\w>&*\]])\s+(?P<refs>[&*]*)(?P<name>\w+)\s*\((?P<params>.*)\)"
                      r"\s*(?:noexcept)?\s*$", re.S)
NOT_RESULTS = {"return", "else", "using", "typedef", "case", "throw", "new", "delete", "co_return", "goto"}


def without_comments_and_strings(text):
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.S)
    text = pattern.sub(lambda m: '""' if m.group(0)[0] in "\"R'" else " ", text)
    text = re.sub(r"\b[A-Z0-9_]+_API\b", " ", text)  # Says who sees a name, not what it means.
    return re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", "", text, flags=re.M)


def split_parameters(text):
    parts, depth, start = [], 0, 0
    for i, c in enumerate(text):
        if c in "(<[{":
            depth += 1
        elif c in ")>]}":
            depth -= 1
        elif c == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    parts.append(text[start:])
    return [p for p in (p.strip() for p in parts) if p]


def type_of_parameter(text):
    text = text.split("=")[0].strip()
    text = re.sub(r"\bconst\b(?=\s+\w+\s*$)", "", text)
    named = re.match(r"(.*[\s&*>])(\w+)$", text, re.S)
    if named and named.group(1).strip() not in ("const", "unsigned", "long", "struct"):
        text = named.group(1)
    return re.sub(r"\s+", "", re.sub(r"\s*::\s*", "::", re.sub(r"^const (?=[\w:]+$)", "", text.strip())))


def statements(text):
    """(namespace, head, ends with '{' or ';') of everything at namespace scope; '' is the global namespace."""
    names, start, i = [], 0, 0
    while i < len(text):
        c = text[i]
        if c == ";":
            yield "::".join(names), text[start:i].strip(), ";"
            start = i + 1
        elif c == "{":
            head = text[start:i].strip()
            space = re.match(r"(?:inline\s+)?namespace\b\s*([\w:]*)$", head)
            if space is not None:
                names.append(space.group(1) or "(anonymous)")
            elif head == 'extern ""':
                names.append("")
            else:
                yield "::".join(names), head, "{"
                depth = 1
                while depth and i + 1 < len(text):
                    i += 1
                    depth += (text[i] == "{") - (text[i] == "}")
            start = i + 1
        elif c == "}":
            if names:
                names.pop()
            start = i + 1
        i += 1


def read(path, types, results, definitions):
    text = without_comments_and_strings(path.read_text(encoding="utf-8"))
    aliases = re.findall(r"\busing\s+(\w+)\s*=\s*([\w:]+)\s*;", text)
    aliases += [(name, space + name) for space, name in re.findall(r"\busing\s+((?:\w+::)+)(\w+)\s*;", text)]
    for alias, meaning in aliases:
        text = re.sub(rf"(?<![\w:]){alias}\b", meaning, text)
    for space, head, end in statements(text):
        if "(anonymous)" in space:
            continue
        head = re.sub(r"\s+", " ", re.sub(r"\[\[[^\]]*\]\]", "", head)).strip()
        kind = TYPE.match(head)
        if kind:
            if end == "{" and not re.match(r"template\s*<\s*>", head):
                types[(space, kind.group(1))].add(path)
            continue
        if head.startswith("template") or "operator" in head or "=" in head.split("(")[0]:
            continue
        if end == "{":
            head = re.sub(r"\)\s*:[^:].*$", ")", head)
        function = FUNCTION.match(head)
        if not function:
            continue
        words = function["result"].split()
        if not words or words[0] in NOT_RESULTS or "static" in words or function["name"] == "main":
            continue
        aside = ("inline", "constexpr", "extern", "friend", "explicit", "FIELDTRUE_CLONES")
        result = " ".join(w for w in words if w not in aside)
        result = re.sub(r"\s+", "", result.replace("fieldtrue::", "")) + function["refs"]
        if not result or "(" in result:
            continue
        parameters = tuple(type_of_parameter(p).replace("fieldtrue::", "") for p in split_parameters(function["params"]))
        key = (space, function["name"], parameters)
        results[key][result].add(path)
        if end == "{":
            definitions[key].add(path)


def main(folders):
    types, definitions = defaultdict(set), defaultdict(set)
    results = defaultdict(lambda: defaultdict(set))
    left_out = {Path(argument[1:]) for argument in folders if argument.startswith("-")}
    folders = [argument for argument in folders if not argument.startswith("-")]
    files = [p for folder in folders for p in sorted(Path(folder).rglob("*"))
             if p.suffix in (".h", ".cpp") and p not in left_out]
    if not files:
        print("no .h or .cpp file in " + " ".join(folders))
        return 1
    for path in files:
        read(path, types, results, definitions)
    found = []
    named = lambda space, name: (space + "::" if space else "") + name
    where = lambda paths: ", ".join(str(p) for p in sorted(paths))
    for (space, name), paths in types.items():
        if len(paths) > 1:
            found.append(f"{named(space, name)} is defined in {where(paths)}")
    for (space, name, parameters), by_result in results.items():
        text = f"{named(space, name)}({', '.join(parameters)})"
        if len(by_result) > 1:
            both = " and ".join(f"{r} in {where(p)}" for r, p in sorted(by_result.items()))
            found.append(f"{text} gives {both}")
        elif len(definitions[(space, name, parameters)]) > 1:
            found.append(f"{text} is defined in {where(definitions[(space, name, parameters)])}")
    for line in sorted(found):
        print(line)
    if not found:
        print(f"{len(files)} files: {len(types)} types and {len(results)} functions, each with one meaning")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
