#!/usr/bin/env python3
"""Shows that one_meaning.py finds each kind of double meaning, and none where there is none."""
import subprocess
import sys
import tempfile
from pathlib import Path

SCRIPT = Path(__file__).with_name("one_meaning.py")

CASES = [
    ("two types", {"a.h": "namespace n { struct Row { int a; }; }", "b.h": "namespace n { struct Row final { double b; }; }"},
     "n::Row is defined in"),
    ("two enums", {"a.h": "enum class Kind { kA };", "b.cpp": "enum class Kind : int { kB };"}, "Kind is defined in"),
    ("two results", {"a.h": "namespace n { std::string text(double value); }", "b.h": "namespace n { QString text(double error_m); }"},
     "n::text(double) gives"),
    ("two bodies", {"a.cpp": "namespace n { int f(const Row& row) { return 1; } }", "b.cpp": "namespace n { int f(const Row& r) { return 2; } }"},
     "n::f(constRow&) is defined in"),
    ("other namespaces", {"a.h": "namespace n { struct Row { int a; }; }", "b.h": "namespace m { struct Row { double b; }; }"}, None),
    ("of one file", {"a.cpp": "namespace n { namespace { struct Row { int a; }; int f() { return 1; } } }",
                     "b.cpp": "namespace n { namespace { struct Row { double b; }; int f() { return 2; } } static int g() { return 1; } }",
                     "c.cpp": "namespace n { static int g() { return 3; } }"}, None),
    ("declared, then defined", {"a.h": "namespace n { struct Row; nlohmann::json f(int a = 3); }",
                                "a.cpp": "using json = nlohmann::json; namespace n { nlohmann::json f(int b) { return {}; } }",
                                "b.h": "using nlohmann::json; namespace n { json f(int a); } // struct Row { }"}, None),
    ("overloads", {"a.h": "namespace n { int f(int a); int f(double a); double f(int a, int b); }"}, None),
    ("members", {"a.cpp": "struct A { struct Impl; }; struct A::Impl { int a; };", "b.cpp": "struct B { struct Impl; }; struct B::Impl { int b; };"},
     None),
]


def check(name, files, expected):
    with tempfile.TemporaryDirectory() as folder:
        for file, text in files.items():
            Path(folder, file).write_text(text, encoding="utf-8")
        run = subprocess.run([sys.executable, str(SCRIPT), folder], capture_output=True, text=True)
    good = run.returncode == (1 if expected else 0) and (expected is None or expected in run.stdout) and not run.stderr
    print(("ok       " if good else "NOT OK   ") + name + ("" if good else ": " + run.stdout + run.stderr))
    return good


if __name__ == "__main__":
    results = [check(*case) for case in CASES]
    empty = subprocess.run([sys.executable, str(SCRIPT), tempfile.gettempdir() + "/no such folder"], capture_output=True)
    results.append(empty.returncode == 1)
    sys.exit(0 if all(results) else 1)
