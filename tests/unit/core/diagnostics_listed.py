"""Every diagnostic id in the compiler's and the runtime's sources has a row in docs/troubleshooting.md, each with a
cause and a remedy, and occurs in a test. Ids that the page explains and nothing raises are errors too.

usage: diagnostics_listed.py ROOT
"""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])
CALL = re.compile(r"""(?:\b(?:fail|warn|warning|error|report)\(|\.id\ =\ )      # how the compiler raises one
                      (?:[^"();]|\([^()]*\))*?"([a-z0-9]+(?:-[a-z0-9]+)+|barrier|kill|optimizer)"
                      (?!\s*\))""", re.VERBOSE)
ids = set()
for source in sorted((root / "compiler").rglob("*.cpp")):
    ids |= set(CALL.findall(source.read_text()))

# The runtime raises them through rtr_error and short names for it; the id is the first string.
RUNTIME = re.compile(r'''\b(?:rtr_\w*error|rtr_warn\w*|bad|report|reject|check_limit)\((?:[^()"]|\([^()]*\))*?
                         "([a-zA-Z][A-Za-z0-9]*(?:-[a-z0-9]+)*(?:\[0\])?)",''', re.VERBOSE)
runtime = set()
for source in [*sorted((root / "runtime").glob("*.c")), root / "include/rtc/runtime_compiler.h"]:
    text = source.read_text()
    runtime |= set(RUNTIME.findall(text))
    calls = len(re.findall(r"\brtr_error\(\w[^;]*?VK_ERROR", text))
    named = len(re.findall(r'\brtr_error\(\w[^;]*?VK_ERROR[^;]*?"', text))
    if calls != named:
        sys.exit(f"{source}: a call of rtr_error that this script cannot read")
rows = [line for line in (root / "docs/troubleshooting.md").read_text().splitlines() if line.startswith("| `")]
documented = set(i for row in rows for i in re.findall(r"`([a-zA-Z0-9\[\]-]+)`", row.split("|")[1]))
# Tables of three columns have the remedy in a cell of its own; in those of two it is part of the cause.
page = (root / "docs/troubleshooting.md").read_text().splitlines()
bare, columns = [], 0
for line in page:
    cells = [c.strip() for c in re.split(r"(?<!\\)\|", line.strip())[1:-1]]
    if re.match(r"\|[ -]+\|", line.strip()):
        columns = len(cells)
    elif cells and (len(cells) != columns and line in rows or not all(cells)):
        bare.append(line)
ids |= runtime
tests = "".join(p.read_text(errors="replace") for p in (root / "tests/unit").rglob("*") if p.is_file())
# Nothing but a bug of rtc or of the optimiser raises these; no input is known that does.
UNTESTED = {"internal-error", "internal-invalid-module", "internal-traversal", "optimizer", "instruction-too-long",
            "branch-target", "pointer-phi"}

bad = [f"{i}: no row in docs/troubleshooting.md" for i in sorted(ids - documented)]
bad += [f"{i}: no test in tests/unit" for i in sorted(ids - UNTESTED) if f'"{i}"' not in tests and f'"{i}: ' not in tests]
bad += [f"{row}: no cause, or no remedy" for row in bare]
everything = "".join(p.read_text() for p in (root / "compiler").rglob("*.cpp"))
bad += [f"{i}: explained, and nothing raises it" for i in sorted(documented - ids) if f'"{i}"' not in everything]
print(f"{len(ids)} diagnostics, {len(runtime)} of them the runtime's")
print("\n".join(bad))
sys.exit(1 if bad or len(ids) < 40 else 0)
