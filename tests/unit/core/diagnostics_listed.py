"""Every diagnostic id in the compiler's sources has a row in docs/troubleshooting.md, and the core's occur in a test
(the front end's and the C library's tests look at messages instead).

usage: diagnostics_listed.py ROOT
"""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])
CALL = re.compile(r"""(?:\b(?:fail|warn|warning|error|report)\(|\.id\ =\ )      # how the compiler raises one
                      (?:[^"();]|\([^()]*\))*?"([a-z0-9]+(?:-[a-z0-9]+)+|barrier|kill|optimizer)"
                      (?!\s*\))""", re.VERBOSE)
ids, core = set(), set()
for source in sorted((root / "compiler").rglob("*.cpp")):
    found = set(CALL.findall(source.read_text()))
    ids |= found
    if source.parts[-2] not in ("frontend", "api"):
        core |= found
documented = set(re.findall(r"`([a-z0-9-]+)`", (root / "docs/troubleshooting.md").read_text()))
tests = "".join(p.read_text(errors="replace") for p in (root / "tests/unit").rglob("*") if p.is_file())
# Nothing but a bug of rtc or of the optimiser raises these; no input is known that does.
UNTESTED = {"internal-error", "internal-invalid-module", "internal-traversal", "optimizer", "instruction-too-long",
            "branch-target", "pointer-phi"}

bad = [f"{i}: no row in docs/troubleshooting.md" for i in sorted(ids - documented)]
bad += [f"{i}: no test in tests/unit" for i in sorted(core - UNTESTED) if f'"{i}"' not in tests]
print(f"{len(ids)} diagnostics")
print("\n".join(bad))
sys.exit(1 if bad or len(ids) < 40 else 0)
